// Finite elements against analytic answers, and against CalculiX where it is installed.
#include "osteo/tissue/fem.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "block.h"
#include "derivatives.h"
#include "osteo/base/error.h"

namespace osteo {
namespace {

using test::block;
using test::shaken;

std::vector<std::uint32_t> where(const std::vector<Vec3>& points, const std::function<bool(Vec3)>& f) {
  std::vector<std::uint32_t> found;
  for (std::uint32_t p = 0; p < points.size(); ++p) {
    if (f(points[p])) found.push_back(p);
  }
  return found;
}

TEST(Fem, GradientsAndHessiansAreThoseOfTheEnergy) {
  const auto b = block(1, 1, 1, 2.0);
  for (const ElasticLaw law : {ElasticLaw::linear, ElasticLaw::stvk, ElasticLaw::neo_hooke}) {
    for (const TetOrder order : {TetOrder::t4, TetOrder::t10}) {
      const FemBody body(b.points, b.tets, {{0.3, 0.4}}, law, order);
      test::expect_exact_derivatives(body, shaken(body.rest(), 0.15, 3));
    }
  }
}

// An irregular patch under a linear displacement of its border: linear inside, to rounding.
TEST(Fem, PatchTest) {
  const auto b = block(3, 3, 3, 1.0);
  std::vector<Vec3> points = b.points;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> u(-0.15, 0.15);
  const auto inside = [](Vec3 p) { return p.x > 0.1 && p.x < 2.9 && p.y > 0.1 && p.y < 2.9 && p.z > 0.1 && p.z < 2.9; };
  for (Vec3& p : points) {
    if (inside(p)) p += Vec3{u(random), u(random), u(random)};
  }
  const auto map = [](Vec3 p) { return p + Vec3{0.01 * p.x + 0.02 * p.y, -0.015 * p.y + 0.005 * p.z, 0.008 * p.z + 0.01 * p.x}; };
  for (const ElasticLaw law : {ElasticLaw::linear, ElasticLaw::stvk, ElasticLaw::neo_hooke}) {
    for (const TetOrder order : {TetOrder::t4, TetOrder::t10}) {
      const FemBody body(points, b.tets, {{1.0, 0.3}}, law, order);
      const auto fixed = body.with_middles(where(points, [&](Vec3 p) { return !inside(p); }));
      std::vector<bool> held(body.point_count());
      std::vector<Vec3> start = body.rest();
      for (const std::uint32_t p : fixed) {
        held[p] = true;
        start[p] = map(body.rest()[p]);
      }
      EquilibriumSolver solver(body, body.rest(), fixed);
      const Equilibrium r = solver.solve(body, start, {}, {.tolerance = 1e-13});
      for (std::size_t p = 0; p < body.point_count(); ++p) EXPECT_LT(length(r.points_mm[p] - map(body.rest()[p])), 1e-12);
    }
  }
}

// A bar pulled at its end, free to thin: the stretches of a neo-Hookean solid, from its own equations by bisection.
TEST(Fem, UniaxialNeoHookean) {
  const auto b = block(2, 2, 4, 1.0);
  const Material m{0.1, 0.45};
  const double mu = m.shear_mpa(), lambda = m.lambda_mpa(), stretch = 1.5;
  // Lateral: mu (t^2 - 1) + lambda ln(stretch t^2) = 0.
  double lo = 0.5, hi = 1;
  for (int i = 0; i < 80; ++i) {
    const double t = 0.5 * (lo + hi);
    (mu * (t * t - 1) + lambda * std::log(stretch * t * t) > 0 ? hi : lo) = t;
  }
  const double t = lo, stress = (mu * (stretch * stretch - 1) + lambda * std::log(stretch * t * t)) / stretch;  // first Piola
  for (const TetOrder order : {TetOrder::t4, TetOrder::t10}) {
    const FemBody body(b.points, b.tets, {m}, ElasticLaw::neo_hooke, order);
    // Homogeneous: the corner points at the bottom slide in their plane; three pins suffice, so the ends are moved as the answer moves
    // them.
    const auto map = [&](Vec3 p) { return Vec3{1 + (p.x - 1) * t, 1 + (p.y - 1) * t, p.z * stretch}; };
    const auto ends = body.with_middles(where(b.points, [](Vec3 p) { return p.z < 0.1 || p.z > 3.9; }));
    std::vector<Vec3> start = body.rest();
    for (const std::uint32_t p : ends) start[p] = map(body.rest()[p]);
    // All points of the ends lie in flat faces; of t10 the middles of face diagonals too.
    for (std::uint32_t p = 0; p < body.point_count(); ++p) {
      if (body.rest()[p].z < 0.1 || body.rest()[p].z > 3.9) start[p] = map(body.rest()[p]);
    }
    std::vector<std::uint32_t> fixed;
    for (std::uint32_t p = 0; p < body.point_count(); ++p) {
      if (body.rest()[p].z < 0.1 || body.rest()[p].z > 3.9) fixed.push_back(p);
    }
    EquilibriumSolver solver(body, body.rest(), fixed);
    const Equilibrium r = solver.solve(body, start, {});
    ASSERT_TRUE(r.converged) << r.why;
    for (std::size_t p = 0; p < body.point_count(); ++p) EXPECT_LT(length(r.points_mm[p] - map(body.rest()[p])), 1e-8);
    std::vector<Vec3> g(body.point_count());
    total_gradient(body, r.points_mm, g);
    double pull = 0;
    for (const std::uint32_t p : fixed) pull += body.rest()[p].z > 3.9 ? g[p].z : 0;
    EXPECT_NEAR(pull, stress * 4, 1e-8);
  }
}

// A slender beam bent by a force at its end, against Timoshenko; t4 is far too stiff, t10 is not, and comes nearer with finer meshes.
TEST(Fem, CantileverConverges) {
  const Material m{100, 0.3};
  double error[2][2];
  for (int fine = 0; fine < 2; ++fine) {
    const int n = fine == 0 ? 1 : 2;
    const auto b = block(10 * n, n, n, 1.0 / n);
    for (const TetOrder order : {TetOrder::t4, TetOrder::t10}) {
      const FemBody body(b.points, b.tets, {m}, ElasticLaw::linear, order);
      const auto fixed = body.with_middles(where(b.points, [](Vec3 p) { return p.x < 1e-9; }));
      std::vector<std::pair<std::uint32_t, Vec3>> load;
      const auto end = where(b.points, [](Vec3 p) { return p.x > 9.999; });
      for (const std::uint32_t p : end) load.push_back({p, {0, 0, 0.01 / static_cast<double>(end.size())}});
      EquilibriumSolver solver(body, body.rest(), fixed);
      const Equilibrium r = solver.solve(body, body.rest(), load);
      ASSERT_TRUE(r.converged) << r.why;
      double tip = 0;
      for (const std::uint32_t p : end) tip += (r.points_mm[p].z - body.rest()[p].z) / static_cast<double>(end.size());
      const double inertia = 1.0 / 12, shear = m.shear_mpa();
      const double exact = 0.01 * 1000 / (3 * 100 * inertia) + 0.01 * 10 / (5.0 / 6 * shear);
      error[fine][order == TetOrder::t10 ? 1 : 0] = tip / exact - 1;
    }
  }
  EXPECT_LT(error[0][0], -0.4);
  EXPECT_LT(error[1][0], -0.2);
  EXPECT_LT(std::abs(error[0][1]), 0.05);
  EXPECT_LT(std::abs(error[1][1]), 0.02);
  std::printf("cantilever, tip against Timoshenko: t4 %+.1f %% and %+.1f %% (halved), t10 %+.2f %% and %+.2f %%\n", 100 * error[0][0],
              100 * error[1][0], 100 * error[0][1], 100 * error[1][1]);
}

TEST(Fem, ARigidMotionCostsNothing) {
  const auto b = block(2, 2, 2, 1.0);
  const double c = std::cos(1.1), s = std::sin(1.1);
  for (const ElasticLaw law : {ElasticLaw::stvk, ElasticLaw::neo_hooke}) {
    for (const TetOrder order : {TetOrder::t4, TetOrder::t10}) {
      const FemBody body(b.points, b.tets, {{1, 0.49}}, law, order);
      auto x = body.rest();
      for (Vec3& p : x) p = {c * p.x - s * p.y + 5, s * p.x + c * p.y - 7, p.z + 1};
      std::vector<Vec3> g(x.size());
      total_gradient(body, x, g);
      EXPECT_NEAR(total_energy(body, x), 0, 1e-12);
      for (const Vec3 f : g) EXPECT_LT(length(f), 1e-12);
    }
  }
}

TEST(Fem, ErrorsSayWhat) {
  const auto b = block(1, 1, 1, 1.0);
  auto bad = b.tets;
  std::swap(bad[2][0], bad[2][1]);
  EXPECT_THROW(FemBody(b.points, bad, {{1, 0.3}}, ElasticLaw::linear, TetOrder::t4), Error);
  EXPECT_THROW(FemBody(b.points, b.tets, {{1, 0.5}}, ElasticLaw::linear, TetOrder::t4), Error);
  EXPECT_THROW(FemBody(b.points, b.tets, {{-1, 0.3}}, ElasticLaw::linear, TetOrder::t4), Error);
  const FemBody body(b.points, b.tets, {{1, 0.3}}, ElasticLaw::linear, TetOrder::t4);
  for (const std::vector<std::uint32_t>& fixed : {std::vector<std::uint32_t>{}, {0, 1}, {77}}) {
    EXPECT_THROW(EquilibriumSolver(body, body.rest(), fixed), Error);
  }
  const std::vector<std::uint32_t> three{0, 1, 2};
  EquilibriumSolver solver(body, body.rest(), three);
  const std::pair<std::uint32_t, Vec3> nan[] = {{5, {NAN, 0, 0}}};
  EXPECT_THROW(static_cast<void>(solver.solve(body, body.rest(), nan)), Error);
}

// Displacements that CalculiX finds for the same file.
std::vector<Vec3> calculix(const std::string& inp, std::size_t points, const std::string& name) {
  const auto folder = std::filesystem::temp_directory_path() / ("osteo_ccx_" + name);
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "job.inp") << inp;
  if (std::system(("cd " + folder.string() + " && OMP_NUM_THREADS=1 ccx job > ccx.log 2>&1").c_str()) != 0) return {};
  std::ifstream in(folder / "job.dat");
  std::vector<Vec3> u(points);
  std::string line;
  while (std::getline(in, line)) {
    std::istringstream row(line);
    std::size_t node = 0;
    Vec3 v;
    if (row >> node >> v.x >> v.y >> v.z && node >= 1 && node <= points) u[node - 1] = v;  // later steps overwrite
  }
  return u;
}

TEST(Fem, AgreesWithCalculix) {
  if (std::system("command -v ccx > /dev/null 2>&1") != 0) GTEST_SKIP() << "CalculiX (ccx) is not installed: agreement with it not tested";
  const auto b = block(6, 3, 3, 2.0, [](Vec3 p) { return !(p.x > 5 && p.y > 3 && p.z > 3); });
  struct Case {
    ElasticLaw law;
    TetOrder order;
    const char* name;
  };
  for (const Case& c : {Case{ElasticLaw::linear, TetOrder::t4, "C3D4"}, Case{ElasticLaw::linear, TetOrder::t10, "C3D10"},
                        Case{ElasticLaw::stvk, TetOrder::t4, "C3D4-nlgeom"}}) {
    std::vector<Material> materials;
    for (std::size_t t = 0; t < b.tets.size(); ++t) materials.push_back(t / 5 % 4 == 0 ? Material{0.4, 0.3} : Material{0.1, 0.45});
    const FemBody body(b.points, b.tets, materials, c.law, c.order);
    TissueLoad load;
    load.fixed = body.with_middles(where(b.points, [](Vec3 p) { return p.x < 1e-9; }));
    const auto end = where(b.points, [](Vec3 p) { return p.x > 11.99; });
    for (const std::uint32_t p : end) load.forces_n.push_back({p, Vec3{0.004, 0.01, -0.006} / static_cast<double>(end.size())});
    EquilibriumSolver solver(body, body.rest(), load.fixed);
    const Equilibrium r = solver.solve(body, body.rest(), load.forces_n);
    ASSERT_TRUE(r.converged) << r.why;
    const auto u = calculix(inp_text(body, load), body.point_count(), c.name);
    ASSERT_EQ(u.size(), body.point_count()) << "ccx failed on " << c.name;
    double off = 0, size = 0;
    for (std::size_t p = 0; p < u.size(); ++p) {
      const Vec3 own = r.points_mm[p] - body.rest()[p];
      off += dot(own - u[p], own - u[p]);
      size += dot(u[p], u[p]);
    }
    std::printf("%s: %.1e off CalculiX (relative, RMS)\n", c.name, std::sqrt(off / size));
    EXPECT_LT(std::sqrt(off / size), 1e-6) << c.name;
  }
}

}  // namespace
}  // namespace osteo
