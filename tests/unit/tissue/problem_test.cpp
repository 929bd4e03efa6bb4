#include "osteo/tissue/problem.h"

#include <gtest/gtest.h>

#include "block.h"
#include "osteo/base/error.h"
#include "osteo/tissue/calibrate.h"

namespace osteo {
namespace {

TetMesh mesh_of(const test::Block& b) {
  TetMesh m;
  m.points_mm.resize(b.points.size());
  for (std::size_t p = 0; p < b.points.size(); ++p) m.points_mm[p] = to_floats(b.points[p]);
  m.tets.resize(b.tets.size());
  for (std::size_t t = 0; t < b.tets.size(); ++t) m.tets[t] = b.tets[t];
  return m;
}

TEST(TissueProblem, IsReadOntoAMesh) {
  const TetMesh mesh = mesh_of(test::block(4, 2, 2, 5.0));
  const TissueProblem p = parse_tissue_problem(R"({"osteotome_tissue": 1, "material": {"young_kpa": 100, "poisson": 0.45},
    "regions": [{"box_mm": [[10, -1, -1], [21, 11, 11]], "young_kpa": 50, "poisson": 0.3}],
    "fixed": [{"box_mm": [[-1, -1, -1], [0.1, 11, 11]]}],
    "loads": [{"name": "A", "forces": [{"at_mm": [20, 5, 5], "radius_mm": 6, "total_n": [0, 0, 2]}]}, {"forces": [{"box_mm": [[19, 0, 0], [21, 10, 10]], "total_n": [1, 0, 0]}]}]})",
                                               mesh);
  EXPECT_EQ(p.fixed.size(), 9u);
  ASSERT_EQ(p.materials.size(), mesh.tets.size());
  EXPECT_EQ(p.materials.front().young_mpa, 0.1);
  EXPECT_EQ(p.materials.back().poisson, 0.3);
  ASSERT_EQ(p.loads.size(), 2u);
  EXPECT_EQ(p.load_names[0], "A");
  EXPECT_EQ(p.load_names[1], "load 2");
  Vec3 total{};
  for (const auto& [point, f] : p.loads[0].forces_n) total += f;
  EXPECT_NEAR(total.z, 2, 1e-12);
  EXPECT_EQ(p.loads[1].forces_n.size(), 9u);
}

TEST(TissueProblem, FactorsOfAGridAreAppliedAsTheyWereFitted) {
  if (!has_ceres()) GTEST_SKIP() << "built without Ceres: calibration not tested";
  const auto b = test::block(6, 3, 3, 2.0);
  const Material m{0.1, 0.45};
  TissueModel model = TissueModel::of_voxels(b.points, b.tets, std::span(&m, 1));
  CalibrationCase c;
  for (std::uint32_t p = 0; p < b.points.size(); ++p) {
    if (b.points[p].x < 1e-9) c.load.fixed.push_back(p);
    if (b.points[p].x > 11.99) c.load.forces_n.push_back({p, {0, 0, 0.002}});
  }
  TissueModel truth = model;
  truth.scale({2, 1.5, 1, 0.5});
  EquilibriumSolver solver(truth, truth.rest(), c.load.fixed);
  c.truth_mm = solver.solve(truth, truth.rest(), c.load.forces_n).points_mm;
  for (const bool shared : {true, false}) {
    TissueModel fitted = model;
    CalibrateOptions o;
    o.grid = {3, 1, 2};
    o.shared_grid = shared;
    const Calibration r = calibrate(fitted, std::span(&c, 1), o);
    ASSERT_EQ(r.log_factors.size(), 6u * kTissueClasses);
    const TissueModel again = with_log_factors(model, o.grid, r.log_factors);
    for (std::size_t k = 0; k < again.constraints().size(); ++k)
      EXPECT_NEAR(again.constraints()[k].stiffness, fitted.constraints()[k].stiffness, 1e-9 * fitted.constraints()[k].stiffness) << shared;
    EXPECT_LT(r.after[0].nrms, 0.05);
  }
  EXPECT_THROW(with_log_factors(model, {2, 2, 2}, std::vector<double>(5)), Error);
}

}  // namespace
}  // namespace osteo
