// Where voxels and bricks of a grid lie, and bricks of voxels as a sparse grid.
#pragma once
#include <cstdint>
#include <span>
#include <string>

#include "osteo/core/data/sparse_grid.h"
#include "osteo/geometry/grid/brick_grid.h"

namespace osteo::inline geometry {

// -- Where voxels and bricks of a grid lie.

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

// -- Bricks of voxels, some of them stored, to a sparse grid.

/// Brick b holds the voxels from 8 * bricks[b] on: stored[8 b + z] has bit x + 8 y, values[512 b + x + 8 y + 64 z].
/// Brick coordinates
/// >= 0. Voxels that are not stored read as `background`.
[[nodiscard]] SparseGrid to_sparse(const Frame& frame, const std::string& name, std::span<const Ijk> bricks,
                                   std::span<const std::uint64_t> stored, std::span<const float> values,
                                   double background);

}  // namespace osteo::inline geometry
