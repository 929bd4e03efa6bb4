// Grids that have bricks in common.
#include <gtest/gtest.h>

#include <array>

#include "osteo/geometry/grid/brick_grid.h"

namespace osteo {
namespace {

BrickGrid three_bricks() {
  Frame f;
  f.dims = {24, 8, 8};
  BrickGrid g(f, {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}});
  for (VoxelKey v = 0; v < 3 * BrickGrid::kVoxels; ++v) g.set(v, static_cast<float>(v % 7) / 8);
  return g;
}

TEST(Sharing, WhatIsWrittenIsSeenUntilABrickIsTakenForItself) {
  BrickGrid a = three_bricks();
  BrickGrid b = a.sharing();
  EXPECT_EQ(b.hash(), a.hash());
  a.set(3, 0.75F);
  EXPECT_EQ(b.value(3), 0.75F);
  b.own_brick(0);
  EXPECT_EQ(b.value(3), 0.75F);
  b.set(3, 0.5F);
  EXPECT_EQ(a.value(3), 0.75F);
  EXPECT_FALSE(b.shares_brick(0, a, 0));
  EXPECT_TRUE(b.shares_brick(1, a, 1));
  const std::array<std::uint32_t, 2> gone{0, 2};
  const float kept = a.value(2 * BrickGrid::kVoxels + 5);
  b.empty_bricks(gone);
  for (VoxelKey v = 0; v < BrickGrid::kVoxels; ++v) {
    EXPECT_EQ(b.value(v), 0.0F);
    EXPECT_EQ(b.value(2 * BrickGrid::kVoxels + v), 0.0F);
  }
  EXPECT_EQ(a.value(2 * BrickGrid::kVoxels + 5), kept);
  b.set(4, 1);  // the two emptied ones are not one
  EXPECT_EQ(b.value(2 * BrickGrid::kVoxels + 4), 0.0F);
  b.share_brick(2, a, 1);
  EXPECT_EQ(b.value(2 * BrickGrid::kVoxels + 9), a.value(BrickGrid::kVoxels + 9));
}

TEST(Sharing, BricksOutliveTheGridTheyCameFromAndACopyHasItsOwn) {
  BrickGrid b;
  std::string was;
  {
    const BrickGrid a = three_bricks();
    was = a.hash();
    b = a.sharing();
  }
  EXPECT_EQ(b.hash(), was);
  const BrickGrid copy(b);
  b.set(0, 1);
  EXPECT_EQ(copy.hash(), was);
  EXPECT_NE(b.hash(), was);
}

}  // namespace
}  // namespace osteo
