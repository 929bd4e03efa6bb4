// Bricks of voxels, some of them stored, to a sparse grid.
#pragma once
#include <cstdint>
#include <span>
#include <string>

#include "osteo/core/data/sparse_grid.h"
#include "osteo/geometry/grid/brick_grid.h"

namespace osteo::inline geometry {

/// Brick b holds the voxels from 8 * bricks[b] on: stored[8 b + z] has bit x + 8 y, values[512 b + x + 8 y + 64 z].
/// Brick coordinates
/// >= 0. Voxels that are not stored read as `background`.
[[nodiscard]] SparseGrid to_sparse(const Frame& frame, const std::string& name, std::span<const Ijk> bricks,
                                   std::span<const std::uint64_t> stored, std::span<const float> values,
                                   double background);

}  // namespace osteo::inline geometry
