// The surface of what is wet, from cells of water. Private to libs/display/view; no VTK.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "osteo/simulation/bone/dust.h"

namespace osteo::inline display {

/// Where water stands, and films over bone: triangles, each drawn from outside only.
struct LiquidSurface {
  std::vector<std::array<float, 3>> points_mm, normals;
  std::vector<std::array<std::uint8_t, 4>> rgba;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  /// Water in the air: middle and radius of drops, spread over kSpread cells so that cells below each other make no
  /// rows, and how thick the slurry is (0: clear water, 1: as pale as bone).
  struct Drop {
    std::array<float, 3> middle_mm;
    float radius_mm, thick;
  };
  static constexpr double kSpread = 2.5;
  std::vector<Drop> drops;
};

/// Surface nets of bone and water together, of which those triangles stay that lie at water: so a film follows the
/// bone's own surface, slightly outside it. Water stands where bone is beside it or, along gravity with water all the
/// way, below it; what falls is drops. Normals are smoothed over three rings. Colour: from clear and dark to the bone's
/// own by how thick the slurry is. Cost: 0.1 ms a brick of 8^3 cells that holds water.
[[nodiscard]] LiquidSurface liquid_surface(const Dust& dust);

}  // namespace osteo::inline display
