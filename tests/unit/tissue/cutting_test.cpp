// What a turning tool takes off soft tissue.
#include <gtest/gtest.h>

#include "block.h"
#include "osteo/simulation/tissue/voxel_cutting.h"

namespace osteo {
namespace {

constexpr double kVoxelMm3 = 8;

TissueModel model_of(const test::Block& b) {
  const Material m{0.02, 0.45};
  return TissueModel::of_voxels(b.points, b.tets, std::span(&m, 1));
}

std::vector<std::uint32_t> at_the_bottom(const test::Block& b) {
  std::vector<std::uint32_t> fixed;
  for (std::uint32_t p = 0; p < b.points.size(); ++p) {
    if (b.points[p].z < 1e-9) fixed.push_back(p);
  }
  return fixed;
}

std::size_t count(const std::vector<bool>& gone) {
  return static_cast<std::size_t>(std::count(gone.begin(), gone.end(), true));
}

TEST(VoxelCutting, TakesTheDeepestVoxelOnceItsVolumeIsEarned) {
  const test::Block b = test::block(4, 4, 3, 2.0);
  const TissueModel model = model_of(b);
  TissueDynamics<float> body(model, at_the_bottom(b));
  VoxelCutting cutting(model, kVoxelMm3);
  // In the middle of the voxel at (2..4, 2..4, 4..6), a little towards its own corner at (4, 4, 6).
  const BallShape tool({3.6, 3.6, 5.6}, 1.2, false);
  EXPECT_FALSE(cutting.cut(body, tool, 0.5 * kVoxelMm3));
  EXPECT_EQ(count(cutting.gone()), 0u);
  EXPECT_EQ(cutting.cut_mm3(), 0);
  EXPECT_TRUE(cutting.cut(body, tool, 0.5 * kVoxelMm3));
  EXPECT_EQ(count(cutting.gone()), 5u);
  EXPECT_EQ(cutting.cut_mm3(), kVoxelMm3);
  // All five of one voxel, and one that has the corner.
  const std::size_t first =
      static_cast<std::size_t>(std::find(cutting.gone().begin(), cutting.gone().end(), true) - cutting.gone().begin());
  EXPECT_EQ(first % 5, 0u);
  double nearest = 1e9;
  for (std::size_t t = first; t < first + 5; ++t) {
    for (const auto p : b.tets[t]) nearest = std::min(nearest, length(b.points[p] - Vec3{4, 4, 6}));
  }
  EXPECT_LT(nearest, 1e-9);
}

TEST(VoxelCutting, SavesNoMoreThanItMay) {
  const test::Block b = test::block(6, 6, 3, 2.0);
  const TissueModel model = model_of(b);
  TissueDynamics<float> body(model, at_the_bottom(b));
  VoxelCutting cutting(model, kVoxelMm3);
  const BallShape beside({50, 0, 0}, 3, false), all({6, 6, 6}, 100, false);
  EXPECT_FALSE(cutting.cut(body, beside, 1000));  // meets nothing
  EXPECT_TRUE(cutting.cut(body, all, 0));
  EXPECT_EQ(count(cutting.gone()), 5 * static_cast<std::size_t>(VoxelCutting::kMaxSaved));
}

TEST(VoxelCutting, WhatComesLooseGoesToo) {
  // A foot of one voxel, and four on top of it in a row.
  const test::Block b = test::block(4, 1, 2, 2.0, [](Vec3 p) { return p.z > 2 || p.x < 2; });
  const TissueModel model = model_of(b);
  TissueDynamics<float> body(model, at_the_bottom(b));
  VoxelCutting cutting(model, kVoxelMm3);
  // The foot is the one with points at the bottom; the tool reaches those alone.
  const BallShape tool({1, 1, 0}, 1.5, false);
  EXPECT_TRUE(cutting.cut(body, tool, kVoxelMm3));
  EXPECT_EQ(count(cutting.gone()), cutting.gone().size());
  EXPECT_EQ(cutting.cut_mm3(), 5 * kVoxelMm3);
  EXPECT_FALSE(cutting.cut(body, tool, kVoxelMm3));
}

TEST(VoxelCutting, NoBurrCutsFasterThanAShaver) {
  EXPECT_DOUBLE_EQ(VoxelCutting::rate_mm3_per_s(0.01, 10), 0.01 * 10 * VoxelCutting::kEasierThanBone);
  EXPECT_EQ(VoxelCutting::rate_mm3_per_s(5, 10), VoxelCutting::kMaxMm3PerS);
}

}  // namespace
}  // namespace osteo
