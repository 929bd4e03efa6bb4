// Long steps with a factor made once: against the law's own equilibrium, against exact steps, under the tool, cut.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "block.h"
#include "block_factor.h"
#include "osteo/core/base/error.h"
#include "osteo/simulation/tissue/detail/equilibrium.h"
#include "osteo/simulation/tissue/dynamics.h"
#include "osteo/simulation/tissue/voxel_cutting.h"

namespace osteo {
namespace {

using tissue::BlockFactor;

TEST(BlockFactor, SolvesWhatItWasMadeOf) {
  // A chain with blocks across it, positive definite by its diagonal.
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(-1, 1);
  constexpr std::size_t kPoints = 40;
  std::vector<BlockFactor::Block> blocks;
  const auto put = [&](std::uint32_t r, std::uint32_t c) {
    BlockFactor::Block b{r, c, {}};
    for (double& v : b.value) v = u(random);
    blocks.push_back(b);
  };
  for (std::uint32_t p = 1; p < kPoints; ++p) {
    put(p, p - 1);
    if (p >= 7) put(p, p - 7);
  }
  for (std::uint32_t p = 0; p < kPoints; ++p) blocks.push_back({p, p, {20, 1, 2, 1, 21, 3, 2, 3, 22}});
  blocks.push_back({5, 5, {1, 0, 0, 0, 1, 0, 0, 0, 1}});  // added up
  std::vector<double> x(3 * kPoints), right(3 * kPoints);
  for (double& v : x) v = u(random);
  for (const auto& b : blocks) {
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        right[3 * b.row + i] += b.value[3 * i + j] * x[3 * b.column + j];
        if (b.row != b.column) right[3 * b.column + j] += b.value[3 * i + j] * x[3 * b.row + i];
      }
    }
  }
  BlockFactor factor(kPoints, blocks);
  std::vector<float> y(4 * kPoints);
  for (std::size_t p = 0; p < kPoints; ++p)
    for (std::size_t a = 0; a < 3; ++a) y[4 * p + a] = static_cast<float>(right[3 * p + a]);
  factor.solve(y);
  for (std::size_t p = 0; p < kPoints; ++p)
    for (std::size_t a = 0; a < 3; ++a) EXPECT_NEAR(y[4 * p + a], x[3 * p + a], 2e-6);
  EXPECT_THROW(BlockFactor(1, {{0, 0, {1, 0, 0, 0, -1, 0, 0, 0, 1}}}), Error);
}

// A pad held at its underside.
struct Pad {
  test::Block b;
  TissueModel model;
  std::vector<std::uint32_t> fixed;
  explicit Pad(double nu = 0.45, int n = 8, int nz = 3, double h = 3)
      : b(test::block(n, n, nz, h)), model(TissueModel::of_voxels(b.points, b.tets, std::array{Material{0.04, nu}})) {
    model.scale({1, 1, 0, 1});
    for (std::uint32_t p = 0; p < b.points.size(); ++p) {
      if (b.points[p].z < 0.1) fixed.push_back(p);
    }
  }
  [[nodiscard]] TissueDynamics<float> with(int iterations, double step_s = 0.01) const {
    return {model, fixed, {.damping_per_s = 150, .factorised_step_s = step_s, .iterations = iterations}};
  }
};

double most_off(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double most = 0;
  for (std::size_t p = 0; p < a.size(); ++p) most = std::max(most, length(a[p] - b[p]));
  return most;
}

// It comes to rest where Newton's method finds the equilibrium of the same law, at strains of a half; near
// incompressible with more iterations.
TEST(Factorised, RestsAtTheEquilibrium) {
  for (const double nu : {0.3, 0.45, 0.49}) {
    const Pad pad(nu);
    std::vector<std::pair<std::uint32_t, Vec3>> load;
    for (std::uint32_t p = 0; p < pad.b.points.size(); ++p) {
      if (pad.b.points[p].z > 8.9 && pad.b.points[p].x > 11) load.push_back({p, {0.03, 0.01, -0.02}});
    }
    auto body = pad.with(nu > 0.46 ? 6 : 3);
    body.set_load(load);
    body.step(200);
    EquilibriumSolver solver(pad.model, pad.model.rest(), pad.fixed);
    const Equilibrium exact = solver.solve(pad.model, pad.model.rest(), load);
    ASSERT_TRUE(exact.converged);
    EXPECT_GT(most_off(exact.points_mm, pad.model.rest()), 3) << nu;
    EXPECT_LT(most_off(exact.points_mm, body.positions_mm()), 2e-3) << nu;
    EXPECT_EQ(body.counts().not_finite, 0u);
  }
}

// Converged steps keep momentum, also of a body that turns away from how it lay when the factor was made.
TEST(Factorised, MomentumIsKeptWithoutDampingAndAFreeBodyTurns) {
  const auto b = test::block(3, 3, 3, 2.0);
  const Material m{0.1, 0.45};
  const TissueModel model = TissueModel::of_voxels(b.points, b.tets, std::span(&m, 1));
  TissueDynamics<double> body(model, {}, {.factorised_step_s = 0.001, .iterations = 25});
  std::vector<std::pair<std::uint32_t, Vec3>> load{{0, {1e-4, 0, 0}}, {5, {0, 2e-4, 1e-4}}};
  body.set_load(load);
  body.step(50);
  const Vec3 pushed{1e-4 * 0.05, 2e-4 * 0.05, 1e-4 * 0.05};
  EXPECT_LT(length(body.momentum_n_s() - pushed), 0.01 * length(pushed));
  body.set_load({});
  body.step(200);
  EXPECT_LT(length(body.momentum_n_s() - pushed), 0.01 * length(pushed));
}

// A ball pressed in step by step, not where all is symmetric: there a voxel under it may buckle to either side.
struct Pressed {
  std::vector<Vec3> points;
  std::vector<double> force;
};
Pressed press(const Pad& pad, int iterations, double depth_mm, double step_s = 0.01) {
  auto body = pad.with(iterations, step_s);
  Pressed r;
  const int each = static_cast<int>(std::lround(0.01 / step_s));
  for (int n = 0; n < 60; ++n) {
    const double deep = depth_mm * std::min(1.0, n / 40.0);
    body.set_tool({std::make_shared<BallShape>(Vec3{6.4, 5.3, 9 + 3 - deep}, 3), 0.1});
    r.force.push_back(length(body.step(each)));
  }
  r.points = body.positions_mm();
  EXPECT_EQ(body.counts().not_finite, 0u);
  EXPECT_EQ(body.counts().softened, 0u);
  return r;
}

TEST(Factorised, ThreeIterationsLieNearManyUnderATool) {
  const Pad pad(0.45, 8, 6, 1.5);
  const Pressed exact = press(pad, 40, 2.4), few = press(pad, 3, 2.4), again = press(pad, 3, 2.4);
  const double moved = most_off(exact.points, pad.model.rest());
  EXPECT_GT(moved, 1.5);
  EXPECT_LT(most_off(few.points, exact.points), 0.02 * moved);
  double most = 0, off = 0;
  for (std::size_t n = 10; n < few.force.size(); ++n) {  // the first touch takes some updates
    most = std::max(most, exact.force[n]);
    off = std::max(off, std::abs(few.force[n] - exact.force[n]));
  }
  EXPECT_GT(most, 0.05);
  EXPECT_LT(off, 0.05 * most);
  EXPECT_EQ(few.force, again.force);  // to the bit
}

// Two radii deep, in voxels of half a radius: the surface under the tool stays before it, the force rises all the way,
// and what was pressed comes back.
TEST(Factorised, ABurrPressedTwoRadiiDeepDoesNotSlipThrough) {
  for (const double nu : {0.3, 0.45}) {
    const Pad pad(nu, 8, 6, 1.5);
    auto body = pad.with(3);
    double last = 0;
    const Vec3 top{6, 6, 9};
    for (int n = 0; n <= 80; ++n) {
      const double deep = 6 * n / 80.0;
      body.set_tool({std::make_shared<BallShape>(top + Vec3{0, 0, 3 - deep}, 3), 0.1});
      const Vec3 f = body.step();
      if (n % 10 != 0 || n == 0) continue;
      EXPECT_GT(f.z, last) << nu << " at " << deep;
      EXPECT_LT(std::hypot(f.x, f.y), 0.1 * f.z) << nu << " at " << deep;
      last = f.z;
    }
    const auto x = body.positions_mm();
    std::size_t under = 0;
    for (std::uint32_t p = 0; p < x.size(); ++p) {
      const Vec3& rest = pad.b.points[p];
      if (rest.z < 8.9 || std::hypot(rest.x - 6, rest.y - 6) > 1.2) continue;
      ++under;
      EXPECT_LT(x[p].z, 4.5) << nu;  // the tool's lowest point is at 3
    }
    EXPECT_GT(under, 0u);
    body.set_tool({});
    body.step(200);
    EXPECT_LT(most_off(body.positions_mm(), pad.model.rest()), 0.05) << nu;
  }
}

TEST(Factorised, CutsAndHeldTissueAndNonsense) {
  const Pad pad;
  auto body = pad.with(3);
  VoxelCutting cutting(pad.model, 27);
  for (int n = 0; n < 60; ++n) {
    const auto ball = std::make_shared<BallShape>(Vec3{12, 12, 12 - 0.08 * n}, 3);
    body.set_tool({ball, 0.1});
    body.step();
    cutting.cut(body, *ball, 10);
  }
  EXPECT_GT(cutting.cut_mm3(), 100);
  body.set_tool({std::make_shared<BallShape>(Vec3{NAN, 0, 0}, 3), 0.1});
  body.step(3);
  body.set_tool({});
  body.step(300);
  // What is left goes back to where it was.
  const auto x = body.positions_mm();
  std::vector<bool> there(x.size());
  for (std::size_t t = 0; t < pad.b.tets.size(); ++t) {
    if (cutting.gone()[t]) continue;
    for (const std::uint32_t p : pad.b.tets[t]) there[p] = true;
  }
  for (std::size_t p = 0; p < x.size(); ++p) {
    ASSERT_TRUE(std::isfinite(x[p].x + x[p].y + x[p].z));
    if (there[p]) {
      EXPECT_LT(length(x[p] - pad.b.points[p]), 0.05);
    }
  }
  EXPECT_THROW(pad.with(0), Error);
  EXPECT_THROW(pad.with(3, -1), Error);
}

}  // namespace
}  // namespace osteo
