// The distance of structures in a label map.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "osteo/core/base/error.h"
#include "osteo/geometry/distance/distance_methods.h"
#include "osteo/geometry/grid/sampler.h"

namespace osteo {
namespace {

TEST(MaskDistance, EqualsBruteForceAndNamesTheNearest) {
  Labels labels;
  labels.frame.dims = {19, 14, 11};
  labels.frame.spacing_mm = {0.7, 1.1, 1.9};
  labels.frame.origin_mm = {5, -3, 2};
  const auto voxels = make_voxels<std::uint8_t>(labels.frame.voxel_count());
  std::mt19937 random(3);
  for (std::size_t i = 0; i < labels.frame.voxel_count(); ++i) voxels[i] = random() % 40 == 0 ? 1 + random() % 4 : 0;
  labels.voxels = voxels;
  const std::vector<std::uint8_t> wanted{1, 3};
  for (const DistanceRegion region : {DistanceRegion::box, DistanceRegion::band, DistanceRegion::interior}) {
    const MaskDistance found = mask_distance(labels, wanted, {region, 1.5, 2.5}, true);
    const GridSampler distance(found.distance), nearest(found.nearest);
    std::uint64_t stored = 0;
    for (int k = 0; k < 11; ++k) {
      for (int j = 0; j < 14; ++j) {
        for (int i = 0; i < 19; ++i) {
          const auto in = [&](int x, int y, int z) { return labels.at(x, y, z) == 1 || labels.at(x, y, z) == 3; };
          double to_in = 1e9, to_out = 1e9, to[5] = {1e9, 1e9, 1e9, 1e9, 1e9};
          for (int z = 0; z < 11; ++z) {
            for (int y = 0; y < 14; ++y) {
              for (int x = 0; x < 19; ++x) {
                const double d =
                    std::sqrt(std::pow(0.7 * (x - i), 2) + std::pow(1.1 * (y - j), 2) + std::pow(1.9 * (z - k), 2));
                if (!in(x, y, z)) {
                  to_out = std::min(to_out, d);
                } else {
                  to_in = std::min(to_in, d);
                  to[labels.at(x, y, z)] = std::min(to[labels.at(x, y, z)], d);
                }
              }
            }
          }
          const bool inside = in(i, j, k);
          const double expected = inside ? -to_out : to_in;
          if (region == DistanceRegion::interior && !inside) continue;
          if (region == DistanceRegion::band && (inside ? to_out > 1.5 : to_in > 2.5)) continue;
          ++stored;
          const Vec3 p = labels.frame.world_from_index({double(i), double(j), double(k)});
          EXPECT_NEAR(distance.nearest(p), expected, 1e-5);
          const auto name = static_cast<int>(nearest.nearest(p));
          ASSERT_TRUE(name == 1 || name == 3);
          EXPECT_NEAR(to[name], to_in, 1e-5);  // of equally near ones either, within rounding
        }
      }
    }
    EXPECT_EQ(found.distance.active_voxels, stored);
  }
  const std::vector<std::uint8_t> none{9};
  EXPECT_THROW((void)mask_distance(labels, none, {}), Error);
}

}  // namespace
}  // namespace osteo
