#include "osteo/simulation/tissue/measured.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "error_of.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "scanned.h"
#include "surface_goal.h"

namespace osteo {
namespace {

using test::block;
using test::error_of;
using test::Scan;
using test::scanned;

// A post, 8 x 8 x 16 mm, 1000 kPa below and 50 kPa above or all alike, pulled and bent; finite elements on a mesh half
// again as fine.
struct Post {
  test::Block coarse = block(4, 4, 8, 2.0), fine = block(6, 6, 12, 4.0 / 3);
  double young_below = 1, young_above = 0.05;
  std::vector<Material> materials;
  explicit Post(double below = 1, double above = 0.05) : young_below(below), young_above(above) {
    for (const auto& t : fine.tets) {
      double z = 0;
      for (const std::uint32_t p : t) z += fine.points[p].z / 4;
      materials.push_back({z < 8 ? below : above, 0.45});
    }
  }
  // Forces spread over the end, and over the middle of one side.
  static TissueLoad load(const test::Block& b, Vec3 end_n, Vec3 side_n) {
    TissueLoad l;
    TetMesh mesh;
    for (const Vec3& p : b.points) mesh.points_mm.push_back(to_floats(p));
    for (const auto& t : b.tets) mesh.tets.push_back(t);
    std::vector<std::uint32_t> of;
    const TriMesh skin = boundary_of(mesh, &of);
    for (std::uint32_t p = 0; p < b.points.size(); ++p) {
      if (b.points[p].z < 1e-9) l.fixed.push_back(p);
    }
    for (const auto& t : skin.triangles) {
      const std::array<std::uint32_t, 3> f{of[t[0]], of[t[1]], of[t[2]]};
      const Vec3 a = b.points[f[0]], c = b.points[f[1]], d = b.points[f[2]];
      const double area = length(cross(c - a, d - a)) / 2;
      if (std::min({a.z, c.z, d.z}) > 15.9) l.add_on_face(f, end_n * (area / 64));
      if (std::min({a.x, c.x, d.x}) > 7.9 && std::min({a.z, c.z, d.z}) > 3.9 && std::max({a.z, c.z, d.z}) < 8.1)
        l.add_on_face(f, side_n * (area / 32));
    }
    return l;
  }
  [[nodiscard]] std::vector<Vec3> truth(Vec3 end_n, Vec3 side_n) const {
    const FemBody body(fine.points, fine.tets, materials, ElasticLaw::neo_hooke, TetOrder::t10);
    const TissueLoad all = body.on_all_points(load(fine, end_n, side_n));
    EquilibriumSolver solver(body, body.rest(), all);
    Equilibrium r = solver.solve(body, body.rest(), all.forces_n);
    EXPECT_TRUE(r.converged) << r.why;
    r.points_mm.resize(fine.points.size());
    return r.points_mm;
  }
  [[nodiscard]] TissueModel model(double young_mpa) const {
    const Material m{young_mpa, 0.45};
    return TissueModel::of_voxels(coarse.points, coarse.tets, std::span(&m, 1));
  }
  [[nodiscard]] static std::vector<int> halves(const TissueModel& m) {
    std::vector<int> group;
    for (const auto& c : m.constraints()) {
      const double a = m.rest()[c.node[0]].z, b = m.rest()[c.node[1]].z;
      group.push_back(c.nodes != 2 ? -1 : std::max(a, b) < 7.9 ? 0 : std::min(a, b) > 8.1 ? 1 : -1);
    }
    return group;
  }
};

// One material of 200 kPa, bent; solved once.
struct Bent {
  Post post{0.2, 0.2};
  Vec3 end{0.3, 0.1, 0.4};
  std::vector<Vec3> truth = post.truth(end, {});
};
const Bent& bent() {
  static const Bent b;
  return b;
}

double rms(std::span<const Vec3> a, std::span<const Vec3> b) {
  double sum = 0;
  for (std::size_t p = 0; p < a.size(); ++p) sum += dot(a[p] - b[p], a[p] - b[p]);
  return std::sqrt(sum / static_cast<double>(a.size()));
}

// One material of unknown stiffness, from half of its surface, with noise, a tenth of the points astray, and a guess
// four times too soft: what a clean scan of all of it would have told. (That is 12 % below the material's own: four
// voxels across bend too little.)
TEST(Measured, StiffnessFromHalfOfANoisySurface) {
  if (!has_ceres()) GTEST_SKIP() << "built without Ceres: calibration not tested";
  const auto& [post, end, truth] = bent();
  const double moved = rms(truth, post.fine.points);
  const Scan scan{1500, 0.03 * moved, 0.1, [](Vec3 out) { return dot(out, Vec3{1, -0.5, 0.3}) > 0; }, 3};
  const MeasuredCase c{Post::load(post.coarse, end, {}), {scanned("bend", post.fine, truth, scan)}};
  TissueModel model = post.model(0.05);
  const MeasuredCalibration r = calibrate_measured(model, boundary_surface(model), std::span(&c, 1));
  ASSERT_TRUE(r.fit.converged) << r.fit.why;
  const double kpa = 50 * std::exp(r.all.log);
  std::printf("%.0f kPa (200), deviation %.3f; noise %.4f (%.4f), rejected %zu of %zu, seen %.2f\n", kpa,
              r.all.deviation, r.views[0].noise_mm, scan.noise_mm, r.views[0].rejected, r.views[0].drawn,
              r.views[0].seen_share);
  const MeasuredCase clean{c.load, {scanned("bend", post.fine, truth, {3000, 0, 0, [](Vec3) { return true; }, 4})}};
  TissueModel by_all = post.model(0.05);
  const double reported =
      50 * std::exp(calibrate_measured(by_all, boundary_surface(by_all), std::span(&clean, 1)).all.log);
  EXPECT_NEAR(std::log(reported / 200), 0, 0.15);
  EXPECT_NEAR(std::log(kpa / reported), 0, 0.03);
  EXPECT_LT(std::abs(std::log(kpa / reported)), 2.6 * r.all.deviation);
  EXPECT_LT(r.all.deviation, 0.3);
  EXPECT_NEAR(r.views[0].noise_mm, scan.noise_mm, 0.3 * scan.noise_mm);
  EXPECT_GT(r.views[0].rejected, 75U);
  EXPECT_LT(r.views[0].rejected, 160U);
  EXPECT_GT(r.views[0].seen_share, 0.4);
  EXPECT_LT(r.views[0].seen_share, 0.75);
  EXPECT_GT(r.views[0].before.median_mm, 5 * r.views[0].after.median_mm);
  EXPECT_GT(r.settled[0], 0.9);
  // A quarter of the points astray.
  Scan worse = scan;
  worse.stray_share = 0.25;
  const MeasuredCase strays{c.load, {scanned("bend", post.fine, truth, worse)}};
  TissueModel by_fewer = post.model(0.05);
  const MeasuredCalibration w = calibrate_measured(by_fewer, boundary_surface(by_fewer), std::span(&strays, 1));
  EXPECT_NEAR(std::log(50 * std::exp(w.all.log) / reported), 0, 0.06);
  EXPECT_GT(w.views[0].rejected, 200U);
  // Of 1500 points 300 are drawn, the same each time, and do as well.
  MeasuredOptions few;
  few.max_points = 300;
  TissueModel thinned = post.model(0.05), again = post.model(0.05);
  const MeasuredCalibration t = calibrate_measured(thinned, boundary_surface(model), std::span(&c, 1), few);
  EXPECT_EQ(t.views[0].drawn, 300U);
  EXPECT_EQ(t.views[0].points, 1500U);
  EXPECT_NEAR(t.all.log, r.all.log, 0.1);
  EXPECT_GT(t.all.deviation, r.all.deviation);
  EXPECT_EQ(calibrate_measured(again, boundary_surface(model), std::span(&c, 1), few).fit.log_factors,
            t.fit.log_factors);
}

// 20 : 1, without being told of it, from a cloud of the whole surface and from markers.
TEST(Measured, AMapFindsTheContrast) {
  if (!has_ceres()) GTEST_SKIP() << "built without Ceres: calibration not tested";
  const Post post;
  const Vec3 end{0.08, 0.03, 0.15}, side{2.5, 0.5, 0};
  const auto truth = post.truth(end, side);
  const double moved = rms(truth, post.fine.points);
  MeasuredOptions o;
  o.calibrate.grid = {1, 1, 9};
  o.calibrate.pull = 0.01;
  for (const bool markers : {false, true}) {
    const Scan scan{1500, 0.02 * moved, 0, [](Vec3) { return true; }, 5};
    const MeasuredCase c{
        Post::load(post.coarse, end, side),
        {markers ? test::marked("m", post.fine, truth, 4, scan.noise_mm, 5) : scanned("c", post.fine, truth, scan)}};
    TissueModel model = post.model(0.3);
    o.group_of = Post::halves(model);
    const MeasuredCalibration r = calibrate_measured(model, boundary_surface(model), std::span(&c, 1), o);
    ASSERT_TRUE(r.fit.converged) << r.fit.why;
    const double below = 300 * std::exp(r.groups[0].log), above = 300 * std::exp(r.groups[1].log);
    std::printf("%s: %.0f (1000, %.2f), %.1f (50, %.2f) kPa, contrast %.1f (20), noise %.4f (%.4f)\n",
                markers ? "markers" : "cloud", below, r.groups[0].deviation, above, r.groups[1].deviation,
                below / above, r.views[0].noise_mm, scan.noise_mm);
    EXPECT_EQ(r.views[0].markers, markers);
    EXPECT_NEAR(std::log(below / above), std::log(20), std::log(1.5));
    EXPECT_NEAR(std::log(below / 1000), 0, std::log(1.5));
    EXPECT_NEAR(std::log(above / 50), 0, std::log(1.4));
    EXPECT_EQ(r.settled.size(), 9U);
  }
}

// What was measured lies elsewhere: without finding its pose the stiffness is wrong, with it, it is right, and so is
// the pose.
TEST(Measured, FindsWhereTheCloudLies) {
  if (!has_ceres()) GTEST_SKIP() << "built without Ceres: calibration not tested";
  const auto& [post, end, truth] = bent();
  MeasuredCase c{Post::load(post.coarse, end, {}),
                 {scanned("bend", post.fine, truth, {1500, 0.005, 0, [](Vec3) { return true; }, 7})}};
  const double turn = 0.05;
  for (Vec3& p : c.views[0].points_mm)
    p = Vec3{p.x * std::cos(turn) - p.y * std::sin(turn), p.x * std::sin(turn) + p.y * std::cos(turn), p.z} +
        Vec3{0.5, -0.3, 0.4};
  MeasuredOptions o;
  TissueModel wrong = post.model(0.1), model = post.model(0.1);
  const MeasuredCalibration without = calibrate_measured(wrong, boundary_surface(wrong), std::span(&c, 1), o);
  o.find_pose = true;
  const MeasuredCalibration r = calibrate_measured(model, boundary_surface(model), std::span(&c, 1), o);
  std::printf("%.0f kPa (200), without its pose %.0f; turned %.3f deg, left %.4f mm\n", 100 * std::exp(r.all.log),
              100 * std::exp(without.all.log), r.views[0].turned_deg[2], r.views[0].after.rms_mm);
  EXPECT_NEAR(std::log(100 * std::exp(r.all.log) / 200), 0, 0.15);
  EXPECT_GT(std::abs(std::log(100 * std::exp(without.all.log) / 200)), 0.3);
  EXPECT_NEAR(r.views[0].turned_deg[2], -turn * 57.2958, 0.4);
  EXPECT_LT(r.views[0].after.rms_mm, 0.2 * without.views[0].after.rms_mm);
  EXPECT_LT(without.views[0].shifted_mm[0], 1e-12);
}

// Distances' derivatives, by the shape and by where the cloud lies, against central differences.
TEST(Measured, DistancesHaveExactDerivatives) {
  const auto& [post, end, truth] = bent();
  const TissueModel model = post.model(0.1);
  const BodySurface surface = boundary_surface(model);
  // A shape that fits nothing; a cloud that is off it everywhere, and markers.
  std::vector<Vec3> shape = model.rest(), by;
  for (Vec3& x : shape) {
    by.push_back({0.3 * std::sin(x.z), 0.2 * x.x, 0.1 * std::cos(x.y + x.z)});
    x += Vec3{0.01 * x.z * x.z, 0.02 * x.z, -0.01 * x.x * x.z};
  }
  const std::vector<MeasuredPoints> views{scanned("c", post.fine, truth, {200, 0.2, 0, [](Vec3) { return true; }, 2}),
                                          test::marked("m", post.fine, truth, 9, 0.2, 2)};
  const Context context;
  tissue::SurfaceGoal goal(model, surface, views, true, 1000, context);
  ASSERT_EQ(goal.own(), 12U);
  std::vector<double> own{0.3, -0.2, 0.4, 0.1, 0.2, -0.3, -0.1, 0.2, 0.1, 0.3, -0.2, 0.2};
  std::vector<double> r(goal.rows()), up(r.size()), down(r.size()), exact(r.size()), jacobian(r.size() * 12);
  goal.residuals(shape, own.data(), r.data());
  goal.widen_by_noise(shape);  // narrow enough to bend the loss
  const auto off = [&](std::size_t row) { return std::abs((up[row] - down[row]) / 2e-5 - exact[row]); };
  constexpr double kStep = 1e-5;
  for (std::size_t k = 0; k <= 12; ++k) {
    for (const double side : {1.0, -1.0}) {
      std::vector<Vec3> x = shape;
      std::vector<double> pose = own;
      if (k < 12) pose[k] += side * kStep;
      for (std::size_t p = 0; p < x.size() && k == 12; ++p) x[p] += by[p] * (side * kStep);
      goal.residuals(x, pose.data(), side > 0 ? up.data() : down.data());
    }
    goal.residuals(shape, own.data(), r.data());
    if (k == 12) {
      goal.along(by, exact.data(), 1);
    } else {
      goal.by_own(jacobian.data(), 12);
      for (std::size_t row = 0; row < r.size(); ++row) exact[row] = jacobian[row * 12 + k];
    }
    // Where the nearest triangle changes there is a kink.
    std::size_t bad = 0;
    for (std::size_t row = 0; row < r.size(); ++row) bad += off(row) > 1e-6 ? 1 : 0;
    EXPECT_LE(bad, 2U) << k;
  }
}

// Residuals' derivatives, as the fit takes them, lead it to factors that are there: what the model itself does, seen
// without noise.
TEST(Measured, FindsFactorsThatAreThere) {
  if (!has_ceres()) GTEST_SKIP() << "built without Ceres: calibration not tested";
  const Post post;
  TissueModel truth = post.model(0.1);
  truth.scale({1.4, 0.7, 20, 2});
  std::vector<MeasuredCase> cases;
  for (const Vec3 f : {Vec3{0.1, 0.02, 0.1}, Vec3{0, 0, -0.4}, Vec3{0.02, 0.1, 0.3}}) {
    const TissueLoad load = Post::load(post.coarse, f, {});
    EquilibriumSolver solver(truth, truth.rest(), load);
    const Equilibrium at = solver.solve(truth, truth.rest(), load.forces_n);
    ASSERT_TRUE(at.converged) << at.why;
    cases.push_back({load, {scanned("c", post.coarse, at.points_mm, {800, 0, 0, [](Vec3) { return true; }, 9})}});
  }
  TissueModel model = post.model(0.1);
  MeasuredOptions o;
  o.calibrate.pull = 0;
  o.calibrate.tolerance = 1e-9;
  const MeasuredCalibration r = calibrate_measured(model, boundary_surface(model), cases, o);
  const double exact[] = {1.4, 0.7, 20, 2};
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(r.fit.log_factors[i], std::log(exact[i]), 0.02) << i;
  for (const MeasuredView& v : r.views) EXPECT_LT(v.after.rms_mm, 2e-4);
  EXPECT_LT(r.fit.solves, 300);
}

TEST(Measured, ErrorsSayWhat) {
  if (!has_ceres()) GTEST_SKIP() << "built without Ceres: calibration not tested";
  const auto& [post, end, truth] = bent();
  TissueModel model = post.model(0.1);
  const BodySurface surface = boundary_surface(model);
  const MeasuredCase good{Post::load(post.coarse, end, {}),
                          {scanned("bend.csv", post.fine, truth, {300, 0, 0, [](Vec3) { return true; }, 1})}};
  const auto says = [&](const auto& change) {
    MeasuredCase c = good;
    change(c);
    return error_of([&] { static_cast<void>(calibrate_measured(model, surface, std::span(&c, 1))); });
  };
  const auto scaled = [](double by, Vec3 shift) {
    return [=](MeasuredCase& c) {
      for (Vec3& p : c.views[0].points_mm) p = p * by + shift;
    };
  };
  EXPECT_EQ(says([](MeasuredCase&) {}), "");
  EXPECT_NE(says(scaled(0.001, {})).find("not in mm"), std::string::npos);
  EXPECT_NE(says(scaled(1000, {})).find("not in mm"), std::string::npos);
  EXPECT_NE(says(scaled(1, {50, 0, 0})).find("lie over"), std::string::npos);
  EXPECT_NE(says([](MeasuredCase& c) { c.views[0].points_mm.resize(19); }).find("20 are needed"), std::string::npos);
  EXPECT_NE(says([](MeasuredCase& c) { c.views[0].points_mm[7].y = NAN; }).find("point 7"), std::string::npos);
  EXPECT_NE(says([](MeasuredCase& c) { c.load.forces_n.clear(); }).find("no force"), std::string::npos);
  EXPECT_NE(says([](MeasuredCase& c) { c.views.clear(); }).find("nothing that was measured"), std::string::npos);
  EXPECT_NE(says([&](MeasuredCase& c) {
              c.views[0] = scanned("rest", post.fine, post.fine.points, {300, 0.01, 0, [](Vec3) { return true; }, 1});
            }).find("nearest to the body at rest"),
            std::string::npos);
  EXPECT_NE(says([&](MeasuredCase& c) {
              c.views[0] = test::marked("m", post.fine, truth, 5, 0, 1);
              c.views[0].rest_mm[2] += Vec3{0, 0, 40};
            }).find("marker 2 lies outside"),
            std::string::npos);
}

TEST(Measured, Files) {
  const MeasuredPoints cloud = read_measured_csv("z_mm,x_mm,y_mm,noise_mm\n3,1,2,0.5\n6,4,5,1\n", "a.csv");
  EXPECT_EQ(cloud.points_mm[1].x, 4);
  EXPECT_EQ(cloud.points_mm[1].z, 6);
  EXPECT_TRUE(cloud.rest_mm.empty());
  EXPECT_EQ(cloud.noise_mm[0], 0.5);
  const MeasuredPoints markers = read_measured_csv("x_mm,y_mm,z_mm,x0_mm,y0_mm,z0_mm\n1,2,3,4,5,6\n", "m.csv");
  EXPECT_EQ(markers.rest_mm.at(0).y, 5);
  const auto wrong = [](const char* csv) { return error_of([&] { static_cast<void>(read_measured_csv(csv, "w.csv")); }); };
  EXPECT_NE(wrong("x_mm,y_mm,z_mm\n1,2,3\n1,nan,3\n").find("line 3: y_mm is 'nan'"), std::string::npos);
  EXPECT_NE(wrong("x_mm,y_mm\n1,2\n").find("no column z_mm"), std::string::npos);
  EXPECT_NE(wrong("x_mm,y_mm,z_mm,x0_mm\n1,2,3,4\n").find("no column y0_mm"), std::string::npos);
  EXPECT_NE(wrong("x_mm,y_mm,z_mm,w\n1,2,3,4\n").find("a column 'w'"), std::string::npos);
  EXPECT_NE(wrong("x_mm,y_mm,z_mm,noise_mm\n1,2,3,0\n").find("above 0"), std::string::npos);
  EXPECT_NE(wrong("x_mm,y_mm,z_mm\n").find("no line"), std::string::npos);

  const TemporaryFolder folder;
  const auto write = [&](const std::string& name, const std::string& text) {
    std::ofstream(folder.path() / name) << text;
  };
  write("pull.csv", "x_mm,y_mm,z_mm\n1,2,3\n");
  write("pull.more.xyz", "4 5 6\n7 8 9\n");
  // As a scanner writes it: no triangle.
  write("twist.ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 "
        "2 3\n4 5 6\n1 2 3\n");
  write(".hidden", "");
  write("twist.ply.prov.json", "{}");
  const std::vector<std::string> loads{"pull", "twist", "pull.more"};
  const auto files = read_measured(folder.path(), loads);
  ASSERT_EQ(files.size(), 3U);
  EXPECT_EQ(files[0].load, 0U);
  EXPECT_EQ(files[1].load, 2U);
  EXPECT_EQ(files[1].points.points_mm.size(), 2U);
  EXPECT_EQ(files[2].load, 1U);
  EXPECT_EQ(files[2].points.points_mm.size(), 2U);  // one place twice
  EXPECT_EQ(files[2].points.name, "twist.ply");
  EXPECT_EQ(read_measured(folder.path() / "pull.csv", loads).size(), 1U);
  write("push.csv", "x_mm,y_mm,z_mm\n1,2,3\n");
  EXPECT_NE(
      error_of([&] { static_cast<void>(read_measured(folder.path(), loads)); }).find("'push.csv' is called like no load"),
      std::string::npos);
}

}  // namespace
}  // namespace osteo
