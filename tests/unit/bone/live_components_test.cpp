#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "osteo/simulation/bone/live_components.h"

namespace osteo {
namespace {

BrickGrid empty(int bricks, double h = 0.5) {
  Frame f;
  f.dims = {bricks * 8, bricks * 8, bricks * 8};
  f.spacing_mm = {h, h, h};
  f.origin_mm = {-3, 4, 5};
  return BrickGrid::dense(f);
}

// The flood fill of a dense mask: what labels must equal.
void expect_as_flooded(const BrickGrid& bone, LiveComponents& live, Connectivity connectivity) {
  const auto& n = bone.frame().dims;
  std::vector<std::uint8_t> mask(bone.frame().voxel_count());
  std::size_t at = 0;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) mask[at++] = bone.at(i, j, k) >= 0.5F ? 1 : 0;
  const Components truth = connected_components(mask, n, 1, connectivity);
  const auto parts = live.update();
  ASSERT_EQ(parts.size(), truth.voxels.size());
  std::vector<std::uint32_t> seen(truth.voxels.size(), LiveComponents::kNone);
  for (std::size_t r = 0; r < truth.runs.size(); ++r) {
    for (std::uint32_t x = truth.runs[r].begin; x < truth.runs[r].end; ++x) {
      const int row = static_cast<int>(truth.runs[r].row);
      const std::uint32_t c = live.component_of(bone.find(static_cast<int>(x), row % n[1], row / n[1]));
      ASSERT_NE(c, LiveComponents::kNone);
      auto& known = seen[truth.component[r]];
      if (known == LiveComponents::kNone) known = c;
      ASSERT_EQ(known, c);
    }
  }
  for (std::size_t t = 0; t < seen.size(); ++t) ASSERT_EQ(parts[seen[t]].voxels, truth.voxels[t]);
}

TEST(LiveComponents, EqualAFloodFillThroughRandomEdits) {
  for (const Connectivity connectivity : {Connectivity::face, Connectivity::full}) {
    for (const double filling : {0.15, 0.35, 0.6}) {
      auto bone = empty(3);
      std::mt19937 random(1);
      std::bernoulli_distribution solid(filling);
      for (std::uint32_t v = 0; v < bone.brick_count() * 512; ++v) bone.set(v, solid(random) ? 1.0F : 0.2F);
      LiveComponents live(bone, connectivity);
      expect_as_flooded(bone, live, connectivity);
      for (int round = 0; round < 25; ++round) {
        for (int e = 0; e < 40; ++e) {
          const auto v = static_cast<VoxelKey>(random() % (bone.brick_count() * 512));
          bone.set(v, random() % 3 == 0 ? 0.7F : 0.0F);
          live.mark(v);
        }
        expect_as_flooded(bone, live, connectivity);
      }
    }
  }
}

TEST(LiveComponents, ABridgeOfOneVoxelAcrossBricks) {
  auto bone = empty(2);
  const auto fill = [&](int lo, int hi) {
    for (int k = 4; k < 12; ++k)
      for (int j = 4; j < 12; ++j)
        for (int i = lo; i < hi; ++i) bone.set(bone.find(i, j, k), 1);
  };
  fill(0, 6);
  fill(10, 16);
  for (int i = 6; i < 10; ++i) bone.set(bone.find(i, 8, 8), 1);
  LiveComponents live(bone);
  EXPECT_EQ(live.update().size(), 1u);
  bone.set(bone.find(8, 8, 8), 0.49F);
  live.mark(bone.find(8, 8, 8));
  ASSERT_EQ(live.update().size(), 2u);
  EXPECT_NE(live.component_of(bone.find(2, 8, 8)), live.component_of(bone.find(12, 8, 8)));
  bone.set(bone.find(8, 8, 8), 0.5F);  // put back, as an undo does
  live.mark(bone.find(8, 8, 8));
  EXPECT_EQ(live.update().size(), 1u);
}

TEST(LiveComponents, ACornerHoldsOnlyWhereCornersCount) {
  auto bone = empty(2);
  for (const int at : {6, 7, 8, 9}) bone.set(bone.find(at, at, at), 1);
  LiveComponents face(bone, Connectivity::face), full(bone, Connectivity::full);
  EXPECT_EQ(face.update().size(), 4u);
  EXPECT_EQ(full.update().size(), 1u);
}

TEST(LiveComponents, TenPiecesAtOnceAndAllRemoved) {
  auto bone = empty(4);
  const auto slab = [&](int z, float density) {
    std::vector<VoxelKey> changed;
    for (int j = 0; j < 32; ++j)
      for (int i = 0; i < 32; ++i) {
        bone.set(bone.find(i, j, z), density);
        changed.push_back(bone.find(i, j, z));
      }
    return changed;
  };
  for (int z = 0; z < 30; ++z) slab(z, 1);
  LiveComponents live(bone);
  EXPECT_EQ(live.update().size(), 1u);
  for (int z = 2; z < 30; z += 3)
    for (const VoxelKey v : slab(z, 0)) live.mark(v);
  EXPECT_EQ(live.update().size(), 10u);
  for (int z = 0; z < 30; ++z)
    for (const VoxelKey v : slab(z, 0)) live.mark(v);
  EXPECT_EQ(live.update().size(), 0u);
}

// Mass, centre and inertia of a box of half-dense bone, whatever bricks it crosses.
TEST(LiveComponents, MassPropertiesOfABox) {
  auto bone = empty(3, 0.5);
  for (int k = 3; k < 21; ++k)
    for (int j = 5; j < 15; ++j)
      for (int i = 2; i < 22; ++i) bone.set(bone.find(i, j, k), 0.8F);
  LiveComponents live(bone);
  const auto parts = live.update();
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_NEAR(parts[0].mass, 0.8 * 20 * 10 * 18, 1e-3);
  const Vec3 centre = bone.frame().world_from_index({11.5, 9.5, 11.5});
  EXPECT_LT(length(parts[0].centre_mm - centre), 1e-6);
  const double a = 10, b = 5, c = 9, m = parts[0].mass;  // edges in mm
  EXPECT_NEAR(parts[0].inertia_mm2[0], m * (b * b + c * c) / 12, 1e-6 * m * 100);
  EXPECT_NEAR(parts[0].inertia_mm2[1], m * (a * a + c * c) / 12, 1e-6 * m * 100);
  EXPECT_NEAR(parts[0].inertia_mm2[2], m * (a * a + b * b) / 12, 1e-6 * m * 100);
  EXPECT_NEAR(parts[0].inertia_mm2[3], 0, 1e-6 * m * 100);
}

}  // namespace
}  // namespace osteo
