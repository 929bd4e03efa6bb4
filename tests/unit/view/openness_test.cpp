// Light that gets into cavities, against the exact share of the sky.
#include "osteo/display/view/detail/openness.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "solid.h"

namespace osteo {
namespace {

double at(const Openness& o, const BrickGrid& g, Vec3 p, Vec3 n) {
  return o.at(to_floats(g.frame().index_from_world(p)), to_floats(n));
}

TEST(Openness, IsWholeOnFlatAndBulgingBone) {
  const auto slab = test::solid(
      0.5, 12, [](Vec3 p) { return p.z < 0.1; }, {}, 2);
  const Openness flat(slab);
  for (double x = -6; x < 6; x += 0.37) EXPECT_NEAR(at(flat, slab, {x, 0.5 * x, 0.1}, {0, 0, 1}), 1, 0.03) << x;
  const auto tilted = test::solid(
      0.5, 14, [](Vec3 p) { return p.x + p.z < 0; }, {}, 2);
  const Openness slope(tilted);
  for (double y = -4; y < 4; y += 0.37)
    EXPECT_NEAR(at(slope, tilted, {0.1 * y, y, -0.1 * y}, normalized({1, 0, 1})), 1, 0.06) << y;
  const auto ball = test::solid(
      0.5, 12, [](Vec3 p) { return length(p) < 9; }, {}, 2);
  const Openness round(ball);
  for (double a = 0; a < 6; a += 0.3) {
    const Vec3 n = normalized({std::cos(a), std::sin(a), 0.4 * std::sin(3 * a)});
    EXPECT_NEAR(at(round, ball, n * 9, n), 1, 0.04) << a;
  }
}

// The bottom of a round hole sees r2 / (r2 + h2) of the sky, cosine-weighted.
TEST(Openness, AtTheBottomOfHolesIsNearTheExactShare) {
  double worst = 0;
  for (const double voxel : {0.2, 0.4, 0.5}) {
    for (const auto& [radius, depth] :
         {std::pair{4.0, 2.0}, {4.0, 4.0}, {3.0, 3.0}, {3.0, 6.0}, {2.0, 4.0}, {2.0, 6.0}, {1.5, 6.0}}) {
      if (voxel == 0.2 && radius != 3.0) continue;  // a million points to count
      const auto bone = test::solid(
          voxel, 10, [&](Vec3 p) { return p.z < 2 && !(p.z > 2 - depth && std::hypot(p.x, p.y) < radius); }, {}, 2);
      const Openness open(bone);
      const double exact = radius * radius / (radius * radius + depth * depth);
      const double found = at(open, bone, {0, 0, 2 - depth}, {0, 0, 1});
      std::printf("voxel %.1f radius %.1f depth %.1f: exact %.2f found %.2f\n", voxel, radius, depth, exact, found);
      worst = std::max(worst, std::abs(found - exact));
      if (depth > radius) {
        EXPECT_LT(found, 0.35);
      }
      EXPECT_GT(at(open, bone, {radius + 1.5, 0, 2}, {0, 0, 1}), 0.95);  // the rim
    }
  }
  std::printf("worst %.2f\n", worst);
  EXPECT_LT(worst, 0.23);
}

TEST(Openness, RenewedIsAsMadeAnew) {
  auto bone = test::solid(
      0.4, 8, [](Vec3 p) { return p.z < 2; }, {}, 2);
  Openness live(bone);
  std::vector<std::uint32_t> bricks;
  for (std::uint32_t b = 0; b < bone.brick_count(); ++b) {
    bool changed = false;
    for (std::uint32_t v = 0; v < BrickGrid::kVoxels; ++v) {
      const VoxelKey key = b * BrickGrid::kVoxels + v;
      const Ijk c = bone.coordinate(key);
      if (length(bone.frame().world_from_index({1.0 * c.i, 1.0 * c.j, 1.0 * c.k}) - Vec3{0.3, -0.2, 1}) > 2.1) continue;
      changed = true;
      bone.set(key, 0);
    }
    if (changed) bricks.push_back(b);
  }
  ASSERT_FALSE(bricks.empty());
  live.renew(bone, bricks);
  const Openness anew(bone);
  for (double x = -5; x < 5; x += 0.61)
    EXPECT_EQ(at(live, bone, {x, 0.2 * x, 2 - std::abs(x) / 4}, {0, 0, 1}),
              at(anew, bone, {x, 0.2 * x, 2 - std::abs(x) / 4}, {0, 0, 1}));
  EXPECT_LT(at(live, bone, {0.3, -0.2, -1.1}, {0, 0, 1}), 0.8);
}

// A finer region and what is around it are two bodies of one bone: together they let in what one body would.
TEST(Openness, TwoBodiesShadeEachOther) {
  constexpr double kVoxel = 0.4, kRegion = 3.2;
  const auto is_bone = [](Vec3 p) { return p.z < 2 && !(p.z > -2 && std::hypot(p.x, p.y) < 3); };
  const auto in_region = [](Vec3 p) {
    return std::abs(p.x) < kRegion && std::abs(p.y) < kRegion && std::abs(p.z + 2) < kRegion;
  };
  const auto whole = test::solid(kVoxel, 10, is_bone, {}, 2);
  const auto around = test::solid(
      kVoxel, 10, [&](Vec3 p) { return is_bone(p) && !in_region(p); }, {}, 2);
  const auto fine = test::solid(
      0.2, kRegion,
      [&](Vec3 p) {
        return is_bone(p + Vec3{0, 0, -2});
      },
      {0, 0, -2}, 2);
  const Openness all(whole);
  const auto far = std::make_shared<const Openness>(around), near = std::make_shared<const Openness>(fine);
  const std::vector<std::shared_ptr<const Openness>> of_far{far}, of_near{near};
  double worst = 0, alone = 0;
  for (double a = 0; a < 6; a += 0.4) {
    for (const double r : {0.0, 1.0, 2.0}) {  // the floor, in the region
      const Vec3 p{r * std::cos(a), r * std::sin(a), -2}, n{0, 0, 1};
      const double exact = at(all, whole, p, n);
      worst = std::max(worst,
                       std::abs(near->at(to_floats(fine.frame().index_from_world(p)), to_floats(n), of_far) - exact));
      alone = std::max(alone, std::abs(at(*near, fine, p, n) - exact));
    }
    // The wall above it, outside of the region.
    const Vec3 n{-std::cos(a), -std::sin(a), 0}, p = n * -3 + Vec3{0, 0, 1.6};
    worst = std::max(worst, std::abs(far->at(to_floats(around.frame().index_from_world(p)), to_floats(n), of_near) -
                                     at(all, whole, p, n)));
  }
  std::printf("off one body's: each with the other %.3f, alone %.3f\n", worst, alone);
  EXPECT_LT(worst, 0.12);
  EXPECT_GT(alone, 0.25);
}

}  // namespace
}  // namespace osteo
