#include "osteo/simulation/tissue/dynamics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "block.h"
#include "osteo/core/base/error.h"
#include "osteo/simulation/tissue/detail/equilibrium.h"

namespace osteo {
namespace {

using test::block;

TissueModel model_of(const test::Block& b, double nu = 0.45, double faces = 0) {
  const Material m{0.1, nu};
  TissueModel model = TissueModel::of_voxels(b.points, b.tets, std::span(&m, 1));
  model.scale({1, 1, faces, 1});
  return model;
}

// Forces of the vectorised loops against the exact gradients: a step from rest moves each point by dt^2 f / m.
TEST(Dynamics, ForcesAreTheModels) {
  const auto b = block(5, 3, 3, 2.0);
  for (const bool grid : {true, false}) {
    const TissueModel model = grid ? model_of(b, 0.45, 20) : TissueModel::uniform(b.points, b.tets, 0.5, 0.2, 0.9);
    std::mt19937 random(4);
    std::uniform_real_distribution<double> u(-0.4, 0.4);
    auto x = model.rest();
    for (Vec3& p : x) p += Vec3{u(random), u(random), u(random)};
    std::vector<Vec3> g(x.size());
    total_gradient(model, x, g);
    TissueDynamics<double> d(model, {});
    for (std::uint32_t p = 0; p < x.size(); ++p) d.set_position(p, x[p]);
    d.step();
    const auto y = d.positions_mm();
    std::vector<double> mass(x.size());
    for (const auto& t : model.tets()) {
      const auto& r = model.rest();
      for (const std::uint32_t p : t)
        mass[p] +=
            dot(r[t[1]] - r[t[0]], cross(r[t[2]] - r[t[0]], r[t[3]] - r[t[0]])) / 24 * 1e-9;  // 1000 kg/m3 in N s2/mm
    }
    for (std::size_t p = 0; p < x.size(); ++p) {
      const Vec3 f = (y[p] - x[p]) * (mass[p] / (d.step_s() * d.step_s()));
      EXPECT_LT(length(f + g[p]), 1e-9 + 1e-7 * length(g[p])) << grid;
    }
  }
}

TEST(Dynamics, MomentumIsKeptAndEnergyDoesNotDrift) {
  const auto b = block(4, 4, 4, 2.0);
  const TissueModel model = model_of(b);
  TissueDynamics<double> d(model, {});
  std::mt19937 random(4);
  std::uniform_real_distribution<double> u(-0.15, 0.15);
  for (std::uint32_t p = 0; p < d.point_count(); ++p)
    d.set_position(p, model.rest()[p] + Vec3{u(random), u(random), u(random)});
  const double begin = d.elastic_mj();
  double most = 0, early = 0, momentum = 0, scale = 0;
  for (int n = 0; n < 200; ++n) {
    d.step(500);
    const double off = std::abs(d.elastic_mj() + d.kinetic_mj() - begin);
    most = std::max(most, off);
    if (n < 50) early = std::max(early, off);
    momentum = std::max(momentum, length(d.momentum_n_s()));
    scale = std::max(scale, std::sqrt(2 * d.kinetic_mj() * 512e-9));
  }
  EXPECT_LT(most, 0.1 * begin);  // of a symplectic method: it sways,
  EXPECT_LT(most, 1.2 * early);  // and does not grow
  EXPECT_LT(momentum, 1e-10 * scale);
}

// Just below the certified step nothing blows up, whatever the material; well above it does.
TEST(Dynamics, TheStepIsCertified) {
  const auto b = block(3, 3, 3, 2.0);
  for (const double nu : {0.25, 0.45, 0.499, 0.4999}) {
    for (const double share : {0.99, 3.0}) {
      const TissueModel model = model_of(b, nu);
      TissueDynamics<double> d(model, {}, {.density_kg_m3 = 1000, .damping_per_s = 0, .step_share = share});
      std::mt19937 random(9);
      std::uniform_real_distribution<double> u(-1e-3, 1e-3);
      for (std::uint32_t p = 0; p < d.point_count(); ++p)
        d.set_position(p, model.rest()[p] + Vec3{u(random), u(random), u(random)});
      const double begin = d.elastic_mj();
      d.step(20000);
      const double end = d.elastic_mj() + d.kinetic_mj();
      if (share < 1) {
        EXPECT_LT(end, 2 * begin) << nu;
        EXPECT_EQ(d.counts().not_finite, 0u);
      } else {
        EXPECT_FALSE(end < 10 * begin) << nu;
      }
    }
  }
}

TEST(Dynamics, ComesToTheRestThatNewtonFinds) {
  const auto b = block(6, 3, 3, 2.0);
  const TissueModel model = model_of(b);
  std::vector<std::uint32_t> fixed;
  std::vector<std::pair<std::uint32_t, Vec3>> load;
  for (std::uint32_t p = 0; p < b.points.size(); ++p) {
    if (b.points[p].x < 1e-9) fixed.push_back(p);
    if (b.points[p].x > 11.99) load.push_back({p, {0, 0, 0.002}});
  }
  EquilibriumSolver solver(model, model.rest(), fixed);
  const Equilibrium exact = solver.solve(model, model.rest(), load);
  ASSERT_TRUE(exact.converged);
  const auto off = [&](const std::vector<Vec3>& x) {
    double sum = 0, size = 0;
    for (std::size_t p = 0; p < x.size(); ++p) {
      sum += dot(x[p] - exact.points_mm[p], x[p] - exact.points_mm[p]);
      size += dot(exact.points_mm[p] - model.rest()[p], exact.points_mm[p] - model.rest()[p]);
    }
    return std::sqrt(sum / size);
  };
  TissueDynamics<double> d(model, fixed, {.density_kg_m3 = 1000, .damping_per_s = 300});
  TissueDynamics<float> f(model, fixed, {.density_kg_m3 = 1000, .damping_per_s = 300});
  d.set_load(load);
  f.set_load(load);
  d.step(20000);
  f.step(20000);
  EXPECT_LT(off(d.positions_mm()), 1e-8);
  EXPECT_LT(d.residual(), 1e-8);
  EXPECT_LT(off(f.positions_mm()), 1e-3);
}

TEST(Dynamics, AToolPushesAndTeleportsWithoutHarm) {
  const auto b = block(6, 6, 3, 2.0);
  const TissueModel model = model_of(b);
  std::vector<std::uint32_t> fixed;
  for (std::uint32_t p = 0; p < b.points.size(); ++p) {
    if (b.points[p].z < 1e-9) fixed.push_back(p);
  }
  TissueDynamics<float> d(model, fixed, {.density_kg_m3 = 1000, .damping_per_s = 200});
  Vec3 force{};
  for (int n = 0; n < 3000; ++n) {
    d.set_tool({std::make_shared<BallShape>(Vec3{6, 6, 6 + 3 - 0.001 * std::min(n, 1500)}, 3), 0.5});
    force = d.step();
  }
  EXPECT_GT(force.z, 1e-3);
  EXPECT_LT(std::hypot(force.x, force.y), 0.2 * force.z);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(-2, 14);
  for (int n = 0; n < 3000; ++n) {
    if (n % 10 == 0) d.set_tool({std::make_shared<BallShape>(Vec3{u(random), u(random), u(random) / 2}, 3), 0.5});
    if (n % 500 == 499) d.set_tool({std::make_shared<BallShape>(Vec3{NAN, 0, 0}, 3), 0.5});
    const Vec3 f = d.step();
    EXPECT_TRUE(std::isfinite(length(f)));
  }
  d.set_tool({});
  d.step(30000);
  const auto x = d.positions_mm();
  double worst = 0;
  for (std::size_t p = 0; p < x.size(); ++p) worst = std::max(worst, length(x[p] - model.rest()[p]));
  EXPECT_LT(worst, 1e-2);  // back to rest
  EXPECT_EQ(d.counts().not_finite, 0u);
}

TEST(Dynamics, CutOffItFallsAndTheRestStays) {
  const auto b = block(6, 2, 2, 2.0);
  const TissueModel model = model_of(b);
  std::vector<std::uint32_t> fixed, gone;
  for (std::uint32_t p = 0; p < b.points.size(); ++p) {
    if (b.points[p].x < 1e-9) fixed.push_back(p);
  }
  for (std::uint32_t t = 0; t < b.tets.size(); ++t) {  // a slice of voxels
    double x = 0;
    for (const std::uint32_t p : b.tets[t]) x += b.points[p].x / 4;
    if (x > 6 && x < 8) gone.push_back(t);
  }
  TissueDynamics<double> d(model, fixed, {.density_kg_m3 = 1000, .damping_per_s = 50});
  std::vector<std::pair<std::uint32_t, Vec3>> weight;
  for (std::uint32_t p = 0; p < b.points.size(); ++p) weight.push_back({p, {0, 0, -1e-5}});
  d.set_load(weight);
  d.step(5000);
  d.cut_off(gone);
  d.step(20000);
  const auto x = d.positions_mm();
  double free_fall = 0, held = 0;
  for (std::size_t p = 0; p < x.size(); ++p) {
    if (b.points[p].x > 7)  // the loose end
      free_fall = std::min(free_fall, x[p].z - b.points[p].z);
    else
      held = std::min(held, x[p].z - b.points[p].z);
  }
  EXPECT_LT(free_fall, -1);
  EXPECT_GT(held, -0.5);
}

TEST(Dynamics, AskedForALongerStepItMakesPointsHeavierAndSaysSo) {
  const auto b = block(3, 3, 3, 2.0);
  const TissueModel model = model_of(b, 0.499);
  const TissueDynamics<float> plain(model, {});
  EXPECT_EQ(plain.counts().made_heavier, 0u);
  TissueDynamics<float> d(
      model, {}, {.density_kg_m3 = 1000, .damping_per_s = 0, .step_share = 0.9, .least_step_s = 5 * plain.step_s()});
  EXPECT_GT(d.counts().made_heavier, 0u);
  EXPECT_GE(d.step_s(), 4.9 * plain.step_s());
  d.set_position(0, model.rest()[0] + Vec3{0.1, 0, 0});
  d.step(20000);
  EXPECT_EQ(d.counts().not_finite, 0u);
  EXPECT_LT(d.elastic_mj(), 1);
  EXPECT_THROW(TissueDynamics<float>(model, {}, {.density_kg_m3 = 0}), Error);
}

}  // namespace
}  // namespace osteo
