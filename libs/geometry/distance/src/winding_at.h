// How often a surface winds around the places behind and before some of its own triangles. Private to
// libs/geometry/distance.
#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/data/vec.h"

namespace osteo::inline geometry {

/// Triangles that count `net` times, as they face.
struct Layer {
  std::array<std::uint32_t, 3> corners;
  int net;
};

/// A place within a triangle, away from its edges.
struct PlaceOn {
  std::uint32_t layer;
  Vec3 at;
};

/// For each place how often a closed surface winds around what lies right behind it. Before it that is the triangle's
/// `net` less.
///
/// Counts what a ray along an axis crosses: the axis that the triangle at the place faces most, so that the ray does
/// not graze it. Which edges a ray passes, and where, is decided for the edge alone (LevelCut): what is counted is the
/// winding number of a surface that is closed as well, and nowhere farther off than rounding. So the number is right
/// where no other triangle, and no edge of its own, is as near to the place as rounding can reach. Where one is, there
/// is no answer. All rays are followed in one pass over the triangles, each of which asks for the rays within its box:
/// expected O(triangles + crossings).
[[nodiscard]] std::vector<std::optional<int>> windings_behind(const std::vector<Vec3>& points,
                                                              const std::vector<Layer>& closed,
                                                              std::span<const PlaceOn> places, const Context& context);

}  // namespace osteo::inline geometry
