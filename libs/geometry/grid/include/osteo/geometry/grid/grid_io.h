// Sparse grids in .vdb files that other OpenVDB programs read; the transform maps index to LPS mm.
#pragma once
#include <array>
#include <filesystem>

#include "osteo/core/data/sparse_grid.h"
#include "osteo/core/data/volume.h"

namespace osteo::inline geometry {

/// Atomic. Errors: cannot_write.
void save_grid(const SparseGrid& grid, const std::filesystem::path& path);
/// The first float grid of the file. Errors: no_input, cannot_read, corrupt.
[[nodiscard]] SparseGrid load_grid(const std::filesystem::path& path);

// -- A box of a sparse grid as dense voxels, and dense voxels as a sparse grid.

/// The voxels of the box [lo, lo + n) in index coordinates, with their place in the world. The box may reach beyond
/// what is stored, and begin below 0: there is the grid's background. O(voxels of the box); values are those of the
/// grid, bit for bit. Error(usage) where n is not positive, or the box lies beyond 32-bit indices.
[[nodiscard]] Volume<float> to_dense(const SparseGrid& grid, std::array<int, 3> lo, std::array<int, 3> n);

/// What differs from `background` is stored; frame and index are the volume's. Error(usage) for a value that is no
/// number. O(voxels).
[[nodiscard]] SparseGrid to_sparse(const Volume<float>& volume, const std::string& name, double background);

}  // namespace osteo::inline geometry
