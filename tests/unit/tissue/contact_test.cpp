#include "osteo/simulation/tissue/contact.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "block.h"
#include "osteo/core/base/error.h"
#include "osteo/simulation/tissue/dynamics.h"

namespace osteo {
namespace {

// A closed box.
TriMesh box(Vec3 lo, Vec3 hi) {
  TriMesh m;
  for (int c = 0; c < 8; ++c)
    m.points_mm.push_back(
        to_floats({(c & 1) != 0 ? hi.x : lo.x, (c & 2) != 0 ? hi.y : lo.y, (c & 4) != 0 ? hi.z : lo.z}));
  m.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                 {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return m;
}

TEST(Contact, DistanceMapOfASurface) {
  const SurfaceShape shape(box({0, 0, 0}, {10, 8, 6}), {-3, -3, -3}, {13, 11, 9}, 0.5);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> u(-2.5, 8.5);
  for (int n = 0; n < 2000; ++n) {
    const Vec3 p{u(random) + 1, u(random), u(random)};
    Vec3 out;
    const double d = shape.distance_mm(p, out);
    const Vec3 q{std::abs(p.x - 5) - 5, std::abs(p.y - 4) - 4, std::abs(p.z - 3) - 3};
    const Vec3 outside{std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0)};
    const double exact = length(outside) + std::min(0.0, std::max({q.x, q.y, q.z}));
    EXPECT_NEAR(d, exact, 0.25);  // linear between: most off at edges and along the middle planes
    // Exact above a face, away from its edges.
    if (q.z > 0 && q.x < -1 && q.y < -1) {
      EXPECT_NEAR(d, q.z, 1e-6);
      EXPECT_NEAR(std::abs(out.z), 1, 1e-6);
    }
    // The gradient is the function's own.
    Vec3 ignored;
    for (std::size_t a = 0; a < 3; ++a) {
      Vec3 e{};
      e[a] = 1e-6;
      const double slope = (shape.distance_mm(p + e, ignored) - shape.distance_mm(p - e, ignored)) / 2e-6;
      EXPECT_NEAR(slope, out[a], 1e-3);
    }
  }
  Vec3 out;
  EXPECT_GT(shape.distance_mm({100, 0, 0}, out), 0);
  EXPECT_GT(shape.distance_mm({NAN, 0, 0}, out), 0);
  EXPECT_THROW(SurfaceShape(box({0, 0, 0}, {1, 1, 1}), {0, 0, 0}, {1000, 1000, 1000}, 0.5), Error);
}

// A free block pressed onto a plate: it rests in it as deep as the plate's stiffness says, and does not slide.
TEST(Contact, ABlockRestsOnAPlate) {
  const auto b = test::block(3, 3, 2, 2.0);
  const Material m{0.1, 0.45};
  TissueModel model = TissueModel::of_voxels(b.points, b.tets, std::span(&m, 1));
  model.scale({1, 1, 0, 1});
  const auto plate =
      std::make_shared<SurfaceShape>(box({-20, -20, -10}, {20, 20, -0.5}), Vec3{-5, -5, -3}, Vec3{11, 11, 8}, 0.5);
  TissueDynamics<double> d(model, {}, {.damping_per_s = 100});
  std::vector<std::pair<std::uint32_t, Vec3>> load;
  for (std::uint32_t p = 0; p < b.points.size(); ++p) load.push_back({p, {0, 0, -1e-3}});
  d.set_load(load);
  d.set_obstacle({plate, 0.05});
  d.step(40000);
  const double weight = 1e-3 * static_cast<double>(b.points.size());
  double pushed = 0;
  Vec3 middle{};
  for (const Vec3& p : d.positions_mm()) {
    pushed += 0.05 * std::max(0.0, -0.5 - p.z);
    middle += p / static_cast<double>(b.points.size());
  }
  EXPECT_NEAR(pushed, weight, 1e-3 * weight);
  EXPECT_NEAR(middle.x, 3, 1e-6);
  EXPECT_LT(d.residual(), 1e-3);
  EXPECT_EQ(d.counts().softened, 0u);
}

// Tissue that begins inside bone is not thrown out of it but grows on it.
TEST(Contact, WhatLiesInsideAtRestIsTiedToIt) {
  const auto b = test::block(3, 3, 3, 2.0);
  const Material m{0.1, 0.45};
  TissueModel model = TissueModel::of_voxels(b.points, b.tets, std::span(&m, 1));
  model.scale({1, 1, 0, 1});
  TissueDynamics<double> d(model, {}, {.damping_per_s = 100});
  d.set_obstacle(
      {std::make_shared<SurfaceShape>(box({-20, -20, -10}, {20, 20, 1.3}), Vec3{-5, -5, -3}, Vec3{11, 11, 8}, 0.5),
       0.05});
  d.step(2000);
  const auto x = d.positions_mm();
  for (std::size_t p = 0; p < x.size(); ++p) EXPECT_LT(length(x[p] - b.points[p]), 1e-9);
  // Pulled, it stays there, with nothing else to hold it.
  std::vector<std::pair<std::uint32_t, Vec3>> load;
  for (std::uint32_t p = 0; p < b.points.size(); ++p) load.push_back({p, {0, 0, 1e-3}});
  d.set_load(load);
  d.step(40000);
  EXPECT_LT(d.residual(), 1e-2);
  for (std::size_t p = 0; p < x.size(); ++p) EXPECT_LT(length(d.positions_mm()[p] - b.points[p]), 1);
}

// Pressed four tenths of its thickness deep by a large ball it lies still: contact takes energy out, it never puts any
// in; and let go it comes back.
TEST(Contact, PressedDeepItLiesStill) {
  const auto b = test::block(10, 10, 5, 1.5);
  const Material m{0.02, 0.45};
  TissueModel model = TissueModel::of_voxels(b.points, b.tets, std::span(&m, 1));
  model.scale({1, 1, 0, 1});
  std::vector<std::uint32_t> fixed;
  for (std::uint32_t p = 0; p < b.points.size(); ++p) {
    if (b.points[p].z < 1e-9) fixed.push_back(p);
  }
  TissueDynamics<float> d(model, fixed, {.density_kg_m3 = 1000, .damping_per_s = 60, .step_share = 0.75});
  Vec3 force{};
  double last = 0;
  for (int n = 0; n <= 100; ++n) {
    d.set_tool({std::make_shared<BallShape>(Vec3{7.5, 7.5, 7.5 + 3 - 0.03 * n}, 3), 0.1});
    force = d.step(100);
    if (n % 20 == 0) {
      EXPECT_GE(force.z, last);
      last = force.z;
    }
  }
  EXPECT_GT(force.z, 0.05);
  EXPECT_LT(std::hypot(force.x, force.y), 0.1 * force.z);
  d.step(2000);
  EXPECT_LT(d.kinetic_mj(), 0.01 * d.elastic_mj());
  d.set_tool({});
  d.step(20000);
  for (std::size_t p = 0; p < b.points.size(); ++p) EXPECT_LT(length(d.positions_mm()[p] - b.points[p]), 0.05);
}

// Of a body that is too large for the machine an update takes a part of its steps only. Under a hand at 9 mm/s it
// gives way as it does with all of them, and held still it comes to the same force: what is slower is its own swinging.
TEST(Contact, ATenthOfTheStepsPressesAlike) {
  const auto b = test::block(8, 8, 5, 1.5);
  const Material m{0.04, 0.45};
  TissueModel model = TissueModel::of_voxels(b.points, b.tets, std::span(&m, 1));
  model.scale({1, 1, 0, 1});
  std::vector<std::uint32_t> fixed;
  for (std::uint32_t p = 0; p < b.points.size(); ++p) {
    if (b.points[p].z < 1e-9) fixed.push_back(p);
  }
  const auto press = [&](double share, double of_real_time) {
    TissueDynamics<float> d(model, fixed, {.density_kg_m3 = 1000, .damping_per_s = 150, .step_share = share});
    std::vector<double> forces;
    for (int n = 0; n < 60; ++n) {
      d.set_tool({std::make_shared<BallShape>(Vec3{6.4, 5.3, 7.5 + 3 - std::min(2.4, 0.09 * n)}, 3), 0.1});
      forces.push_back(length(d.step(static_cast<int>(std::lround(of_real_time * 0.01 / d.step_s())))));
    }
    EXPECT_EQ(d.counts().not_finite, 0u);
    EXPECT_EQ(d.counts().softened, 0u) << share;
    return forces;
  };
  const std::vector<double> all = press(0.3, 1), tenth = press(0.6, 0.1);
  const double most = *std::max_element(all.begin(), all.end());
  ASSERT_GT(most, 0.1);
  for (std::size_t n = 0; n < all.size(); ++n) EXPECT_NEAR(tenth[n], all[n], 0.06 * most) << n;
  EXPECT_NEAR(tenth.back(), all.back(), 0.01 * all.back());
}

// A stiffness that the step has no room for is cut, and counted.
TEST(Contact, SofteningIsCounted) {
  const auto b = test::block(3, 3, 2, 2.0);
  const Material m{0.1, 0.45};
  TissueModel model = TissueModel::of_voxels(b.points, b.tets, std::span(&m, 1));
  model.scale({1, 1, 0, 1});
  TissueDynamics<double> d(model, {}, {.damping_per_s = 50});
  d.set_tool({std::make_shared<BallShape>(Vec3{3, 3, 5}, 2), 1e6});
  d.step(3000);
  EXPECT_GT(d.counts().softened, 0u);
  EXPECT_EQ(d.counts().not_finite, 0u);
  for (const Vec3& p : d.positions_mm()) EXPECT_LT(length(p), 1e4);
}

}  // namespace
}  // namespace osteo
