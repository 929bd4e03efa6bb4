#include "osteo/simulation/bone/depth_map.h"

#include <gtest/gtest.h>

#include "osteo/core/base/error.h"

namespace osteo {
namespace {

// Two bricks so far apart that the box around them has `blocks` blocks along x.
BrickGrid as_long_as(int blocks) {
  BrickGrid bone({}, {{0, 0, 0}, {(blocks - 2) / 2 - 1, 0, 0}});
  for (VoxelKey v = 0; v < bone.brick_count() * BrickGrid::kVoxels; ++v) bone.set(v, 1);
  return bone;
}

TEST(DepthMap, ReachesAsFarAsItsNumbersAndRefusesMore) {
  const BrickGrid longest = as_long_as(1024);
  const DepthMap map(longest);
  // The last brick's last voxel: air begins right behind it.
  const auto end = map.at({(1024 - 2) * 4.0 - 2, 3, 3});
  EXPECT_GT(end.depth_mm, 0);
  EXPECT_LE(end.depth_mm, 4);
  EXPECT_THROW(DepthMap{as_long_as(1026)}, Error);
}

}  // namespace
}  // namespace osteo
