// A bar of bone to cut.
#pragma once
#include <algorithm>
#include <cmath>

#include "osteo/bone/rigid_transform.h"
#include "osteo/grid/brick_grid.h"

namespace osteo::test {

// A bar of 30 x 10 x 8 mm around the origin with soft faces, its grid turned.
inline BrickGrid bar(double h, double turn) {
  Frame f;
  const int n = static_cast<int>(40 / h / 8) * 8;
  f.dims = {n, n, n};
  f.spacing_mm = {h, h, h};
  const RigidTransform r = rotation_about({}, normalized({1, 2, 3}), turn);
  f.direction = r.rotation;
  f.origin_mm = r.rotation * Vec3{-n * h / 2 + 0.3 * h, -n * h / 2, -n * h / 2};
  std::vector<Ijk> bricks;
  for (int k = 0; k < n / 8; ++k)
    for (int j = 0; j < n / 8; ++j)
      for (int i = 0; i < n / 8; ++i) bricks.push_back({i, j, k});
  BrickGrid g(f, bricks);
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        const Vec3 p = f.world_from_index({double(i), double(j), double(k)});
        const double d = std::min({15 - std::abs(p.x), 5 - std::abs(p.y), 4 - std::abs(p.z)});
        g.set(g.find(i, j, k), static_cast<float>(std::clamp(d / h + 0.5, 0.0, 1.0)));
      }
  return g;
}

}  // namespace osteo::test
