// A small volume whose every voxel tells where it belongs.
#pragma once
#include <gtest/gtest.h>

#include <cmath>

#include "osteo/core/data/volume.h"

namespace osteo::test {

// An oblique frame of unequal spacing; every voxel differs from its neighbours.
inline Image oblique(bool left_handed) {
  Frame f;
  f.dims = {7, 5, 4};
  f.spacing_mm = {0.7, 0.9, 2.5};
  f.origin_mm = {-31.5, 12.25, 107};
  const Vec3 u = normalized({1, 0.2, -0.1}), w = normalized(cross(u, {0.05, 1, 0.3}));
  f.direction = {{u, cross(w, u), left_handed ? w * -1 : w}};
  const auto v = make_voxels<std::int16_t>(f.voxel_count());
  for (std::size_t i = 0; i < f.voxel_count(); ++i) v[i] = static_cast<std::int16_t>(static_cast<int>(i) * 23 - 1024);
  return {f, v};
}

// The value at a world point must survive, however the file orders its voxels.
inline void expect_same_world(const Image& a, const Image& b) {
  ASSERT_EQ(a.frame.voxel_count(), b.frame.voxel_count());
  for (int k = 0; k < a.frame.dims[2]; ++k)
    for (int j = 0; j < a.frame.dims[1]; ++j)
      for (int i = 0; i < a.frame.dims[0]; ++i) {
        const Vec3 x = b.frame.index_from_world(a.frame.world_from_index({double(i), double(j), double(k)}));
        const int p = static_cast<int>(std::lround(x.x)), q = static_cast<int>(std::lround(x.y)),
                  r = static_cast<int>(std::lround(x.z));
        ASSERT_NEAR(length(x - Vec3{double(p), double(q), double(r)}), 0, 2e-3);
        ASSERT_TRUE(p >= 0 && q >= 0 && r >= 0 && p < b.frame.dims[0] && q < b.frame.dims[1] && r < b.frame.dims[2]);
        ASSERT_EQ(a.at(i, j, k), b.at(p, q, r));
      }
}

}  // namespace osteo::test
