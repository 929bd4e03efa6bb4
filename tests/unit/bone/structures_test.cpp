#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <random>

#include "osteo/core/base/error.h"
#include "osteo/simulation/bone/burr.h"
#include "osteo/simulation/bone/depth_map.h"
#include "osteo/simulation/bone/structure_map.h"
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

// A shape known in closed form, cut into voxels whose centres decide, as a segmentation would.
template <class Signed>
Labels labelled(const Frame& frame, Signed signed_mm, std::uint8_t value = 1, const Labels* over = nullptr) {
  Labels l;
  l.frame = frame;
  const auto v = make_voxels<std::uint8_t>(frame.voxel_count());
  std::size_t at = 0;
  for (int k = 0; k < frame.dims[2]; ++k)
    for (int j = 0; j < frame.dims[1]; ++j)
      for (int i = 0; i < frame.dims[0]; ++i, ++at) {
        const std::uint8_t was = over != nullptr ? over->voxels[at] : std::uint8_t{0};
        v[at] = signed_mm(frame.world_from_index({double(i), double(j), double(k)})) < 0 ? value : was;
      }
  l.voxels = v;
  return l;
}

Frame cube_around_zero(double half_mm, double h) {
  Frame f;
  const int n = 2 * static_cast<int>(half_mm / h);
  f.dims = {n, n, n};
  f.spacing_mm = {h, h, h};
  const double lo = -(n - 1) * h / 2 + 0.13 * h;
  f.origin_mm = {lo, lo, lo};
  return f;
}

struct Errors {
  double sum = 0, sum2 = 0, most = 0;
  int count = 0;
  void add(double e) {
    sum += e;
    sum2 += e * e;
    most = std::max(most, std::abs(e));
    ++count;
  }
  [[nodiscard]] double mean() const { return sum / count; }
  [[nodiscard]] double rms() const { return std::sqrt(sum2 / count); }
};

// Measured from the face, not from centre to centre: what is left is the labels' own coarseness.
TEST(StructureMap, DistanceIsThatOfTheFaceBelowAVoxel) {
  const Vec3 tilt = normalized({0.3, -0.5, 0.81});
  struct Shape {
    const char* name;
    double (*signed_mm)(Vec3, Vec3 axis);
    double mean, rms, most;  // allowed, in label voxels
  };
  const Shape shapes[] = {
      {"flat, along the voxels", [](Vec3 p, Vec3) { return p.z; }, 0.14, 0.14,
       0.14},  // 0.13: where the labels' border lies
      {"flat, tilted", [](Vec3 p, Vec3 a) { return dot(p, a); }, 0.03, 0.12, 0.4},
      {"ball 3 mm", [](Vec3 p, Vec3) { return length(p) - 3; }, 0.05, 0.1, 0.4},
      {"ball 1 mm", [](Vec3 p, Vec3) { return length(p) - 1; }, 0.09, 0.13, 0.4},
      {"nerve 1 mm", [](Vec3 p, Vec3 a) { return length(cross(p, a)) - 1; }, 0.05, 0.1, 0.4},
      {"nerve 0.4 mm", [](Vec3 p, Vec3 a) { return length(cross(p, a)) - 0.4; }, 0.08, 0.15, 0.5},
      {"nerve 0.2 mm, a voxel thin", [](Vec3 p, Vec3 a) { return length(cross(p, a)) - 0.2; }, 0.12, 0.25, 0.6},
  };
  constexpr double h = 0.2;
  for (const Shape& shape : shapes) {
    const Labels labels = labelled(cube_around_zero(6, h), [&](Vec3 p) { return shape.signed_mm(p, tilt); });
    const StructureMap map(labels, 4);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> u(-3, 3);
    Errors beside, inside;
    for (int n = 0; n < 4000; ++n) {
      const Vec3 x{u(random), u(random), u(random)};
      const double truth = shape.signed_mm(x, tilt);
      if (truth > 3 || truth < -1.5) continue;  // deeper the border of the labels is nearer
      (truth > -0.1 ? beside : inside).add((map.at(x).distance_mm - truth) / h);
    }
    EXPECT_LT(std::abs(beside.mean()), shape.mean) << shape.name;
    EXPECT_LT(beside.rms(), shape.rms) << shape.name;
    EXPECT_LT(beside.most, shape.most) << shape.name;
    std::printf("%-28s outside: mean %+.3f rms %.3f most %.3f   inside: mean %+.3f most %.3f of a label voxel\n",
                shape.name, beside.mean(), beside.rms(), beside.most, inside.mean(), inside.most);
    // In the middle of a thin structure the lattice rounds the ridge of distances off.
    EXPECT_LT(inside.most, 1.2) << shape.name;
  }
}

// Against another way to measure: to the nearest face between a voxel of the structure and one that is not, by trying
// all.
TEST(StructureMap, AgreesWithTheNearestOfAllVoxelFaces) {
  Frame frame = cube_around_zero(4, 0.25);
  frame.spacing_mm = {0.25, 0.2, 0.4};
  frame.direction = {{Vec3{0.8, 0.6, 0}, Vec3{-0.6, 0.8, 0}, Vec3{0, 0, -1}}};  // turned, left-handed
  frame.origin_mm = frame.origin_mm - frame.centre_mm();
  const Labels labels = labelled(frame, [](Vec3 p) { return std::hypot(p.x / 1.8, p.y / 1.2, p.z / 1.5) - 1; });
  std::vector<Vec3> faces;
  for (int k = 1; k < frame.dims[2]; ++k)
    for (int j = 1; j < frame.dims[1]; ++j)
      for (int i = 1; i < frame.dims[0]; ++i)
        for (int a = 0; a < 3; ++a) {
          const int x = i - (a == 0 ? 1 : 0), y = j - (a == 1 ? 1 : 0), z = k - (a == 2 ? 1 : 0);
          if (labels.at(i, j, k) != labels.at(x, y, z))
            faces.push_back(frame.world_from_index({(i + x) / 2.0, (j + y) / 2.0, (k + z) / 2.0}));
        }
  const StructureMap map(labels, 4);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> u(-3.5, 3.5);
  Errors errors;
  for (int n = 0; n < 500; ++n) {
    const Vec3 x{u(random), u(random), u(random)};
    double nearest = 1e9;
    for (const Vec3 f : faces) nearest = std::min(nearest, length(f - x));
    const double truth = std::hypot(x.x / 1.8, x.y / 1.2, x.z / 1.5) < 1 ? -nearest : nearest;
    if (nearest < 0.5) continue;  // below the faces' own spacing their middles are no surface
    errors.add(map.at(x).distance_mm - truth);
  }
  // The steps of voxels stand out before the face that runs through them: by that much they are nearer.
  EXPECT_LT(std::abs(errors.mean()), 0.11);
  EXPECT_LT(errors.most, 0.3);
}

// Every voxel that the map names lies inside, however thin the structure, and every other outside.
TEST(StructureMap, NoVoxelIsLost) {
  const Frame frame = cube_around_zero(3, 0.25);
  std::mt19937 random(5);
  const Labels labels = labelled(frame, [&](Vec3 p) { return length(p) < 2.5 && random() % 7 == 0 ? -1.0 : 1.0; });
  const StructureMap map(labels, 2);
  for (int k = 0; k < frame.dims[2]; ++k)
    for (int j = 0; j < frame.dims[1]; ++j)
      for (int i = 0; i < frame.dims[0]; ++i) {
        const double d = map.at(frame.world_from_index({double(i), double(j), double(k)})).distance_mm;
        ASSERT_EQ(d < 0, labels.at(i, j, k) != 0) << d;
      }
}

// A brain, not a nerve: 24 mm inside is as much inside as 1 mm.
TEST(StructureMap, AnyDepthInsideCounts) {
  const Labels labels = labelled(cube_around_zero(26, 0.8), [](Vec3 p) { return length(p) - 25; });
  const StructureMap map(labels);
  for (double deep = 0.5; deep < 24.5; deep += 0.5) {
    const auto a = map.at({25 - deep, 0, 0});
    EXPECT_EQ(a.structure, 1) << deep;
    const double rounded = deep < 20 ? 0.3 : 0.8;  // around the middle, by the lattice
    EXPECT_NEAR(a.distance_mm, -deep, rounded) << deep;
    const auto burr = map.clearance({0, 0, 3, 3}, {25 - deep, 0, 0}, {0, 0, 1});
    EXPECT_EQ(burr.structure, 1) << deep;
    EXPECT_NEAR(burr.distance_mm, -deep - 3, rounded) << deep;
  }
  EXPECT_LT(map.memory_bytes(), 12u << 20);
}

// 8 mm beyond the surface of a burr, whatever burr it is; not 8 mm from its middle.
TEST(StructureMap, ReachIsFromTheBurrsSurface) {
  const Labels labels = labelled(cube_around_zero(4, 0.25), [](Vec3 p) { return length(p) - 2; });
  const StructureMap map(labels);
  for (const Burr& burr : burr_library()) {
    const RoundCone head = burr.head();
    for (const double gap : {7.9, 8.15}) {
      // Sideways, level with the ball of the head that is the thickest.
      const double foot = head.end_radius_mm > head.start_radius_mm ? head.length_mm : 0;
      const Vec3 start{2 + gap + head.radius_at_mm(foot), 0, -head.start_mm - foot};
      const auto a = map.clearance(head, start, {0, 0, 1});
      if (head.slope() == 0) {
        EXPECT_EQ(a.structure, gap < 8 ? 1 : 0) << burr.name() << ' ' << gap;
        EXPECT_NEAR(a.distance_mm, std::min(gap, 8.0), 0.05) << burr.name();
      } else {
        EXPECT_EQ(a.structure != 0, a.distance_mm < 8);
        EXPECT_LT(a.distance_mm, std::min(gap, 8.0) + 0.05) << burr.name();
      }
    }
  }
}

// A nerve across the side of a cylinder is as near between two places of the axis as at one.
TEST(StructureMap, ACylindersSideIsMeasuredAllAlong) {
  const Labels labels = labelled(cube_around_zero(4, 0.2), [](Vec3 p) { return length(p) - 0.8; });
  const StructureMap map(labels);
  const RoundCone head{0, 10.5, 3.5, 3.5};
  double least = 1e9, most = -1e9;
  for (double t = 1; t < 9.5; t += 0.11) {
    const double d = map.clearance(head, {5, 0, -t}, {0, 0, 1}).distance_mm;
    least = std::min(least, d);
    most = std::max(most, d);
  }
  EXPECT_NEAR(least, 0.7, 0.03);
  EXPECT_LT(most - least, 0.01);
}

TEST(StructureMap, EachStructureHasADistanceOfItsOwn) {
  const StructureMap map(two_balls(0.25));
  EXPECT_EQ(map.values(), (std::vector<std::uint8_t>{1, 5}));
  EXPECT_EQ(map.name_of(5), "nerve");
  EXPECT_EQ(map.name_of(1), "structure 1");
  std::mt19937 random(1);
  std::uniform_real_distribution<double> u(-12, 12);
  for (int n = 0; n < 2000; ++n) {
    const Vec3 x{u(random), u(random), u(random)};
    const double a = std::min(8.0, length(x - Vec3{-6, 0, 0}) - 4), b = std::min(8.0, length(x - Vec3{6, 0, 0}) - 3);
    std::array<double, 2> each{};
    const auto nearest = map.clearance({0, 0, 1, 1}, x, {0, 0, 1}, each);
    EXPECT_NEAR(each[0], a, 0.12);
    EXPECT_NEAR(each[1], b, 0.12);
    EXPECT_EQ(nearest.distance_mm, std::min(each[0], each[1]));
    EXPECT_EQ(nearest.structure, nearest.distance_mm >= 8 ? 0 : each[0] <= each[1] ? 1 : 5);
  }
  for (const double bad : {1e30, double{NAN}, double{INFINITY}}) {
    std::array<double, 2> each{};
    EXPECT_EQ(map.clearance({0, 3, 1, 1}, {bad, 0, 0}, {0, 0, 1}, each).structure, 0);
    EXPECT_EQ(each[0] + each[1], 16);
  }
}

// Of one that is opened distances are known as before; the nearest at risk is the other, also from within the opened.
TEST(StructureMap, WhatIsOpenedIsNotAtRisk) {
  const std::vector<std::string> names{"nerve", "not there"};
  const StructureMap usual(two_balls(0.25)), map(two_balls(0.25), 8, {}, names);
  EXPECT_FALSE(map.opened(0));
  EXPECT_TRUE(map.opened(1));
  EXPECT_EQ(map.hash(), usual.hash());
  for (const Vec3 x : {Vec3{6, 0, 0}, Vec3{1, 0, 0}, Vec3{-1, 2, 0}, Vec3{20, 0, 0}}) {
    std::array<double, 2> each{}, as_usual{};
    const auto nearest = map.clearance({0, 0, 1, 1}, x, {0, 0, 1}, each);
    static_cast<void>(usual.clearance({0, 0, 1, 1}, x, {0, 0, 1}, as_usual));
    EXPECT_EQ(each, as_usual);
    EXPECT_EQ(nearest.distance_mm, each[0]);
    EXPECT_EQ(nearest.structure, each[0] < 8 ? 1 : 0);
    EXPECT_EQ(map.at(x).structure, usual.at(x).structure);
    EXPECT_EQ(map.at_risk(x).distance_mm, map.distance_mm(0, x));
  }
}

TEST(StructureMap, SameForAnyNumberOfThreads) {
  Context one, three;
  one.threads = 1;
  three.threads = 3;
  const Labels labels = two_balls(0.5);
  EXPECT_EQ(StructureMap(labels, 8, one).hash(), StructureMap(labels, 8, three).hash());
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
