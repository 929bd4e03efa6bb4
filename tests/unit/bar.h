// A bar of bone to cut.
#pragma once
#include <cmath>

#include "osteo/core/data/rigid_transform.h"
#include "soft_solid.h"

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
  return soft_solid(f, [](Vec3 p) { return std::min({15 - std::abs(p.x), 5 - std::abs(p.y), 4 - std::abs(p.z)}); });
}

}  // namespace osteo::test
