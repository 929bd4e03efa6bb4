// Hard cases of the issue of tissue: each comes to rest, or says that and why it did not; nothing is clamped in
// silence.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "block.h"
#include "osteo/core/base/error.h"
#include "osteo/simulation/tissue/detail/equilibrium.h"
#include "osteo/simulation/tissue/dynamics.h"

namespace osteo {
namespace {

using test::block;

struct Held {
  test::Block b;
  std::vector<std::uint32_t> fixed;
  std::vector<std::pair<std::uint32_t, Vec3>> top(Vec3 total) const {
    std::vector<std::pair<std::uint32_t, Vec3>> load;
    double high = 0;
    for (const Vec3& p : b.points) high = std::max(high, p.z);
    for (std::uint32_t p = 0; p < b.points.size(); ++p) {
      if (b.points[p].z > high * (1 - 1e-9)) load.push_back({p, total});
    }
    for (auto& l : load) l.second = l.second / static_cast<double>(load.size());
    return load;
  }
};
Held held(int n, double h) {
  Held x{block(n, n, n, h), {}};
  for (std::uint32_t p = 0; p < x.b.points.size(); ++p) {
    if (x.b.points[p].z < 1e-12) x.fixed.push_back(p);
  }
  return x;
}
bool finite_all(std::span<const Vec3> x) {
  return std::all_of(x.begin(), x.end(), [](Vec3 p) { return std::isfinite(p.x + p.y + p.z); });
}
// Forces balance: what holds it carries the load.
void expect_balance(const Energy& energy, const Equilibrium& r,
                    const std::vector<std::pair<std::uint32_t, Vec3>>& load) {
  std::vector<Vec3> g(r.points_mm.size());
  total_gradient(energy, r.points_mm, g);
  Vec3 sum{}, total{};
  double size = 0;
  for (const auto& [p, f] : load) {
    total += f;
    size += length(f);
    g[p] -= f;
  }
  for (const Vec3 f : g) sum += f;
  EXPECT_LT(length(sum + total), 1e-6 * size + 1e-15);
}

TEST(TissueStability, ContrastOfStiffness) {
  const Held x = held(4, 25);
  for (const double contrast : {20.0, 1e4}) {
    std::vector<Material> voxels, tets;
    for (std::size_t v = 0; v < x.b.tets.size() / 5; ++v) {
      const double z = x.b.points[x.b.tets[5 * v][0]].z;
      voxels.push_back({z < 45 ? 0.05 * contrast : 0.05, 0.45});
      for (int t = 0; t < 5; ++t) tets.push_back(voxels.back());
    }
    const auto load = x.top({0.5, 0, -1});
    const TissueModel model = TissueModel::of_voxels(x.b.points, x.b.tets, voxels);
    EquilibriumSolver solver(model, model.rest(), x.fixed);
    const Equilibrium r = solver.solve(model, model.rest(), load, {1e-9, 60, 1});
    EXPECT_TRUE(r.converged) << contrast << ": " << r.why;
    expect_balance(model, r, load);
    for (const TetOrder order : {TetOrder::t4, TetOrder::t10}) {
      const FemBody body(x.b.points, x.b.tets, tets, ElasticLaw::neo_hooke, order);
      EquilibriumSolver fem(body, body.rest(), body.with_middles(x.fixed));
      const Equilibrium f = fem.solve(body, body.rest(), load, {1e-9, 60, 1});
      EXPECT_TRUE(f.converged) << contrast << ": " << f.why;
      EXPECT_EQ(body.inverted(f.points_mm), 0u);
    }
  }
}

TEST(TissueStability, NearlyIncompressible) {
  const Held x = held(3, 25);
  for (const double nu : {0.499, 0.4999}) {
    const Material m{0.1, nu};
    const auto load = x.top({1, 0, -2});
    const TissueModel model = TissueModel::of_voxels(x.b.points, x.b.tets, std::span(&m, 1));
    EquilibriumSolver solver(model, model.rest(), x.fixed);
    const Equilibrium r = solver.solve(model, model.rest(), load, {1e-8, 80, 1});
    EXPECT_TRUE(r.converged) << nu << ": " << r.why;
    EXPECT_LE(r.iterations, 40);
    const FemBody body(x.b.points, x.b.tets, {m}, ElasticLaw::neo_hooke, TetOrder::t10);
    EquilibriumSolver fem(body, body.rest(), body.with_middles(x.fixed));
    EXPECT_TRUE(fem.solve(body, body.rest(), load, {1e-8, 80, 1}).converged) << nu;
  }
}

TEST(TissueStability, HugeLoadsComeToRestOrSaySo) {
  const Held x = held(3, 10);
  const Material m{0.1, 0.45};
  TissueModel model = TissueModel::of_voxels(x.b.points, x.b.tets, std::span(&m, 1));
  model.scale({1, 1, 5, 1});
  const FemBody body(x.b.points, x.b.tets, {m}, ElasticLaw::neo_hooke, TetOrder::t4);
  for (const double newtons : {1.0, 10.0, 100.0, 1e3, 1e6}) {
    const auto load = x.top({0.3 * newtons, 0, newtons});
    EquilibriumSolver solver(model, model.rest(), x.fixed), fem(body, body.rest(), x.fixed);
    for (const Equilibrium& r : {solver.solve(model, model.rest(), load, {1e-9, 200, 1}),
                                 fem.solve(body, body.rest(), load, {1e-9, 200, 1})}) {
      EXPECT_TRUE(finite_all(r.points_mm)) << newtons;
      EXPECT_TRUE(r.converged || !r.why.empty()) << newtons;
      EXPECT_TRUE(r.converged || newtons > 100) << newtons << ": " << r.why;
    }
    // Load steps are another way to the same place.
    if (newtons <= 10) {
      const Equilibrium once = fem.solve(body, body.rest(), load),
                        often = fem.solve(body, body.rest(), load, {1e-10, 100, 5});
      double off = 0;
      for (std::size_t p = 0; p < once.points_mm.size(); ++p)
        off = std::max(off, length(once.points_mm[p] - often.points_mm[p]));
      EXPECT_LT(off, 1e-6);
    }
  }
}

// Micrometres and kilometres: the same shape, in proportion.
TEST(TissueStability, AnyUnits) {
  const Material m{0.1, 0.45};
  std::vector<Vec3> first;
  for (const double scale : {1.0, 1e-3, 1e6}) {
    const Held x = held(3, 10 * scale);
    const auto load = x.top(Vec3{0.3, 0, -0.5} * (scale * scale));
    const FemBody body(x.b.points, x.b.tets, {m}, ElasticLaw::neo_hooke, TetOrder::t10);
    EquilibriumSolver fem(body, body.rest(), body.with_middles(x.fixed));
    const Equilibrium r = fem.solve(body, body.rest(), load);
    ASSERT_TRUE(r.converged) << scale << ": " << r.why;
    const TissueModel model = TissueModel::of_voxels(x.b.points, x.b.tets, std::span(&m, 1));
    EquilibriumSolver solver(model, model.rest(), x.fixed);
    EXPECT_TRUE(solver.solve(model, model.rest(), load).converged) << scale;
    TissueDynamics<float> d(model, x.fixed, {.density_kg_m3 = 1000, .damping_per_s = 0});
    d.set_load(load);
    d.step(500);
    EXPECT_EQ(d.counts().not_finite, 0u);
    if (first.empty()) first = r.points_mm;
    for (std::size_t p = 0; p < first.size(); ++p) EXPECT_LT(length(r.points_mm[p] / scale - first[p]), 1e-7);
  }
}

TEST(TissueStability, OneTetrahedron) {
  const std::vector<Vec3> points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const std::vector<std::array<std::uint32_t, 4>> tets{{0, 1, 2, 3}};
  const std::vector<std::uint32_t> fixed{0, 1, 2};
  const std::vector<std::pair<std::uint32_t, Vec3>> load{{3, {0.01, 0, 0.02}}};
  const FemBody body(points, tets, {{0.1, 0.45}}, ElasticLaw::neo_hooke, TetOrder::t4);
  EquilibriumSolver fem(body, body.rest(), fixed);
  EXPECT_TRUE(fem.solve(body, body.rest(), load).converged);
  const TissueModel model = TissueModel::uniform(points, tets, 0.05, 0.01, 0.05);
  EquilibriumSolver solver(model, model.rest(), fixed);
  const Equilibrium r = solver.solve(model, model.rest(), load);
  EXPECT_TRUE(r.converged) << r.why;
  expect_balance(model, r, load);
  // Mirrored through its base it comes back: its volume is signed.
  auto start = model.rest();
  start[3].z = -1;
  EXPECT_NEAR(total_energy(model, start), 2 * 0.05, 1e-9);  // 2 k of the volume, nothing of lengths and areas
  start[3] += Vec3{0.01, 0.02, 0.03};
  const Equilibrium back = solver.solve(model, start, {}, {1e-8, 200, 1});
  EXPECT_TRUE(finite_all(back.points_mm));
}

TEST(TissueStability, AFloatingPartIsNamed) {
  Held x = held(2, 10);
  const auto offset = static_cast<std::uint32_t>(x.b.points.size());
  const auto other = block(1, 1, 1, 10);
  for (const Vec3& p : other.points) x.b.points.push_back(p + Vec3{100, 0, 0});
  for (auto t : other.tets) {
    for (auto& p : t) p += offset;
    x.b.tets.push_back(t);
  }
  const FemBody body(x.b.points, x.b.tets, {{0.1, 0.4}}, ElasticLaw::linear, TetOrder::t4);
  try {
    EquilibriumSolver solver(body, body.rest(), x.fixed);
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("point " + std::to_string(offset)), std::string::npos) << e.what();
  }
}

TEST(TissueStability, Slivers) {
  // A point of a good mesh pressed almost onto its neighbour: tetrahedra down to a millionth of the others' volume.
  Held x = held(3, 10);
  std::uint32_t inner = 0;
  for (std::uint32_t p = 0; p < x.b.points.size(); ++p) {
    if (length(x.b.points[p] - Vec3{10, 10, 10}) < 1e-9) inner = p;
  }
  x.b.points[inner] += Vec3{9.99999, 0, 0};
  double least = 1e9;
  for (auto& t : x.b.tets) {
    const auto v = [&](int i) { return x.b.points[t[static_cast<std::size_t>(i)]]; };
    const double six = dot(v(1) - v(0), cross(v(2) - v(0), v(3) - v(0)));
    least = std::min(least, std::abs(six));
    if (six < 0) std::swap(t[2], t[3]);  // turned over by the move: what counts here is how flat they are
  }
  EXPECT_LT(least, 1e-2);
  const auto load = x.top({0.1, 0, -0.1});
  for (const ElasticLaw law : {ElasticLaw::linear, ElasticLaw::stvk}) {
    const FemBody body(x.b.points, x.b.tets, {{0.1, 0.45}}, law, TetOrder::t4);
    EquilibriumSolver fem(body, body.rest(), x.fixed);
    const Equilibrium r = fem.solve(body, body.rest(), load, {1e-7, 100, 1});
    EXPECT_TRUE(finite_all(r.points_mm));
    EXPECT_TRUE(r.converged || !r.why.empty());
  }
  const TissueModel model = TissueModel::uniform(x.b.points, x.b.tets, 0.05, 0.01, 0.05);
  TissueDynamics<double> d(model, x.fixed);
  EXPECT_GT(d.step_s(), 0);
  d.set_load(load);
  d.step(2000);
  EXPECT_EQ(d.counts().not_finite, 0u);
}

TEST(TissueStability, EnergyThroughAMillionSteps) {
  const auto b = block(2, 2, 2, 5);
  const Material m{0.1, 0.45};
  TissueModel model = TissueModel::of_voxels(b.points, b.tets, std::span(&m, 1), false);
  TissueDynamics<double> d(model, {}, {.density_kg_m3 = 1000, .damping_per_s = 0, .step_share = 0.5});
  std::mt19937 random(4);
  std::uniform_real_distribution<double> u(-0.2, 0.2);
  for (std::uint32_t p = 0; p < d.point_count(); ++p)
    d.set_position(p, model.rest()[p] + Vec3{u(random), u(random), u(random)});
  const double begin = d.elastic_mj();
  double early = 0, late = 0;
  for (int n = 0; n < 1000; ++n) {
    d.step(1000);
    const double off = std::abs(d.elastic_mj() + d.kinetic_mj() - begin);
    (n < 100 ? early : late) = std::max(n < 100 ? early : late, off);
  }
  EXPECT_LT(early, 0.05 * begin);
  EXPECT_LT(late, 1.5 * early);
}

TEST(TissueStability, AMillionTetrahedra) {
  const auto b = block(58, 58, 58, 2);
  ASSERT_GT(b.tets.size(), 975'000u);
  const Material m{0.1, 0.45};
  const TissueModel model = TissueModel::of_voxels(b.points, b.tets, std::span(&m, 1), false);
  TissueDynamics<float> d(model, {}, {.density_kg_m3 = 1000, .damping_per_s = 10});
  d.set_tool({std::make_shared<BallShape>(Vec3{58, 58, 116}, 5), 0.1});
  Vec3 force{};
  for (int n = 0; n < 20; ++n) force = d.step();
  EXPECT_GT(force.z, 0);
  EXPECT_EQ(d.counts().not_finite, 0u);
}

}  // namespace
}  // namespace osteo
