// Where voxels and bricks of a grid lie.
#pragma once
#include "osteo/geometry/grid/brick_grid.h"

namespace osteo::inline geometry {

/// Centre of a voxel, in the grid's own world: LPS mm.
[[nodiscard]] inline Vec3 place_of_voxel_mm(const Frame& frame, Ijk at) {
  return frame.world_from_index({double(at.i), double(at.j), double(at.k)});
}
[[nodiscard]] inline Vec3 place_of_voxel_mm(const BrickGrid& grid, VoxelKey voxel) {
  return place_of_voxel_mm(grid.frame(), grid.coordinate(voxel));
}
/// Middle of a brick: between its voxels 3 and 4.
[[nodiscard]] inline Vec3 middle_of_brick_mm(const BrickGrid& grid, std::uint32_t brick) {
  constexpr double kMiddle = (BrickGrid::kEdge - 1) / 2.0;
  const Ijk at = grid.brick_coordinate(brick);
  return grid.frame().world_from_index(
      {at.i * BrickGrid::kEdge + kMiddle, at.j * BrickGrid::kEdge + kMiddle, at.k * BrickGrid::kEdge + kMiddle});
}

}  // namespace osteo::inline geometry
