// Sparse grids in .vdb files that other OpenVDB programs read; the transform maps index to LPS mm.
#pragma once
#include <filesystem>

#include "osteo/core/data/sparse_grid.h"

namespace osteo::inline geometry {

/// Atomic. Errors: cannot_write.
void save_grid(const SparseGrid& grid, const std::filesystem::path& path);
/// The first float grid of the file. Errors: no_input, cannot_read, corrupt.
[[nodiscard]] SparseGrid load_grid(const std::filesystem::path& path);

}  // namespace osteo::inline geometry
