// Finite elements against analytic answers, and against CalculiX where it is installed.
#include "osteo/simulation/tissue/fem.h"

#include "osteo/simulation/tissue/problem.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "block.h"
#include "calculix.h"
#include "derivatives.h"
#include "mapped.h"
#include "osteo/core/base/error.h"
#include "scratch.h"

namespace osteo {
namespace {

using test::block;
using test::shaken;

constexpr ElasticLaw kLaws[] = {ElasticLaw::linear, ElasticLaw::stvk, ElasticLaw::neo_hooke,
                                ElasticLaw::neo_hooke_split, ElasticLaw::corotated};
constexpr TetOrder kOrders[] = {TetOrder::t4, TetOrder::t10, TetOrder::t4_mean};

std::vector<std::uint32_t> where(const std::vector<Vec3>& points, const std::function<bool(Vec3)>& f) {
  std::vector<std::uint32_t> found;
  for (std::uint32_t p = 0; p < points.size(); ++p) {
    if (f(points[p])) found.push_back(p);
  }
  return found;
}

TEST(Fem, GradientsAndHessiansAreThoseOfTheEnergy) {
  const auto b = block(1, 1, 1, 2.0);
  for (const ElasticLaw law : kLaws) {
    for (const TetOrder order : kOrders) {
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
  const auto map = [](Vec3 p) {
    return p + Vec3{0.01 * p.x + 0.02 * p.y, -0.015 * p.y + 0.005 * p.z, 0.008 * p.z + 0.01 * p.x};
  };
  for (const ElasticLaw law : kLaws) {
    for (const TetOrder order : kOrders) {
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
      for (std::size_t p = 0; p < body.point_count(); ++p)
        EXPECT_LT(length(r.points_mm[p] - map(body.rest()[p])), 1e-12);
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
  const double t = lo,
               stress = (mu * (stretch * stretch - 1) + lambda * std::log(stretch * t * t)) / stretch;  // first Piola
  for (const TetOrder order : {TetOrder::t4, TetOrder::t10}) {
    const FemBody body(b.points, b.tets, {m}, ElasticLaw::neo_hooke, order);
    // Homogeneous: the corner points at the bottom slide in their plane; three pins suffice, so the ends are moved as
    // the answer moves them.
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

// A slender beam bent by a force at its end, against Timoshenko; t4 is far too stiff, t10 is not, and comes nearer with
// finer meshes.
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
  std::printf("cantilever, tip against Timoshenko: t4 %+.1f %% and %+.1f %% (halved), t10 %+.2f %% and %+.2f %%\n",
              100 * error[0][0], 100 * error[1][0], 100 * error[0][1], 100 * error[1][1]);
}

TEST(Fem, ARigidMotionCostsNothing) {
  const auto b = block(2, 2, 2, 1.0);
  const double c = std::cos(1.1), s = std::sin(1.1);
  for (const ElasticLaw law :
       {ElasticLaw::stvk, ElasticLaw::neo_hooke, ElasticLaw::neo_hooke_split, ElasticLaw::corotated}) {
    for (const TetOrder order : kOrders) {
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

// A bar in three planes of symmetry, pulled by a traction on its end: the stretches follow from the law alone, whatever
// the mesh. The force at a stretch of 1.5 (E 0.1 MPa, nu 0.45), by bisection of the law's own equations here.
TEST(Fem, SlidersAndTractionsGiveTheLawItself) {
  const Material m{0.1, 0.45};
  const double mu = m.shear_mpa(), lambda = m.lambda_mpa(), bulk = m.bulk_mpa(), stretch = 1.5;
  const auto b = block(2, 2, 3, 1.0);
  for (const ElasticLaw law :
       {ElasticLaw::neo_hooke, ElasticLaw::neo_hooke_split, ElasticLaw::stvk, ElasticLaw::corotated}) {
    // First Piola stresses along and across, for a lateral stretch t.
    const auto stress = [&](double t, double s) {
      const double j = s * t * t;
      if (law == ElasticLaw::neo_hooke) {
        const double l = lambda * std::log(j);
        return std::pair{(mu * (s * s - 1) + l) / s, (mu * (t * t - 1) + l) / t};
      }
      if (law == ElasticLaw::stvk) {
        const double along = (s * s - 1) / 2, across = (t * t - 1) / 2, trace = along + 2 * across;
        return std::pair{s * (lambda * trace + 2 * mu * along), t * (lambda * trace + 2 * mu * across)};
      }
      if (law == ElasticLaw::corotated) {
        const double trace = s + 2 * t - 3;
        return std::pair{2 * mu * (s - 1) + lambda * trace, 2 * mu * (t - 1) + lambda * trace};
      }
      const double shape = mu / std::cbrt(j * j), third = (s * s + 2 * t * t) / 3, volume = bulk * (j - 1) * j;
      return std::pair{(shape * (s * s - third) + volume) / s, (shape * (t * t - third) + volume) / t};
    };
    double lo = 0.5, hi = 1;
    for (int i = 0; i < 100; ++i) {
      const double t = 0.5 * (lo + hi);
      (stress(t, stretch).second > 0 ? hi : lo) = t;
    }
    const double traction = stress(lo, stretch).first;
    if (law == ElasticLaw::neo_hooke_split) {
      EXPECT_NEAR(traction, 0.03451610, 1e-8);  // as CalculiX prints it
    }
    for (const TetOrder order : kOrders) {
      const FemBody body(b.points, b.tets, {m}, law, order);
      TissueLoad load;
      for (std::uint32_t p = 0; p < b.points.size(); ++p) {
        const Vec3 q = b.points[p];
        const int held = (q.x < 1e-9 ? 1 : 0) | (q.y < 1e-9 ? 2 : 0) | (q.z < 1e-9 ? 4 : 0);
        if (held == 7) load.fixed.push_back(p);
        if (held != 0 && held != 7) load.sliders.push_back({p, static_cast<std::uint8_t>(held)});
      }
      TetMesh mesh;
      for (const Vec3& p : b.points) mesh.points_mm.push_back(to_floats(p));
      for (const auto& t : b.tets) mesh.tets.push_back(t);
      std::vector<std::uint32_t> point_of;
      const TriMesh skin = boundary_of(mesh, &point_of);
      for (const auto& t : skin.triangles) {
        const std::array<std::uint32_t, 3> face{point_of[t[0]], point_of[t[1]], point_of[t[2]]};
        if (std::min({b.points[face[0]].z, b.points[face[1]].z, b.points[face[2]].z}) > 2.9)
          load.add_on_face(face, {0, 0, traction * 0.5});
      }
      const TissueLoad all = body.on_all_points(load);
      Vec3 total{};
      for (const auto& [p, f] : all.forces_n) total += f;
      EXPECT_NEAR(total.z, 4 * traction, 1e-12);
      EquilibriumSolver solver(body, body.rest(), all);
      const Equilibrium r = solver.solve(body, body.rest(), all.forces_n, {1e-12, 100, 4});
      ASSERT_TRUE(r.converged) << r.why;
      for (std::size_t p = 0; p < body.point_count(); ++p) {
        const Vec3 rest = body.rest()[p];
        EXPECT_LT(length(r.points_mm[p] - Vec3{rest.x * lo, rest.y * lo, rest.z * stretch}), 1e-9);
      }
    }
  }
}

// Cook's membrane, plane stress (R. Cook 1974): 48 wide, its left edge 44 high and held, its right edge 16 high and
// sheared by 1; E 1, nu 1/3. The middle of the right edge rises by 23.96 (fine meshes of many authors). A thin slab in
// its plane of symmetry here.
TEST(Fem, CooksMembrane) {
  double rise[2][2];
  for (const int fine : {0, 1}) {
    const int n = fine == 0 ? 6 : 12;
    const auto m = test::mapped(n, n, 1, [](Vec3 u) {
      return Vec3{48 * u.x, 44 * u.x + (44 - 28 * u.x) * u.y, 0.5 * u.z};
    });
    for (const TetOrder order : {TetOrder::t4, TetOrder::t10}) {
      const FemBody body(m.b.points, m.b.tets, {{1, 1.0 / 3}}, ElasticLaw::linear, order);
      TissueLoad load = test::held(m, [](Vec3 u) { return (u.x == 0 ? 3 : 0) | (u.z == 0 ? 4 : 0); });
      load_faces(
          m, [](Vec3 u) { return u.x == 1; },
          [](Vec3 area) {
            return Vec3{0, length(area) / 16, 0};
          },
          load);
      const TissueLoad all = body.on_all_points(load);
      EquilibriumSolver solver(body, body.rest(), all);
      const Equilibrium r = solver.solve(body, body.rest(), all.forces_n);
      ASSERT_TRUE(r.converged) << r.why;
      for (std::size_t p = 0; p < m.from.size(); ++p) {
        if (m.from[p].x == 1 && m.from[p].y == 0.5 && m.from[p].z == 0)
          rise[fine][order == TetOrder::t10 ? 1 : 0] = r.points_mm[p].y - body.rest()[p].y;
      }
    }
  }
  std::printf("Cook's membrane, rise: t4 %.3f, %.3f (halved), t10 %.3f, %.3f; 23.96 expected\n", rise[0][0], rise[1][0],
              rise[0][1], rise[1][1]);
  EXPECT_NEAR(rise[1][1], 23.96, 0.15);
  EXPECT_LT(std::abs(rise[1][1] - 23.96), std::abs(rise[0][1] - 23.96));
  EXPECT_LT(rise[1][0], 23.5);
}

// A thick tube under pressure inside (G. Lame): u(r) = (1 + nu) p a^2 / (E (b^2 - a^2)) ((1 - 2 nu) r + b^2 / r) in
// plane strain, a quarter of it here, nearly incompressible too.
TEST(Fem, LamesTube) {
  for (const double nu : {0.3, 0.499}) {
    double error[2][2];
    for (const int fine : {0, 1}) {
      const int n = fine == 0 ? 4 : 8;
      const auto m = test::mapped(n, 2 * n, 1, [&](Vec3 u) {
        const double r = 1 + u.x, a = u.y * std::acos(-1.0) / 2;
        return Vec3{u.y == 1 ? 0 : r * std::cos(a), r * std::sin(a), 1.0 / n * u.z};
      });
      for (const TetOrder order : {TetOrder::t4, TetOrder::t10}) {
        const FemBody body(m.b.points, m.b.tets, {{1, nu}}, ElasticLaw::linear, order);
        TissueLoad load = test::held(m, [](Vec3 u) { return 4 | (u.y == 0 ? 2 : 0) | (u.y == 1 ? 1 : 0); });
        load_faces(
            m, [](Vec3 u) { return u.x == 0; }, [](Vec3 area) { return area * -0.01; }, load);
        const TissueLoad all = body.on_all_points(load);
        EquilibriumSolver solver(body, body.rest(), all);
        const Equilibrium r = solver.solve(body, body.rest(), all.forces_n);
        ASSERT_TRUE(r.converged) << r.why;
        double off = 0, size = 0;
        for (std::size_t p = 0; p < m.from.size(); ++p) {
          const Vec3 q = body.rest()[p];
          const double radius = std::hypot(q.x, q.y), u = (1 + nu) * 0.01 / 3 * ((1 - 2 * nu) * radius + 4 / radius);
          const Vec3 exact = Vec3{q.x, q.y, 0} * (u / radius), own = r.points_mm[p] - q;
          off += dot(own - exact, own - exact);
          size += u * u;
        }
        error[fine][order == TetOrder::t10 ? 1 : 0] = std::sqrt(off / size);
      }
    }
    std::printf("Lame's tube, nu %.3f, relative error: t4 %.4f, %.4f (halved), t10 %.5f, %.5f\n", nu, error[0][0],
                error[1][0], error[0][1], error[1][1]);
    EXPECT_LT(error[1][1], 0.004);
    EXPECT_LT(error[1][1], 0.35 * error[0][1]);  // flat sides of the tube: second order
    EXPECT_LT(error[1][0], error[0][0]);
    EXPECT_GT(error[1][0], 3 * error[1][1]);
  }
}

// Lame's tube again, all but incompressible: linear tetrahedra lock, with the mean over patches they do not.
TEST(Fem, MeanVolumesDoNotLock) {
  constexpr double kNu = 0.4999;
  double error[3][2];
  for (const int fine : {0, 1}) {
    const int n = fine == 0 ? 4 : 8;
    const auto m = test::mapped(n, 2 * n, 1, [&](Vec3 u) {
      const double r = 1 + u.x, a = u.y * std::acos(-1.0) / 2;
      return Vec3{u.y == 1 ? 0 : r * std::cos(a), r * std::sin(a), 1.0 / n * u.z};
    });
    for (const TetOrder order : kOrders) {
      const FemBody body(m.b.points, m.b.tets, {{1, kNu}}, ElasticLaw::linear, order);
      TissueLoad load = test::held(m, [](Vec3 u) { return 4 | (u.y == 0 ? 2 : 0) | (u.y == 1 ? 1 : 0); });
      load_faces(
          m, [](Vec3 u) { return u.x == 0; }, [](Vec3 area) { return area * -0.01; }, load);
      const TissueLoad all = body.on_all_points(load);
      const Equilibrium r = EquilibriumSolver(body, body.rest(), all).solve(body, body.rest(), all.forces_n);
      ASSERT_TRUE(r.converged) << r.why;
      double off = 0, size = 0;
      for (std::size_t p = 0; p < m.from.size(); ++p) {
        const Vec3 q = body.rest()[p];
        const double radius = std::hypot(q.x, q.y), u = (1 + kNu) * 0.01 / 3 * ((1 - 2 * kNu) * radius + 4 / radius);
        const Vec3 own = r.points_mm[p] - q, wrong = Vec3{q.x, q.y, 0} * (u / radius) - own;
        off += dot(wrong, wrong);
        size += u * u;
      }
      error[static_cast<int>(order)][fine] = std::sqrt(off / size);
    }
  }
  std::printf("Lame's tube, nu 0.4999, relative error: t4 %.4f, %.4f (halved), t10 %.5f, %.5f, t4_mean %.5f, %.5f\n",
              error[0][0], error[0][1], error[1][0], error[1][1], error[2][0], error[2][1]);
  EXPECT_LT(error[2][0], 0.15 * error[0][0]);
  EXPECT_LT(error[2][1], 0.25 * error[0][1]);
  EXPECT_LT(error[2][1], 0.3 * error[2][0]);  // second order
}

// Patches are a partition: each tetrahedron in one, of one material, joined by faces, and few are small.
TEST(Fem, PatchesOfMeanVolumes) {
  const auto b = block(5, 4, 3, 1.0, [](Vec3 p) { return !(p.x > 2 && p.y > 2 && p.z > 1); });
  std::vector<Material> materials;
  for (const auto& t : b.tets) materials.push_back({b.points[t[0]].z < 1.5 ? 1.0 : 2.0, 0.499});
  const FemBody body(b.points, b.tets, materials, ElasticLaw::neo_hooke, TetOrder::t4_mean);
  std::vector<int> seen(b.tets.size());
  std::size_t small = 0;
  for (std::size_t p = 0; p < body.patch_count(); ++p) {
    const auto& patch = body.patch(p);
    small += patch.size() < 4 ? 1 : 0;
    std::vector<std::uint32_t> joined{patch.front()};
    for (std::size_t k = 0; k < joined.size(); ++k) {
      for (const std::uint32_t other : patch) {
        int common = 0;
        for (const std::uint32_t a : b.tets[joined[k]])
          common += static_cast<int>(std::count(b.tets[other].begin(), b.tets[other].end(), a));
        if (common == 3 && std::find(joined.begin(), joined.end(), other) == joined.end()) joined.push_back(other);
      }
    }
    EXPECT_EQ(joined.size(), patch.size());
    for (const std::uint32_t t : patch) {
      ++seen[t];
      EXPECT_EQ(materials[t].young_mpa, materials[patch.front()].young_mpa);
    }
    EXPECT_LE(body.nodes(b.tets.size() + p).size(), Energy::kMaxNodes);
  }
  EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), static_cast<std::ptrdiff_t>(b.tets.size()));
  EXPECT_LE(small * 20, body.patch_count());
  EXPECT_LT(body.patch_count() * 6, b.tets.size());
}

// One tetrahedron; a layer of slivers a thousandth as high as wide: at rest, and forces sum to zero.
TEST(Fem, MeanVolumesOfHardMeshes) {
  const FemBody one(std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                    std::vector<std::array<std::uint32_t, 4>>{{0, 1, 2, 3}}, {{1, 0.4999}}, ElasticLaw::neo_hooke,
                    TetOrder::t4_mean);
  const FemBody alone(std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                      std::vector<std::array<std::uint32_t, 4>>{{0, 1, 2, 3}}, {{1, 0.4999}}, ElasticLaw::neo_hooke,
                      TetOrder::t4);
  const auto moved = shaken(one.rest(), 0.1, 11);
  EXPECT_NEAR(total_energy(one, moved), total_energy(alone, moved), 1e-12 * total_energy(alone, moved));
  const auto m = test::mapped(6, 6, 1, [](Vec3 u) { return Vec3{u.x, u.y, 0.001 * u.z}; });
  for (const ElasticLaw law : kLaws) {
    const FemBody body(m.b.points, m.b.tets, {{1, 0.4999}}, law, TetOrder::t4_mean);
    TissueLoad load =
        test::held(m, [](Vec3 u) { return (u.x == 0 ? 1 : 0) | (u.y == 0 ? 2 : 0) | (u.z == 0 ? 4 : 0); });
    load_faces(
        m, [](Vec3 u) { return u.x == 1; }, [](Vec3 area) { return area * 0.05; }, load);
    const TissueLoad all = body.on_all_points(load);
    const Equilibrium r =
        EquilibriumSolver(body, body.rest(), all).solve(body, body.rest(), all.forces_n, {1e-10, 100, 2});
    EXPECT_TRUE(r.converged) << r.why;
    EXPECT_EQ(body.inverted(r.points_mm), 0u);
    std::vector<Vec3> g(body.point_count());
    total_gradient(body, r.points_mm, g);
    Vec3 sum{};
    for (const Vec3 f : g) sum += f;
    EXPECT_LT(length(sum), 1e-12);
  }
}

std::vector<Vec3> mapped_by(const std::vector<Vec3>& x, const double (&f)[3][3]) {
  std::vector<Vec3> y = x;
  for (std::size_t p = 0; p < x.size(); ++p) {
    for (std::size_t i = 0; i < 3; ++i) y[p][i] = f[i][0] * x[p].x + f[i][1] * x[p].y + f[i][2] * x[p].z;
  }
  return y;
}

// The corotated law is Hooke's for small strains, to third order of the energy, however the body has turned.
TEST(Fem, CorotatedIsLinearForSmallStrains) {
  const auto b = block(2, 2, 2, 1.0);
  const FemBody corotated(b.points, b.tets, {{1, 0.4}}, ElasticLaw::corotated, TetOrder::t4),
      linear(b.points, b.tets, {{1, 0.4}}, ElasticLaw::linear, TetOrder::t4);
  const double c = std::cos(2.2), s = std::sin(2.2);
  double off[2];
  for (const int k : {0, 1}) {
    const double e = k == 0 ? 1e-3 : 5e-4;
    // Symmetric, so that the linear law sees no rotation.
    const double strain[3][3] = {
        {1 + e, 0.3 * e, 0.2 * e}, {0.3 * e, 1 - 0.7 * e, -0.4 * e}, {0.2 * e, -0.4 * e, 1 + 0.5 * e}};
    const double turn[3][3] = {{c, -s, 0}, {s, c, 0}, {0, 0, 1}};
    const auto strained = mapped_by(b.points, strain);
    const double straight = total_energy(linear, strained);
    off[k] = std::abs(total_energy(corotated, mapped_by(strained, turn)) / straight - 1);
    EXPECT_LT(off[k], 1e-9);  // of a symmetric strain they agree to rounding
    const FemBody stvk(b.points, b.tets, {{1, 0.4}}, ElasticLaw::stvk, TetOrder::t4);
    EXPECT_NEAR(total_energy(stvk, strained) / straight, 1, 3 * e);
  }
}

// Inside out it has an energy and pushes back: one tetrahedron mirrored, and a body whose points are shaken through
// each other, come to rest as they were.
TEST(Fem, CorotatedComesBackFromInsideOut) {
  const std::vector<std::array<std::uint32_t, 4>> only{{0, 1, 2, 3}};
  const FemBody one(std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, only, {{1, 0.4}},
                    ElasticLaw::corotated, TetOrder::t4);
  const std::vector<std::uint32_t> base{0, 1, 2};
  auto mirrored = one.rest();
  mirrored[3] = {0.1, 0.05, -0.8};
  EXPECT_EQ(one.inverted(mirrored), 1u);
  const Equilibrium back = EquilibriumSolver(one, one.rest(), base).solve(one, mirrored, {});
  ASSERT_TRUE(back.converged) << back.why;
  EXPECT_LT(length(back.points_mm[3] - one.rest()[3]), 1e-8);
  const auto b = block(2, 2, 2, 1.0);
  for (const TetOrder order : kOrders) {
    const FemBody body(b.points, b.tets, {{1, 0.4}}, ElasticLaw::corotated, order);
    // Exact derivatives where it is inverted too, off the places where the rotation jumps.
    const double inverted[3][3] = {{1.1, 0.1, 0}, {0, 0.9, 0.2}, {0.1, 0, -0.4}};
    test::expect_exact_derivatives(body, shaken(mapped_by(body.rest(), inverted), 0.02, 5));
    const auto fixed = body.with_middles(where(b.points, [](Vec3 p) { return p.z < 0.1; }));
    std::vector<Vec3> start = shaken(body.rest(), 0.7, 9);
    for (const std::uint32_t p : fixed) start[p] = body.rest()[p];
    EXPECT_GT(body.inverted(start), b.tets.size() / 10);
    const Equilibrium r = EquilibriumSolver(body, body.rest(), fixed).solve(body, start, {}, {1e-10, 300, 1});
    ASSERT_TRUE(r.converged) << r.why;
    double far = 0;
    for (std::size_t p = 0; p < body.point_count(); ++p) far = std::max(far, length(r.points_mm[p] - body.rest()[p]));
    EXPECT_LT(far, 1e-6) << static_cast<int>(order) << ", inverted at first " << body.inverted(start);
  }
}

// Cook's membrane in plane strain, all but incompressible: the middle of its right edge rises by 16.45 (16.442 as many
// authors print it; quadratic triangles with linear pressures, 64 along, extrapolated: 16.452).
TEST(Fem, CooksMembraneNearlyIncompressible) {
  double rise[3][2];
  for (const int fine : {0, 1}) {
    const int n = fine == 0 ? 8 : 16;
    const auto m = test::mapped(n, n, 1, [n](Vec3 u) {
      return Vec3{48 * u.x, 44 * u.x + (44 - 28 * u.x) * u.y, 48.0 / n * u.z};
    });
    for (const TetOrder order : kOrders) {
      const FemBody body(m.b.points, m.b.tets, {{1.12499998125, 0.499999975}}, ElasticLaw::linear, order);
      TissueLoad load = test::held(m, [](Vec3 u) { return (u.x == 0 ? 3 : 0) | 4; });
      load_faces(
          m, [](Vec3 u) { return u.x == 1; },
          [](Vec3 area) {
            return Vec3{0, length(area) / 16, 0};
          },
          load);
      const TissueLoad all = body.on_all_points(load);
      const Equilibrium r = EquilibriumSolver(body, body.rest(), all).solve(body, body.rest(), all.forces_n);
      ASSERT_TRUE(r.converged) << r.why;
      for (std::size_t p = 0; p < m.from.size(); ++p) {
        if (m.from[p].x == 1 && m.from[p].y == 0.5 && m.from[p].z == 0)
          rise[static_cast<int>(order)][fine] = r.points_mm[p].y - body.rest()[p].y;
      }
    }
  }
  std::printf(
      "Cook's membrane, nu 0.499999975, rise: t4 %.3f, %.3f (halved), t10 %.3f, %.3f, t4_mean %.3f, %.3f; 16.45 "
      "expected\n",
      rise[0][0], rise[0][1], rise[1][0], rise[1][1], rise[2][0], rise[2][1]);
  EXPECT_LT(rise[0][1], 0.7 * 16.45);
  EXPECT_NEAR(rise[2][1], 16.45, 0.05 * 16.45);
  EXPECT_LT(std::abs(rise[2][1] - 16.45), std::abs(rise[2][0] - 16.45));
}

TEST(Fem, AgreesWithCalculix) {
  if (!test::calculix_is_here()) GTEST_SKIP() << "CalculiX (ccx) is not installed: agreement with it not tested";
  const auto b = block(6, 3, 3, 2.0, [](Vec3 p) { return !(p.x > 5 && p.y > 3 && p.z > 3); });
  struct Case {
    ElasticLaw law;
    TetOrder order;
    const char* name;
  };
  for (const Case& c :
       {Case{ElasticLaw::linear, TetOrder::t4, "C3D4"}, Case{ElasticLaw::linear, TetOrder::t10, "C3D10"},
        Case{ElasticLaw::stvk, TetOrder::t4, "C3D4-nlgeom"},
        Case{ElasticLaw::neo_hooke_split, TetOrder::t10, "C3D10-neo-hooke"}}) {
    std::vector<Material> materials;
    for (std::size_t t = 0; t < b.tets.size(); ++t)
      materials.push_back(t / 5 % 4 == 0 ? Material{0.4, 0.3} : Material{0.1, 0.45});
    const FemBody body(b.points, b.tets, materials, c.law, c.order);
    TissueLoad load;
    load.fixed = where(b.points, [](Vec3 p) { return p.x < 1e-9 && p.y < 2.1; });
    for (const std::uint32_t p : where(b.points, [](Vec3 q) { return q.x < 1e-9 && q.y > 2.1; }))
      load.sliders.push_back({p, 5});
    const auto end = where(b.points, [](Vec3 p) { return p.x > 11.99; });
    for (const std::uint32_t p : end)
      load.forces_n.push_back({p, Vec3{0.004, 0.01, -0.006} / static_cast<double>(end.size())});
    load = body.on_all_points(load);
    EquilibriumSolver solver(body, body.rest(), load);
    const Equilibrium r = solver.solve(body, body.rest(), load.forces_n);
    ASSERT_TRUE(r.converged) << r.why;
    const auto u = test::by_calculix(inp_text(body, load), body.point_count());
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
