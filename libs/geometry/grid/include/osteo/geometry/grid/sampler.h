// Reads single values of a sparse grid at points of the world.
#pragma once
#include <memory>

#include "osteo/core/data/sparse_grid.h"

namespace osteo::inline geometry {

/// Keeps a cache of the path to the last voxel: fast along a line, one for each thread.
class GridSampler {
 public:
  explicit GridSampler(const SparseGrid& grid);
  ~GridSampler();
  GridSampler(GridSampler&&) noexcept;
  /// The voxel that holds the point; the background outside.
  [[nodiscard]] float nearest(Vec3 world_mm) const;
  /// At a point in index coordinates, linear between voxels; the background counts where none is stored. About 0.1 us.
  [[nodiscard]] float linear_at(Vec3 index) const;
  /// The same between those voxels alone that are stored; not a number where the one that holds the point is not.
  [[nodiscard]] float linear_stored_at(Vec3 index) const;
  [[nodiscard]] const Frame& frame() const;
  /// Box of the stored voxels in LPS mm (corners of the index box; of an oblique grid the box around it).
  [[nodiscard]] static std::pair<Vec3, Vec3> bounds_mm(const SparseGrid& grid);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteo::inline geometry
