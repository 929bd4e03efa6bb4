// The colour of bone at each point of its surface.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "osteo/display/view/detail/openness.h"
#include "osteo/geometry/mesh/bone_surface.h"
#include "osteo/simulation/bone/hardness.h"
#include "osteo/simulation/bone/structure_map.h"

namespace osteo::inline display {

using Rgb = std::array<std::uint8_t, 3>;

struct ShineMemo;

/// Dense bone is ivory. Where the millimetre below the surface is hardly denser than marrow, as on a cut through the
/// diploe, it is redder and speckled; the speckle belongs to the place, not to the triangles. What is less than
/// kShownThroughMm below shines through in its structure's colour, the more the thinner the bone is: the bone left
/// above it is measured to the structure's face, so the colour has no steps. All of it is darker where little light
/// gets in (Openness), but never below kDarkest of itself. Colours are such that under set_up_scene's lights no channel
/// reaches 250. Not thread-safe while renew() runs.
class BonePaint {
 public:
  static constexpr double kShownThroughMm = 2.5;
  static constexpr double kDarkest = 0.34;

  /// `structures`, which must outlive this, and `hardness` may be null. The bone is only read here.
  BonePaint(const BrickGrid& bone, const StructureMap* structures, std::shared_ptr<const Hardness> hardness);
  /// Voxels of these bricks have changed.
  void renew(const BrickGrid& bone, std::span<const std::uint32_t> bricks) { openness_->renew(bone, bricks); }
  /// How deep places of this bone lie; it changes with renew().
  [[nodiscard]] std::shared_ptr<const Openness> openness() const { return openness_; }
  /// Bone of the same world that shades this too: a finer region and what is around it.
  void shade_with(std::vector<std::shared_ptr<const Openness>> others) { others_ = std::move(others); }
  /// One for each vertex of a patch. About 0.5 us each, near structures 1. `memo` of the patch, if any: what shines
  /// through a vertex that is where it was, its normal turned by less than a degree, is not looked for again.
  void paint(const BrickGrid& bone, const SurfacePatch& patch, std::vector<Rgb>& colours,
             ShineMemo* memo = nullptr) const;

 private:
  [[nodiscard]] double density_below(const BrickGrid& bone, Vec3 index, Vec3 outwards_index) const;
  const StructureMap* structures_;
  std::shared_ptr<const Hardness> hardness_;
  std::shared_ptr<Openness> openness_;
  std::vector<std::shared_ptr<const Openness>> others_;
};

/// How much of a structure's colour comes through the bone above it, 0 to 1, along the way `inwards` from a point of
/// the surface, and whose.
struct Shine {
  double share = 0;
  std::uint8_t structure = 0;
};
[[nodiscard]] Shine shine_through(const StructureMap& structures, Vec3 at_mm, Vec3 inwards);

/// What was found for the vertices of a patch: drilling changes some of them, and the normals around many times more.
struct ShineMemo {
  struct Found {
    std::array<float, 3> index, normal;
    Shine shine;
  };
  std::unordered_map<std::uint64_t, Found> of_key;
};

}  // namespace osteo::inline display
