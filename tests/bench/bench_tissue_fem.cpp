// Finite elements against analytic answers: what they are off by, how fast that falls, what it costs.
#include <algorithm>
#include <cstdio>
#include <functional>
#include <numbers>
#include <string>

#include "bench_tissue.h"
#include "mapped.h"

namespace osteo::bench {
namespace {

struct Point {
  double error = 0, seconds = 0;
};

// Errors of both orders at each refinement, with the order between each and the one before.
void table(const char* title, const char* what, const std::vector<int>& fine,
           const std::function<Point(int, TetOrder)>& solve) {
  std::printf(
      "### Finite elements: %s\n\n%s\n\n| 1/h | t4 | order | s | t10 | order | s | t4_mean | order | s "
      "|\n|---|---|---|---|---|---|---|---|---|---|\n",
      title, what);
  constexpr TetOrder kOrders[] = {TetOrder::t4, TetOrder::t10, TetOrder::t4_mean};
  Point last[3];
  for (std::size_t k = 0; k < fine.size(); ++k) {
    std::printf("| %d |", fine[k]);
    for (int o = 0; o < 3; ++o) {
      const Point p = solve(fine[k], kOrders[o]);
      const double order =
          k > 0 ? std::log(last[o].error / p.error) / std::log(static_cast<double>(fine[k]) / fine[k - 1]) : 0;
      char text[16] = "";
      if (k > 0) std::snprintf(text, sizeof text, "%.1f", order);
      std::printf(" %.5f | %s | %.2f |", p.error, text, p.seconds);
      last[o] = p;
    }
    std::printf("\n");
    std::fflush(stdout);
  }
  std::printf("\n");
}

struct Solved {
  Equilibrium r;
  double seconds;
};
Solved solve(const FemBody& body, const TissueLoad& load) {
  const double begin = now_s();
  const TissueLoad all = body.on_all_points(load);
  EquilibriumSolver solver(body, body.rest(), all);
  Solved s{solver.solve(body, body.rest(), all.forces_n), 0};
  s.seconds = now_s() - begin;
  return s;
}

// A beam 10 x 1 x 1 bent at its end by a shear; its energy against what t10 tends to (Aitken's extrapolation of its
// first three).
void beam() {
  const auto energy = [](int n, TetOrder order) {
    const auto m = test::mapped(10 * n, n, n, [](Vec3 u) { return Vec3{10 * u.x, u.y, u.z}; });
    const FemBody body(m.b.points, m.b.tets, {{100, 0.3}}, ElasticLaw::linear, order);
    TissueLoad load = test::held(m, [](Vec3 u) { return u.x == 0 ? 7 : 0; });
    test::load_faces(
        m, [](Vec3 u) { return u.x == 1; },
        [](Vec3 area) {
          return Vec3{0, 0, 0.01 * length(area)};
        },
        load);
    const Solved s = solve(body, load);
    return std::pair{s.r.energy_mj, s.seconds};
  };
  const double a = energy(1, TetOrder::t10).first, b = energy(2, TetOrder::t10).first,
               c = energy(4, TetOrder::t10).first;
  const double exact = c - (c - b) * (c - b) / (c - 2 * b + a);
  table("a bent beam", "10 x 1 x 1, nu 0.3, sheared at its end: error of the energy.", {1, 2, 4},
        [&](int n, TetOrder order) {
          const auto [e, s] = energy(n, order);
          return Point{std::abs(e / exact - 1), s};
        });
}

// Plane strain and all but incompressible. What it rises by: 16.442 as many authors print it; quadratic triangles with
// linear pressures, 64 along, extrapolated: 16.452.
void cook_incompressible() {
  constexpr double kRise = 16.45;
  16.442;  // many authors, nu 0.499999975 (K. Nakshatrala, A. Masud, K. Hjelmstad 2008 among them), corner of the top
  table("Cook's membrane, nearly incompressible",
        "Plane strain, E 1.12499998125, nu 0.499999975: rise of the middle of the loaded edge against 16.45 (h: of its "
        "width of 48).",
        {4, 8, 16, 32}, [](int n, TetOrder order) {
          const auto m = test::mapped(n, n, 1, [n](Vec3 u) {
            return Vec3{48 * u.x, 44 * u.x + (44 - 28 * u.x) * u.y, 48.0 / n * u.z};
          });
          const FemBody body(m.b.points, m.b.tets, {{1.12499998125, 0.499999975}}, ElasticLaw::linear, order);
          TissueLoad load = test::held(m, [](Vec3 u) { return (u.x == 0 ? 3 : 0) | 4; });
          test::load_faces(
              m, [](Vec3 u) { return u.x == 1; },
              [](Vec3 area) {
                return Vec3{0, length(area) / 16, 0};
              },
              load);
          const Solved s = solve(body, load);
          double rise = 0;
          for (std::size_t p = 0; p < m.from.size(); ++p) {
            if (m.from[p].x == 1 && m.from[p].y == 0.5 && m.from[p].z == 0)
              rise = s.r.points_mm[p].y - body.rest()[p].y;
          }
          return Point{std::abs(rise / kRise - 1), s.seconds};
        });
}

void cook() {
  table("Cook's membrane",
        "Plane stress, nu 1/3: rise of the middle of the loaded edge against 23.965 (h: of its width of 48).",
        {4, 8, 16}, [](int n, TetOrder order) {
          const auto m = test::mapped(n, n, 1, [](Vec3 u) {
            return Vec3{48 * u.x, 44 * u.x + (44 - 28 * u.x) * u.y, 0.5 * u.z};
          });
          const FemBody body(m.b.points, m.b.tets, {{1, 1.0 / 3}}, ElasticLaw::linear, order);
          TissueLoad load = test::held(m, [](Vec3 u) { return (u.x == 0 ? 3 : 0) | (u.z == 0 ? 4 : 0); });
          test::load_faces(
              m, [](Vec3 u) { return u.x == 1; },
              [](Vec3 area) {
                return Vec3{0, length(area) / 16, 0};
              },
              load);
          const Solved s = solve(body, load);
          double rise = 0;
          for (std::size_t p = 0; p < m.from.size(); ++p) {
            if (m.from[p].x == 1 && m.from[p].y == 0.5 && m.from[p].z == 0)
              rise = s.r.points_mm[p].y - body.rest()[p].y;
          }
          return Point{std::abs(rise / 23.965 - 1), s.seconds};
        });
}

void lame(double nu, const char* title) {
  table(
      title,
      "A quarter, inner radius 1, outer 2, plane strain: RMS error of the displacement over its RMS (h: of the wall).",
      {2, 4, 8, 16}, [nu](int n, TetOrder order) {
        const auto m = test::mapped(n, 2 * n, 1, [&](Vec3 u) {
          const double r = 1 + u.x, a = u.y * std::numbers::pi / 2;
          return Vec3{u.y == 1 ? 0 : r * std::cos(a), r * std::sin(a), 1.0 / n * u.z};
        });
        const FemBody body(m.b.points, m.b.tets, {{1, nu}}, ElasticLaw::linear, order);
        TissueLoad load = test::held(m, [](Vec3 u) { return 4 | (u.y == 0 ? 2 : 0) | (u.y == 1 ? 1 : 0); });
        test::load_faces(
            m, [](Vec3 u) { return u.x == 0; }, [](Vec3 area) { return area * -0.01; }, load);
        const Solved s = solve(body, load);
        double off = 0, size = 0;
        for (std::size_t p = 0; p < m.from.size(); ++p) {
          const Vec3 q = body.rest()[p];
          const double radius = std::hypot(q.x, q.y), u = (1 + nu) * 0.01 / 3 * ((1 - 2 * nu) * radius + 4 / radius);
          const Vec3 exact = Vec3{q.x, q.y, 0} * (u / radius), own = s.r.points_mm[p] - q;
          off += dot(own - exact, own - exact);
          size += u * u;
        }
        return Point{std::sqrt(off / size), s.seconds};
      });
}

}  // namespace

void tissue_elements() {
  beam();
  cook();
  lame(0.3, "Lame's tube, nu 0.3");
  lame(0.499, "Lame's tube, nu 0.499");
  lame(0.4999, "Lame's tube, nu 0.4999");
  cook_incompressible();
}

}  // namespace osteo::bench
