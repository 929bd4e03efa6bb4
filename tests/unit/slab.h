// Flat bone, for tests and benchmarks of contact.
#pragma once
#include "soft_solid.h"

namespace osteo::test {

// A slab of bone below z = 0, 40 x 40 x 16 mm, in voxels of h.
inline BrickGrid slab(double h) {
  Frame f;
  f.dims = {static_cast<int>(40 / h), static_cast<int>(40 / h), static_cast<int>(20 / h)};
  f.spacing_mm = {h, h, h};
  f.origin_mm = {-20 + h / 2, -20 + h / 2, -16 + h / 2};
  return soft_solid(f, [](Vec3 p) { return -p.z; });
}

}  // namespace osteo::test
