#include "osteo/simulation/tissue/detail/tissue_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "block.h"
#include "derivatives.h"
#include "osteo/core/base/error.h"
#include "osteo/simulation/tissue/detail/equilibrium.h"

namespace osteo {
namespace {

using test::block;
using test::shaken;

TEST(TissueModel, GradientsAndHessiansAreThoseOfTheEnergy) {
  const auto b = block(2, 1, 1, 2.0);
  const Material m{0.1, 0.45};
  TissueModel voxels = TissueModel::of_voxels(b.points, b.tets, std::span(&m, 1));
  voxels.scale({1, 1, 30, 1});
  for (const TissueModel& model : {voxels, TissueModel::uniform(b.points, b.tets, 0.7, 0.3, 0.9)}) {
    test::expect_exact_derivatives(model, shaken(model.rest(), 0.3, 3));
  }
}

TEST(TissueModel, ForcesAndTorquesSumToZero) {
  const auto b = block(4, 3, 3, 1.5);
  const Material m{0.1, 0.45};
  TissueModel model = TissueModel::of_voxels(b.points, b.tets, std::span(&m, 1));
  model.scale({1, 1, 10, 1});
  const auto x = shaken(model.rest(), 0.5, 8);
  std::vector<Vec3> g(x.size());
  total_gradient(model, x, g);
  Vec3 force{}, torque{};
  double size = 0, arm = 0;
  for (std::size_t p = 0; p < x.size(); ++p) {
    force += g[p];
    torque += cross(x[p], g[p]);
    size += length(g[p]);
    arm += length(x[p]) * length(g[p]);
  }
  EXPECT_LT(length(force), 1e-13 * size);
  EXPECT_LT(length(torque), 1e-13 * arm);
}

// Any small strain of a block of voxels costs what an isotropic solid of that material costs, and its inner points are
// in balance: the closed form is exact.
TEST(TissueModel, TheClosedFormIsIsotropicElasticity) {
  for (const double nu : {0.25, 0.3, 0.45, 0.499}) {
    const auto b = block(4, 4, 4, 2.0);
    const Material m{0.1, nu};
    const TissueModel model = TissueModel::of_voxels(b.points, b.tets, std::span(&m, 1));
    std::mt19937 random(2);
    std::normal_distribution<double> u;
    for (int n = 0; n < 10; ++n) {
      double eps[3][3];
      for (int i = 0; i < 3; ++i)
        for (int j = i; j < 3; ++j) eps[i][j] = eps[j][i] = 1e-5 * u(random);
      auto x = model.rest();
      for (Vec3& p : x) {
        const Vec3 q = p;
        for (std::size_t i = 0; i < 3; ++i) p[i] += eps[i][0] * q.x + eps[i][1] * q.y + eps[i][2] * q.z;
      }
      double trace = 0, square = 0;
      for (int i = 0; i < 3; ++i) {
        trace += eps[i][i];
        for (int j = 0; j < 3; ++j) square += eps[i][j] * eps[i][j];
      }
      const double exact = 512 * (m.shear_mpa() * square + 0.5 * m.lambda_mpa() * trace * trace);
      EXPECT_NEAR(total_energy(model, x) / exact, 1, 2e-4) << nu;
      std::vector<Vec3> g(x.size());
      total_gradient(model, x, g);
      for (std::size_t p = 0; p < x.size(); ++p) {
        const Vec3 r = model.rest()[p];
        if (r.x > 1 && r.x < 7 && r.y > 1 && r.y < 7 && r.z > 1 && r.z < 7) {
          EXPECT_LT(length(g[p]), 1e-4 * m.lambda_mpa() * 4 * 1e-5 * 30) << nu;
        }
      }
    }
  }
}

TEST(TissueModel, InvertedAndFlatComeBack) {
  const auto b = block(3, 3, 3, 1.0);
  const Material m{0.1, 0.45};
  TissueModel model = TissueModel::of_voxels(b.points, b.tets, std::span(&m, 1));
  model.scale({1, 1, 5, 1});
  std::vector<std::uint32_t> fixed;
  for (std::uint32_t p = 0; p < b.points.size(); ++p) {
    if (b.points[p].z < 1e-9) fixed.push_back(p);
  }
  EquilibriumSolver solver(model, model.rest(), fixed);
  for (const double noise : {0.55, 0.9}) {
    auto start = shaken(model.rest(), noise, 21);
    for (const std::uint32_t p : fixed) start[p] = model.rest()[p];
    const std::size_t turned = model.inverted(start);
    EXPECT_GT(turned, 3u);
    const Equilibrium r = solver.solve(model, start, {}, {.tolerance = 1e-9});
    EXPECT_TRUE(r.converged) << r.why;
    EXPECT_LE(r.iterations, 40);
    for (std::size_t p = 0; p < b.points.size(); ++p)
      EXPECT_LT(length(r.points_mm[p] - model.rest()[p]), 1e-4) << noise;
  }
  // A gear, four tenths of it turned inside out: back in a few iterations, without any clamp.
  const auto gear = block(16, 16, 3, 125, [](Vec3 p) {
    const double r = std::hypot(p.x - 1000, p.y - 1000);
    return r > 250 && r < (std::cos(10 * std::atan2(p.y - 1000, p.x - 1000)) > 0 ? 1000 : 780);
  });
  TissueModel large = TissueModel::of_voxels(gear.points, gear.tets, std::span(&m, 1));
  large.scale({1, 1, 1, 1});
  fixed.clear();
  for (std::uint32_t p = 0; p < gear.points.size(); ++p) {
    if (gear.points[p].z < 1e-9) fixed.push_back(p);
  }
  EquilibriumSolver gear_solver(large, large.rest(), fixed);
  auto start = shaken(large.rest(), 210, 3);
  for (const std::uint32_t p : fixed) start[p] = large.rest()[p];
  EXPECT_GT(large.inverted(start), gear.tets.size() * 38 / 100);
  const Equilibrium back = gear_solver.solve(large, start, {}, {.tolerance = 1e-9});
  EXPECT_TRUE(back.converged) << back.why;
  EXPECT_LE(back.iterations, 30);
  std::printf("%.0f %% inverted: back in %d iterations\n",
              100.0 * static_cast<double>(large.inverted(start)) / static_cast<double>(gear.tets.size()),
              back.iterations);
  for (std::size_t p = 0; p < gear.points.size(); ++p) EXPECT_LT(length(back.points_mm[p] - large.rest()[p]), 0.1);
  // All points in a heap, all in a plane: finite energies and forces, whatever they are.
  for (const double z : {0.0, 1e-3}) {
    auto x = model.rest();
    for (Vec3& p : x) p = z == 0 ? Vec3{1, 1, 1} : Vec3{p.x, p.y, p.z * z};
    std::vector<Vec3> g(x.size());
    total_gradient(model, x, g);
    for (const Vec3 f : g) EXPECT_TRUE(std::isfinite(length(f)));
    EXPECT_TRUE(std::isfinite(total_energy(model, x)));
  }
}

TEST(TissueModel, RefusesWhatItCannotBe) {
  const auto b = block(2, 2, 2, 1.0);
  for (const Material m : {Material{0.1, 0.2}, Material{0.1, 0.5}, Material{0, 0.3}, Material{NAN, 0.3}})
    EXPECT_THROW(TissueModel::of_voxels(b.points, b.tets, std::span(&m, 1)), Error);
  auto tets = b.tets;
  tets.pop_back();
  const Material m{0.1, 0.45};
  EXPECT_THROW(TissueModel::of_voxels(b.points, tets, std::span(&m, 1)), Error);
  auto points = b.points;
  points[0].x -= 0.3;
  EXPECT_THROW(TissueModel::of_voxels(points, b.tets, std::span(&m, 1)), Error);
}

}  // namespace
}  // namespace osteo
