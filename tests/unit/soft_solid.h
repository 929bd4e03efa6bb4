// Bone of any shape with soft faces.
#pragma once
#include <algorithm>

#include "osteo/geometry/grid/brick_grid.h"

namespace osteo::test {

/// All voxels of a frame (cubes): bone where `depth_mm` of their centre is positive, a half
/// at 0, in between by the share of a voxel.
template <class Depth>
BrickGrid soft_solid(const Frame& f, Depth&& depth_mm) {
  BrickGrid g = BrickGrid::dense(f);
  for (int k = 0; k < f.dims[2]; ++k)
    for (int j = 0; j < f.dims[1]; ++j)
      for (int i = 0; i < f.dims[0]; ++i) {
        const double d = depth_mm(f.world_from_index({double(i), double(j), double(k)}));
        g.set(g.find(i, j, k), static_cast<float>(std::clamp(d / f.spacing_mm.x + 0.5, 0.0, 1.0)));
      }
  return g;
}

}  // namespace osteo::test
