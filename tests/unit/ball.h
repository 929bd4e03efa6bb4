// The soft ball that volumes and surfaces are held against, in tests and benchmarks.
#pragma once
#include <cmath>

#include "osteo/core/data/volume.h"

namespace osteo::test {

// A ball of 1000 HU in 0 HU with a smooth edge: where the threshold of 500 lies is known exactly.
inline Image ball(double spacing_z, double radius) {
  Frame f;
  f.dims = {60, 60, static_cast<int>(60 / spacing_z)};
  f.spacing_mm = {1, 1, spacing_z};
  f.origin_mm = {-29.7, -29.4, -29.8};
  const auto v = make_voxels<std::int16_t>(f.voxel_count());
  std::size_t at = 0;
  for (int k = 0; k < f.dims[2]; ++k)
    for (int j = 0; j < f.dims[1]; ++j)
      for (int i = 0; i < f.dims[0]; ++i) {
        const double d = radius - length(f.world_from_index({double(i), double(j), double(k)}));
        v[at++] = static_cast<std::int16_t>(std::lround(500 + 500 * std::tanh(d / 1.5)));
      }
  return {f, v};
}

}  // namespace osteo::test
