// Flat bone, for tests and benchmarks of contact.
#pragma once
#include <algorithm>
#include <vector>

#include "osteo/geometry/grid/brick_grid.h"

namespace osteo::test {

// A slab of bone below z = 0, 40 x 40 x 16 mm, in voxels of h.
inline BrickGrid slab(double h) {
  Frame f;
  f.dims = {static_cast<int>(40 / h), static_cast<int>(40 / h), static_cast<int>(20 / h)};
  f.spacing_mm = {h, h, h};
  f.origin_mm = {-20 + h / 2, -20 + h / 2, -16 + h / 2};
  std::vector<Ijk> bricks;
  for (int k = 0; k <= f.dims[2] / 8; ++k)
    for (int j = 0; j <= f.dims[1] / 8; ++j)
      for (int i = 0; i <= f.dims[0] / 8; ++i) bricks.push_back({i, j, k});
  BrickGrid g(f, bricks);
  for (int k = 0; k < f.dims[2]; ++k)
    for (int j = 0; j < f.dims[1]; ++j)
      for (int i = 0; i < f.dims[0]; ++i) {
        const double top = f.world_from_index({0, 0, double(k)}).z + h / 2;
        g.set(g.find(i, j, k), static_cast<float>(std::clamp((h - top) / h, 0.0, 1.0)));
      }
  return g;
}

}  // namespace osteo::test
