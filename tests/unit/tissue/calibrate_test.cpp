#include "osteo/simulation/tissue/calibrate.h"

#include <gtest/gtest.h>

#include <cmath>

#include "block.h"
#include "osteo/core/base/error.h"

namespace osteo {
namespace {

using test::block;

struct Problem {
  test::Block b = block(8, 4, 4, 2.0);
  Material m{0.1, 0.45};
  std::vector<std::uint32_t> fixed, end;
  Problem() {
    for (std::uint32_t p = 0; p < b.points.size(); ++p) {
      if (b.points[p].x < 1e-9) fixed.push_back(p);
      if (b.points[p].x > 15.99) end.push_back(p);
    }
  }
  [[nodiscard]] TissueLoad load(Vec3 total) const {
    TissueLoad l;
    l.fixed = fixed;
    for (const std::uint32_t p : end) l.forces_n.push_back({p, total / static_cast<double>(end.size())});
    return l;
  }
  [[nodiscard]] TissueModel model() const { return TissueModel::of_voxels(b.points, b.tets, std::span(&m, 1)); }
};

// What a model with known factors does is explained by those factors.
TEST(Calibrate, FindsFactorsThatAreThere) {
  if (!has_ceres()) GTEST_SKIP() << "built without Ceres: calibration not tested";
  const Problem p;
  TissueModel truth = p.model();
  truth.scale({1.4, 0.7, 20, 2});
  std::vector<CalibrationCase> cases;
  for (const Vec3 f : {Vec3{0, 0, 0.02}, Vec3{0.1, 0, 0}, Vec3{0, 0.03, -0.01}}) {
    const TissueLoad load = p.load(f);
    EquilibriumSolver solver(truth, truth.rest(), load.fixed);
    const Equilibrium r = solver.solve(truth, truth.rest(), load.forces_n);
    ASSERT_TRUE(r.converged) << r.why;
    cases.push_back({load, r.points_mm});
  }
  TissueModel model = p.model();
  CalibrateOptions options;
  options.pull = 0;
  options.tolerance = 1e-6;
  const Calibration c = calibrate(model, cases, options);
  ASSERT_TRUE(c.converged) << c.why;
  ASSERT_EQ(c.log_factors.size(), 4u);
  const double exact[] = {1.4, 0.7, 20, 2};
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(c.log_factors[i], std::log(exact[i]), 0.02) << i;
  for (const auto& e : c.after) EXPECT_LT(e.nrms, 1e-3);
  EXPECT_LT(c.solves, 60 * 3);
  EXPECT_LT(c.after[0].nrms, 0.05 * c.before[0].nrms);
  // The same again, to the bit.
  TissueModel again = p.model();
  EXPECT_EQ(calibrate(again, cases, options).log_factors, c.log_factors);
}

// Jacobian against central differences, through the public way: a model moved a little along each factor.
TEST(Calibrate, SensitivitiesAreThoseOfTheEquilibrium) {
  const Problem p;
  TissueModel model = p.model();
  model.scale({1, 1, 5, 1});
  const TissueLoad load = p.load({0, 0.01, 0.03});
  EquilibriumSolver solver(model, model.rest(), load.fixed);
  const EquilibriumOptions tight{1e-13, 60, 1};
  const Equilibrium at = solver.solve(model, model.rest(), load.forces_n, tight);
  for (std::size_t kind = 0; kind < kTissueClasses; ++kind) {
    // Implicit: H du = - gradient of the class.
    std::vector<Vec3> right(model.point_count()), du(model.point_count());
    for (std::size_t c = 0; c < model.constraints().size(); ++c) {
      if (static_cast<std::size_t>(model.constraints()[c].kind) != kind) continue;
      Vec3 x[8];
      double g[24];
      const auto nodes = model.nodes(c);
      for (std::size_t a = 0; a < nodes.size(); ++a) x[a] = at.points_mm[nodes[a]];
      model.element(c, x, g, nullptr);
      for (std::size_t a = 0; a < nodes.size(); ++a) right[nodes[a]] -= Vec3{g[3 * a], g[3 * a + 1], g[3 * a + 2]};
    }
    static_cast<void>(solver.solve(model, at.points_mm, load.forces_n, tight));
    solver.back_solve(right, du);
    std::array<Equilibrium, 2> side;
    for (const int s : {0, 1}) {
      std::array<double, 4> factors{1, 1, 5, 1};
      factors[kind] *= std::exp(s == 0 ? 1e-4 : -1e-4);
      TissueModel other = p.model();
      other.scale(factors);
      side[static_cast<std::size_t>(s)] = solver.solve(other, at.points_mm, load.forces_n, tight);
    }
    double off = 0, size = 0;
    for (std::size_t q = 0; q < du.size(); ++q) {
      const Vec3 differences = (side[0].points_mm[q] - side[1].points_mm[q]) / 2e-4;
      off += dot(differences - du[q], differences - du[q]);
      size += dot(differences, differences);
    }
    EXPECT_LT(std::sqrt(off / size), 1e-6) << kind;
  }
}

TEST(Calibrate, ErrorMetrics) {
  const Problem p;
  const auto& rest = p.b.points;
  std::vector<Vec3> truth = rest, shape = rest;
  for (Vec3& x : truth) x += Vec3{0, 0, 0.01 * x.x * x.x};
  EXPECT_NEAR(calibration_error(rest, rest, truth).nrms, 1, 1e-12);
  const double c = std::cos(0.3), s = std::sin(0.3);
  for (std::size_t i = 0; i < rest.size(); ++i)
    shape[i] = {c * truth[i].x - s * truth[i].y + 3, s * truth[i].x + c * truth[i].y, truth[i].z - 2};
  EXPECT_GT(calibration_error(rest, shape, truth).nrms, 1);
  EXPECT_LT(calibration_error(rest, shape, truth).nrms_free_of_rigid, 1e-12);
}

// Two materials, 20 : 1, that the model is not told of: a map finds both and the border, from a guess that is neither.
TEST(Calibrate, AMapFindsMaterialsItIsNotToldOf) {
  if (!has_ceres()) GTEST_SKIP() << "built without Ceres: calibration not tested";
  const test::Block b = block(4, 4, 8, 2.0);
  std::vector<Material> materials;
  for (const auto& t : b.tets) {
    double z = 0;
    for (const std::uint32_t p : t) z += b.points[p].z / 4;
    materials.push_back({z < 8 ? 1.0 : 0.05, 0.45});
  }
  const FemBody body(b.points, b.tets, materials, ElasticLaw::neo_hooke, TetOrder::t10);
  TissueLoad load;
  for (std::uint32_t p = 0; p < b.points.size(); ++p) {
    if (b.points[p].z < 1e-9) load.fixed.push_back(p);
    if (b.points[p].z > 15.9) load.forces_n.push_back({p, {0, 0, 0.004}});
    if (b.points[p].z > 5.9 && b.points[p].z < 6.1) load.forces_n.push_back({p, {0, 0, 0.06}});
  }
  const TissueLoad all = body.on_all_points(load);
  EquilibriumSolver solver(body, body.rest(), all);
  Equilibrium truth = solver.solve(body, body.rest(), all.forces_n);
  ASSERT_TRUE(truth.converged);
  truth.points_mm.resize(b.points.size());
  const CalibrationCase c{load, truth.points_mm};
  const Material guess{0.3, 0.45};
  TissueModel model = TissueModel::of_voxels(b.points, b.tets, std::span(&guess, 1));
  CalibrateOptions o;
  o.grid = {1, 1, 9};
  o.pull = 0.01;
  const Calibration r = calibrate(model, std::span(&c, 1), o);
  ASSERT_TRUE(r.converged) << r.why;
  EXPECT_EQ(r.parameters, 13);
  EXPECT_LT(r.solves, 40);
  EXPECT_LT(r.after[0].nrms, 0.12);
  EXPECT_LT(r.after[0].nrms, 0.3 * r.before[0].nrms);
  // Two voxels from the border.
  const double below = r.log_stiffness[2], above = r.log_stiffness[6];
  std::printf("contrast learnt: %.1f (20), at NRMS %.3f\n", std::exp(below - above), r.after[0].nrms);
  EXPECT_NEAR(below - above, std::log(20.0), std::log(1.5));
  ASSERT_EQ(r.course.size(), r.cost.size());
  EXPECT_EQ(r.course.front().size(), 13u);
  for (std::size_t s = 1; s < r.cost.size(); ++s) EXPECT_LE(r.cost[s], r.cost[s - 1]);
}

// A coarse search does no harm, and is the same each time; from far off it finds what the closed form would have led
// to.
TEST(Calibrate, CoarseSearch) {
  if (!has_ceres()) GTEST_SKIP() << "built without Ceres: calibration not tested";
  const Problem p;
  TissueModel truth = p.model();
  truth.scale({1.4, 0.7, 20, 2});
  const TissueLoad load = p.load({0.01, 0, 0.02});
  EquilibriumSolver solver(truth, truth.rest(), load.fixed);
  const CalibrationCase c{load, solver.solve(truth, truth.rest(), load.forces_n).points_mm};
  CalibrateOptions o;
  TissueModel plain = p.model(), searched = p.model(), again = p.model();
  const Calibration a = calibrate(plain, std::span(&c, 1), o);
  o.samples = 20;
  o.starts = 3;
  const Calibration b = calibrate(searched, std::span(&c, 1), o);
  EXPECT_LE(b.cost.back(), a.cost.back() * 1.0001);
  EXPECT_GE(b.solves, a.solves + 20);
  EXPECT_EQ(calibrate(again, std::span(&c, 1), o).log_factors, b.log_factors);
}

// Twice as stiff moves half as far under the same load.
TEST(Calibrate, ForceError) {
  const Problem p;
  TissueModel model = p.model();
  model.scale({1, 1, 0, 1});
  TissueModel stiffer = model;
  stiffer.scale({2, 2, 0, 2});
  const TissueLoad load = p.load({0, 0, 1e-5});
  EquilibriumSolver solver(model, model.rest(), load);
  const auto truth = solver.solve(model, model.rest(), load.forces_n).points_mm,
             shape = solver.solve(stiffer, model.rest(), load.forces_n).points_mm;
  EXPECT_NEAR(force_error(model.rest(), shape, truth, load), 1, 1e-4);
  EXPECT_NEAR(force_error(model.rest(), truth, truth, load), 0, 1e-12);
}

TEST(Calibrate, ErrorsSayWhat) {
  if (!has_ceres()) GTEST_SKIP() << "built without Ceres: calibration not tested";
  const Problem p;
  TissueModel model = p.model();
  EXPECT_THROW(calibrate(model, {}), Error);
  CalibrationCase c{p.load({0, 0, 1}), model.rest()};
  EXPECT_THROW(calibrate(model, std::span(&c, 1)), Error);  // the truth has not moved
  c.truth_mm.pop_back();
  EXPECT_THROW(calibrate(model, std::span(&c, 1)), Error);
}

}  // namespace
}  // namespace osteo
