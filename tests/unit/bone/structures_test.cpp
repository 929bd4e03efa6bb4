#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "osteo/base/error.h"
#include "osteo/bone/structure_map.h"
#include "osteo/bone/thickness.h"
#include "solid.h"

namespace osteo {
namespace {

// Two balls of radius 3 and 2, as labels 1 and 5.
Labels two_balls(double h) {
  Labels l;
  const int n = static_cast<int>(40 / h);
  l.frame.dims = {n, n, n};
  l.frame.spacing_mm = {h, h, h};
  l.frame.origin_mm = {-20 + h / 2, -20 + h / 2, -20 + h / 2};
  const auto v = make_voxels<std::uint8_t>(l.frame.voxel_count());
  std::size_t at = 0;
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        const Vec3 p = l.frame.world_from_index({double(i), double(j), double(k)});
        v[at++] = length(p - Vec3{-6, 0, 0}) < 3 ? 1 : length(p - Vec3{6, 0, 0}) < 2 ? 5 : 0;
      }
  l.voxels = v;
  l.structures = {{5, "nerve", {255, 255, 0}}};
  return l;
}

TEST(StructureMap, ClearanceOfABurrToTheNearestStructure) {
  const StructureMap map(two_balls(0.5));
  EXPECT_EQ(map.name_of(5), "nerve");
  EXPECT_EQ(map.name_of(1), "structure 1");
  std::mt19937 random(1);
  std::uniform_real_distribution<double> u(-12, 12);
  for (int n = 0; n < 2000; ++n) {
    const Vec3 x{u(random), u(random), u(random)};
    const double a = length(x - Vec3{-6, 0, 0}) - 3, b = length(x - Vec3{6, 0, 0}) - 2, truth = std::min(a, b);
    const auto answer = map.at(x);
    if (truth > 8.5) {
      EXPECT_EQ(answer.structure, 0) << truth;
      EXPECT_NEAR(answer.distance_mm, 8, 0.5);
    } else if (truth < 7) {
      EXPECT_NEAR(answer.distance_mm, truth, 0.6);  // half a voxel and the corner of one
      if (std::abs(a - b) > 1.2) {
        EXPECT_EQ(answer.structure, a < b ? 1 : 5);
      }
    }
  }
  EXPECT_EQ(map.at({1e30, 0, 0}).structure, 0);
  EXPECT_EQ(map.at({NAN, 0, 0}).structure, 0);
  // A cylinder of 2 mm beside the nerve, its tip far away.
  const auto c = map.clearance({0, 12, 1, 1}, {6, 5, -10}, {0, 0, 1});
  EXPECT_EQ(c.structure, 5);
  EXPECT_NEAR(c.distance_mm, 2, 0.6);
  EXPECT_LT(map.clearance({0, 0, 2, 2}, {6, 3, 0}, {0, 0, 1}).distance_mm, 0);
}

TEST(StructureMap, WithoutStructuresIsAnError) {
  Labels l = two_balls(2);
  l.voxels = std::make_shared<std::uint8_t[]>(l.frame.voxel_count());
  EXPECT_THROW(StructureMap{l}, Error);
}

BrickGrid shell(double h, double inner, double outer) {
  return test::solid(h, outer + 2, [=](Vec3 p) { return length(p) > inner && length(p) < outer; });
}

TEST(Thickness, OfSphericalShells) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> u(-1, 1);
  for (const double thick : {0.8, 1.5, 4.0}) {
    const auto bone = shell(0.4, 8, 8 + thick);
    double mean = 0;
    for (int n = 0; n < 300; ++n) {
      const Vec3 out = normalized({u(random), u(random), u(random)});
      const double t = thickness_mm(bone, out * (8 + thick + 0.4), -out);
      EXPECT_NEAR(t, thick, 0.12) << thick;
      mean += t / 300;
    }
    EXPECT_NEAR(mean, thick, 0.04);
  }
}

TEST(Thickness, GapsReachAndAir) {
  const auto two = shell(0.5, 6, 7);
  // Through the hollow: two walls of 1 mm, 12 mm apart.
  EXPECT_NEAR(thickness_mm(two, {0, 0, 7.5}, {0, 0, -1}), 1, 0.1);
  EXPECT_NEAR(thickness_mm(two, {0, 0, 7.5}, {0, 0, -1}, 50, 13), 14, 0.2);
  EXPECT_EQ(thickness_mm(two, {0, 0, 7.5}, {0, 0, -1}, 0.4), 0.4);
  EXPECT_EQ(thickness_mm(two, {0, 0, 20}, {0, 0, -1}), 0);
  EXPECT_EQ(thickness_mm(two, {NAN, 0, 0}, {0, 0, -1}), 0);
}

}  // namespace
}  // namespace osteo
