// The surface of what is wet, from cells of water. Private to libs/view; no VTK.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "osteo/bone/dust.h"

namespace osteo {

/// Where water stands, and films over bone: triangles, each drawn from outside only.
struct LiquidSurface {
  std::vector<std::array<float, 3>> points_mm, normals;
  std::vector<std::array<std::uint8_t, 4>> rgba;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  /// Water in the air, too little for a surface: middle and radius.
  std::vector<std::array<float, 4>> drops;
};

/// Surface nets of bone and water together, of which those triangles stay that lie at water: so a film follows the bone's own surface,
/// slightly outside it. Normals are smoothed over three rings. Colour: from clear and dark to the bone's own by how thick the slurry is.
/// Cost: 0.1 ms a brick of 8^3 cells that holds water.
[[nodiscard]] LiquidSurface liquid_surface(const Dust& dust);

}  // namespace osteo
