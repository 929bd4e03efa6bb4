// Reads single values of a sparse grid at points of the world.
#pragma once
#include <memory>

#include "osteo/data/sparse_grid.h"

namespace osteo {

/// Keeps a cache of the path to the last voxel: fast along a line, one for each thread.
class GridSampler {
 public:
  explicit GridSampler(const SparseGrid& grid);
  ~GridSampler();
  GridSampler(GridSampler&&) noexcept;
  /// The voxel that holds the point; the background outside.
  [[nodiscard]] float nearest(Vec3 world_mm) const;
  /// Box of the stored voxels in LPS mm (corners of the index box; of an oblique grid the box around it).
  [[nodiscard]] static std::pair<Vec3, Vec3> bounds_mm(const SparseGrid& grid);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace osteo
