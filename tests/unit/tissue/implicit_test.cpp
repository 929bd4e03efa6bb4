// Long steps against short ones, against statics, and where short ones would take for ever.
#include "osteo/simulation/tissue/implicit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "block.h"
#include "osteo/core/base/error.h"
#include "osteo/simulation/tissue/calibrate.h"
#include "osteo/simulation/tissue/dynamics.h"

namespace osteo {
namespace {

using test::block;

TissueModel model_of(const test::Block& b, const Material& m) {
  TissueModel model = TissueModel::of_voxels(b.points, b.tets, std::span(&m, 1));
  model.scale({1, 1, 0, 1});
  return model;
}
std::vector<std::uint32_t> base_of(const test::Block& b) {
  std::vector<std::uint32_t> fixed;
  for (std::uint32_t p = 0; p < b.points.size(); ++p) {
    if (b.points[p].z < 1e-9) fixed.push_back(p);
  }
  return fixed;
}
std::vector<std::pair<std::uint32_t, Vec3>> top_of(const test::Block& b, double z, Vec3 each) {
  std::vector<std::pair<std::uint32_t, Vec3>> load;
  for (std::uint32_t p = 0; p < b.points.size(); ++p) {
    if (b.points[p].z > z) load.push_back({p, each});
  }
  return load;
}
double off(std::span<const Vec3> a, std::span<const Vec3> b, std::span<const Vec3> rest) {
  return calibration_error(rest, a, b).nrms;
}

// Backward Euler is of first order: half the step, half the distance to the motion that short explicit steps make.
TEST(Implicit, OfFirstOrderInTime) {
  const auto b = block(3, 3, 4, 3.0);
  const TissueModel model = model_of(b, {0.02, 0.4});
  const auto fixed = base_of(b);
  const auto load = top_of(b, 11.9, {0.002, 0, 0});
  constexpr double kEnd = 0.04;
  TissueDynamics<double> fine(model, fixed, {.density_kg_m3 = 1000, .damping_per_s = 20, .step_share = 0.1});
  fine.set_load(load);
  const int many = static_cast<int>(std::lround(kEnd / fine.step_s()));
  fine.step(many);
  const double end = many * fine.step_s();
  double error[3];
  int n = 0;
  for (const int steps : {100, 200, 400}) {
    ImplicitDynamics d(model, fixed,
                       {.density_kg_m3 = 1000, .damping_per_s = 20, .step_s = end / steps, .tolerance = 1e-9});
    d.set_load(load);
    d.step(steps);
    EXPECT_EQ(d.counts().unfinished, 0u);
    error[n++] = off(d.positions_mm(), fine.positions_mm(), model.rest());
  }
  std::printf("implicit steps of %.2f ms: %.3f off, halved %.3f, again %.3f\n", 1000 * end / 100, error[0], error[1],
              error[2]);
  EXPECT_NEAR(error[1] / error[0], 0.5, 0.1);
  EXPECT_NEAR(error[2] / error[1], 0.5, 0.06);
}

TEST(Implicit, ComesToTheRestThatNewtonFinds) {
  const auto b = block(4, 4, 4, 2.0);
  const TissueModel model = model_of(b, {0.1, 0.45});
  const auto fixed = base_of(b);
  const auto load = top_of(b, 7.9, {0.003, 0, -0.002});
  EquilibriumSolver solver(model, model.rest(), fixed);
  const Equilibrium exact = solver.solve(model, model.rest(), load);
  ASSERT_TRUE(exact.converged);
  ImplicitDynamics d(model, fixed, {.step_s = 1});
  d.set_load(load);
  d.step(6);
  EXPECT_LT(off(d.positions_mm(), exact.points_mm, model.rest()), 1e-6);
  EXPECT_LT(d.residual(), 1e-4);
}

// Nothing holds it: what pushes it gives it the momentum it should have, to rounding, in steps of any length.
TEST(Implicit, MomentumInFreeFlight) {
  const auto b = block(3, 2, 2, 2.0);
  const TissueModel model = model_of(b, {0.05, 0.45});
  for (const double h : {1e-3, 0.1}) {
    ImplicitDynamics d(model, {}, {.density_kg_m3 = 1000, .step_s = h, .tolerance = 1e-12});
    const std::pair<std::uint32_t, Vec3> force[] = {{0, {1e-4, 2e-5, 0}}};
    d.set_load(force);
    const int n = 10;
    d.step(n);
    // Centre of mass: backward Euler gives h^2 n (n + 1) / 2 of the acceleration.
    double mass = 0;
    Vec3 moved{};
    std::vector<double> own(model.point_count());
    for (const auto& t : model.tets()) {
      const auto& r = model.rest();
      const double quarter = dot(r[t[1]] - r[t[0]], cross(r[t[2]] - r[t[0]], r[t[3]] - r[t[0]])) / 24 * 1e-9;
      for (const std::uint32_t p : t) own[p] += quarter;
    }
    for (std::size_t p = 0; p < own.size(); ++p) {
      mass += own[p];
      moved += (d.positions_mm()[p] - model.rest()[p]) * own[p];
    }
    const Vec3 expected = Vec3{1e-4, 2e-5, 0} * (h * h * n * (n + 1) / 2 / mass);
    EXPECT_LT(length(moved / mass - expected), 1e-9 * length(expected)) << h;
  }
}

// A hundredth of a second a step where explicit ones may take microseconds: 10,000 : 1 of stiffness, and almost no
// change of volume.
TEST(Implicit, StiffBodies) {
  const auto b = block(4, 4, 4, 2.0);
  const auto fixed = base_of(b);
  for (const bool contrast : {true, false}) {
    std::vector<Material> materials;
    for (std::size_t v = 0; v < b.tets.size() / 5; ++v) {
      double z = 0;
      for (const std::uint32_t p : b.tets[5 * v]) z += b.points[p].z / 4;
      materials.push_back(contrast && z < 4 ? Material{500, 0.3} : Material{0.05, contrast ? 0.3 : 0.4999});
    }
    TissueModel model = TissueModel::of_voxels(b.points, b.tets, materials);
    model.scale({1, 1, 0, 1});
    const TissueDynamics<double> quick(model, fixed, {});
    EXPECT_LT(quick.step_s(), contrast ? 2e-6 : 3e-5);
    const auto load = top_of(b, 7.9, {0.002, 0, 0});
    ImplicitDynamics d(model, fixed, {.damping_per_s = 50, .step_s = 0.01});
    d.set_load(load);
    double energy = 0;
    d.step(60);
    EXPECT_EQ(d.counts().unfinished, 0u);
    EquilibriumSolver solver(model, model.rest(), fixed);
    const Equilibrium exact = solver.solve(model, model.rest(), load);
    ASSERT_TRUE(exact.converged);
    EXPECT_LT(off(d.positions_mm(), exact.points_mm, model.rest()), 1e-3);
    // Let go: it takes energy away, never gives any.
    d.set_load({});
    energy = d.elastic_mj() + d.kinetic_mj();
    for (int n = 0; n < 20; ++n) {
      d.step();
      const double now = d.elastic_mj() + d.kinetic_mj();
      EXPECT_LE(now, energy * (1 + 1e-9));
      energy = now;
    }
  }
}

TEST(Implicit, ToolAndObstacleAsExplicitStepsFindThem) {
  const auto b = block(5, 5, 3, 2.0);
  const TissueModel model = model_of(b, {0.05, 0.45});
  const auto fixed = base_of(b);
  const RigidContact tool{std::make_shared<BallShape>(Vec3{5, 5, 8}, 3, false), 0.02},
      wall{std::make_shared<BallShape>(Vec3{16, 5, 4}, 6.5), 0.05};
  TissueDynamics<double> quick(model, fixed, {.damping_per_s = 300});
  ImplicitDynamics slow(model, fixed, {.damping_per_s = 300, .step_s = 0.02});
  quick.set_tool(tool);
  slow.set_tool(tool);
  quick.set_obstacle(wall);
  slow.set_obstacle(wall);
  const Vec3 a = quick.step(20000), c = slow.step(40);
  EXPECT_GT(a.z, 1e-3);
  EXPECT_LT(length(a - c), 1e-3 * length(a));
  EXPECT_LT(off(quick.positions_mm(), slow.positions_mm(), model.rest()), 1e-3);
  EXPECT_EQ(quick.counts().softened, 0u);
}

// What is left after a cut is what would have been made without the part that went; both ways in time.
TEST(Implicit, CutOffItIsTheBodyThatIsLeft) {
  const auto whole = block(3, 3, 5, 2.0), left = block(3, 3, 5, 2.0, [](Vec3 p) { return !(p.z > 4 && p.x > 4); });
  const Material m{0.05, 0.45};
  const TissueModel model = model_of(whole, m), fresh = model_of(left, m);
  std::vector<std::uint32_t> gone;
  for (std::uint32_t t = 0; t < whole.tets.size(); ++t) {
    Vec3 c{};
    for (const std::uint32_t p : whole.tets[t / 5 * 5]) c += whole.points[p] / 4;
    if (c.z > 4 && c.x > 4) gone.push_back(t);
  }
  EXPECT_EQ(whole.tets.size() - gone.size(), left.tets.size());
  const auto fixed = base_of(whole), fixed_left = base_of(left);
  const auto pulled = [](const test::Block& b) {
    std::vector<std::pair<std::uint32_t, Vec3>> load;
    for (std::uint32_t p = 0; p < b.points.size(); ++p) {
      if (b.points[p].z > 9.9 && b.points[p].x < 2.1) load.push_back({p, {0.002, 0, 0.001}});
    }
    return load;
  };
  EquilibriumSolver solver(fresh, fresh.rest(), fixed_left);
  const Equilibrium exact = solver.solve(fresh, fresh.rest(), pulled(left));
  ASSERT_TRUE(exact.converged);
  ImplicitDynamics slow(model, fixed, {.step_s = 1});
  TissueDynamics<double> quick(model, fixed, {.damping_per_s = 300});
  slow.set_load(pulled(whole));
  quick.set_load(pulled(whole));
  slow.step(3);
  quick.step(500);
  for (const std::uint32_t t : gone) {  // one by one
    slow.cut_off(std::span(&t, 1));
    quick.cut_off(std::span(&t, 1));
  }
  slow.step(6);
  quick.step(40000);
  for (std::uint32_t p = 0; p < left.points.size(); ++p) {
    for (std::uint32_t q = 0; q < whole.points.size(); ++q) {
      if (length(whole.points[q] - left.points[p]) > 1e-9) continue;
      EXPECT_LT(length(slow.positions_mm()[q] - exact.points_mm[p]), 1e-5);
      EXPECT_LT(length(quick.positions_mm()[q] - exact.points_mm[p]), 1e-3);
    }
  }
}

TEST(Implicit, InvertedAndTeleported) {
  const auto b = block(4, 4, 3, 2.0);
  const TissueModel model = model_of(b, {0.05, 0.45});
  const auto fixed = base_of(b);
  ImplicitDynamics d(model, fixed, {.damping_per_s = 100, .step_s = 0.02});
  std::mt19937 random(5);
  std::uniform_real_distribution<double> u(-1.5, 1.5);
  for (std::uint32_t p = 0; p < b.points.size(); ++p) {
    if (b.points[p].z > 1e-9) d.set_position(p, b.points[p] + Vec3{u(random), u(random), u(random)});
  }
  EXPECT_GT(model.inverted(d.positions_mm()), b.tets.size() / 10);
  d.step(50);
  EXPECT_EQ(model.inverted(d.positions_mm()), 0u);
  std::uniform_real_distribution<double> place(0, 8);
  for (int n = 0; n < 40; ++n) {
    d.set_tool(
        {std::make_shared<BallShape>(Vec3{place(random), place(random), n % 7 == 3 ? NAN : place(random)}, 2), 5});
    EXPECT_TRUE(std::isfinite(length(d.step())));
  }
  d.set_tool({});
  d.step(60);
  for (std::size_t p = 0; p < b.points.size(); ++p) EXPECT_LT(length(d.positions_mm()[p] - b.points[p]), 1e-2);
  const std::pair<std::uint32_t, Vec3> nan[] = {{5, {NAN, 0, 0}}};
  EXPECT_THROW(d.set_load(nan), Error);
  EXPECT_THROW(ImplicitDynamics(model, fixed, {.step_s = 0}), Error);
}

}  // namespace
}  // namespace osteo
