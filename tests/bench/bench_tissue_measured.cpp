// Constants of the fast model from measured surfaces: noise and view against error.
#include <array>
#include <cmath>
#include <cstdio>
#include <string>

#include "bench.h"
#include "bench_tissue.h"
#include "scanned.h"

namespace osteo::bench {
namespace {

constexpr double kEdge = 200;

// The cube of the thesis, n voxels along: 1000 kPa below, 50 kPa above.
Body cube(int n) {
  Body body{test::block(n, n, n, kEdge / n), {}};
  for (std::uint32_t p = 0; p < body.b.points.size(); ++p) {
    if (body.b.points[p].z < 1e-9) body.fixed.push_back(p);
  }
  return body;
}

struct Push {
  Vec3 lo, hi, total_n;
};

// Forces spread over parts of the surface, so that they are the same on every mesh.
TissueLoad pushed(const Body& body, const std::vector<Push>& pushes) {
  TissueLoad load;
  load.fixed = body.fixed;
  TetMesh mesh;
  for (const Vec3& p : body.b.points) mesh.points_mm.push_back(to_floats(p));
  for (const auto& t : body.b.tets) mesh.tets.push_back(t);
  std::vector<std::uint32_t> of;
  const TriMesh skin = boundary_of(mesh, &of);
  for (const Push& push : pushes) {
    std::vector<std::pair<std::array<std::uint32_t, 3>, double>> faces;
    double all = 0;
    for (const auto& t : skin.triangles) {
      const std::array<std::uint32_t, 3> f{of[t[0]], of[t[1]], of[t[2]]};
      bool in = true;
      for (const std::uint32_t p : f)
        for (std::size_t a = 0; a < 3; ++a)
          in = in && body.b.points[p][a] > push.lo[a] - 1e-6 && body.b.points[p][a] < push.hi[a] + 1e-6;
      if (!in) continue;
      const Vec3 a = body.b.points[f[0]];
      faces.push_back({f, length(cross(body.b.points[f[1]] - a, body.b.points[f[2]] - a)) / 2});
      all += faces.back().second;
    }
    for (const auto& [f, area] : faces) load.add_on_face(f, push.total_n * (area / all));
  }
  return load;
}

// The finer mesh's movement at the coarser one's points: linear between the corners of its voxels.
std::vector<Vec3> carried(const Body& fine, std::span<const Vec3> x, int n, const Body& coarse) {
  const double h = kEdge / n;
  std::map<std::array<int, 3>, std::uint32_t> at;
  for (std::uint32_t p = 0; p < fine.b.points.size(); ++p) {
    const Vec3 q = fine.b.points[p] / h;
    at[{static_cast<int>(std::lround(q.x)), static_cast<int>(std::lround(q.y)), static_cast<int>(std::lround(q.z))}] =
        p;
  }
  std::vector<Vec3> moved;
  for (const Vec3& p : coarse.b.points) {
    int cell[3];
    double t[3];
    for (std::size_t a = 0; a < 3; ++a) {
      cell[a] = std::min(n - 1, static_cast<int>(p[a] / h + 1e-9));
      t[a] = p[a] / h - cell[a];
    }
    Vec3 by{};
    for (int c = 0; c < 8; ++c) {
      double w = 1;
      std::array<int, 3> corner{};
      for (std::size_t a = 0; a < 3; ++a) {
        const int up = c >> a & 1;
        w *= up != 0 ? t[a] : 1 - t[a];
        corner[a] = std::min(n, cell[a] + up);
      }
      const std::uint32_t q = at.at(corner);
      by += (x[q] - fine.b.points[q]) * w;
    }
    moved.push_back(p + by);
  }
  return moved;
}

double rms_move(const Body& body, std::span<const Vec3> x) {
  double sum = 0;
  for (std::size_t p = 0; p < x.size(); ++p) sum += dot(x[p] - body.b.points[p], x[p] - body.b.points[p]);
  return std::sqrt(sum / static_cast<double>(x.size()));
}

}  // namespace

void tissue_measured(const Context& context) {
  constexpr int kFine = 12, kCoarse = 8;
  const Body fine = cube(kFine), body = cube(kCoarse);
  std::vector<Material> materials;
  for (const auto& t : fine.b.tets) {
    double z = 0;
    for (const std::uint32_t p : t) z += fine.b.points[p].z / 4;
    materials.push_back({z < kEdge / 2 ? 1.0 : 0.05, 0.499});
  }
  // Pressed on top, where the soft half gives way, and pushed at the stiff half; two more; and one that is never
  // fitted.
  const std::vector<std::vector<Push>> pushes{
      {{{50, 50, 200}, {150, 150, 200}, {40, 0, -60}}, {{200, 50, 50}, {200, 150, 100}, {300, 0, 0}}},
      {{{0, 150, 200}, {50, 200, 200}, {-15, -15, -10}}, {{50, 0, 50}, {150, 0, 100}, {0, -300, 50}}},
      {{{150, 0, 200}, {200, 50, 200}, {10, 20, -10}}, {{0, 50, 50}, {0, 150, 100}, {-200, 150, 0}}},
      {{{0, 0, 200}, {50, 50, 200}, {-10, 15, -10}}}};
  const FemBody fem(fine.b.points, fine.b.tets, materials, ElasticLaw::neo_hooke, TetOrder::t10);
  std::vector<std::vector<Vec3>> truth;
  std::vector<TissueLoad> loads;
  const double began = now_s();
  {
    const TissueLoad held = fem.on_all_points(pushed(fine, pushes[0]));
    EquilibriumSolver solver(fem, fem.rest(), held);
    for (const auto& p : pushes) {
      const TissueLoad all = fem.on_all_points(pushed(fine, p));
      const Equilibrium r = solver.solve(fem, fem.rest(), all.forces_n, {1e-9, 60, 1});
      if (!r.converged) std::printf("not at rest: %s\n", r.why.c_str());
      truth.emplace_back(r.points_mm.begin(), r.points_mm.begin() + static_cast<std::ptrdiff_t>(fine.b.points.size()));
      loads.push_back(pushed(body, p));
    }
  }
  std::vector<std::vector<Vec3>> field;
  for (const auto& x : truth) field.push_back(carried(fine, x, kFine, body));
  const Material guess{0.2, 0.499};
  const TissueModel uniform = TissueModel::of_voxels(body.b.points, body.b.tets, std::span(&guess, 1));
  const BodySurface surface = boundary_surface(uniform);
  std::vector<int> group;
  for (const auto& c : uniform.constraints()) {
    const double a = uniform.rest()[c.node[0]].z, b = uniform.rest()[c.node[1]].z;
    group.push_back(c.nodes != 2 ? -1 : std::max(a, b) < 0.49 * kEdge ? 0 : std::min(a, b) > 0.51 * kEdge ? 1 : -1);
  }
  std::printf(
      "### From measured surfaces: the cube, 1000 kPa below, 50 kPa above, guessed 200, not told of halves\n\nTruth: "
      "t10, %zu tetrahedra, "
      "%.0f s; "
      "RMS movement %.2f, %.2f, %.2f, %.2f mm. Noise in %% of the RMS movement of each load.\n\n",
      fine.b.tets.size(), now_s() - began, rms_move(fine, truth[0]), rms_move(fine, truth[1]), rms_move(fine, truth[2]),
      rms_move(fine, truth[3]));
  std::printf(
      "| seen | loads | map | noise %% | stray %% | noise found, mm (put in) | rejected %% | stiff half, kPa (95 %%) | "
      "soft half, kPa (95 "
      "%%) | contrast (20) "
      "| NRMS | NRMS on a load not seen | settled | solves | s (told) "
      "|\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  const Vec3 from = normalized({1, -1.2, 0.8});
  struct Row {
    const char* seen;
    std::size_t loads;
    std::array<int, 3> grid;
    double noise, stray;
  };
  std::vector<Row> rows;
  for (const auto& [seen, many] : {std::pair{"all", std::size_t{1}},
                                   {"all", std::size_t{3}},
                                   {"half", std::size_t{3}},
                                   {"markers", std::size_t{1}},
                                   {"markers", std::size_t{3}}}) {
    for (const double noise : {0.0, 1.0, 2.0, 5.0}) rows.push_back({seen, many, {3, 3, 9}, noise, 0});
    if (std::string(seen) != "markers") rows.push_back({seen, many, {3, 3, 9}, 2, 10});
  }
  rows.push_back({"all", 3, {1, 1, 9}, 2, 10});
  rows.push_back({"half", 3, {1, 1, 9}, 2, 10});
  rows.push_back({"every point", 1, {3, 3, 9}, 0, 0});
  rows.push_back({"every point", 3, {3, 3, 9}, 0, 0});
  for (const Row& row : rows) {
    TissueModel model = uniform;
    MeasuredOptions o;
    o.calibrate.grid = row.grid;
    o.calibrate.pull = 0.01;
    o.group_of = group;
    MeasuredCalibration c;
    const std::string seen = row.seen;
    std::vector<double> noise;
    if (seen == "every point") {
      std::vector<CalibrationCase> cases;
      for (std::size_t n = 0; n < row.loads; ++n) cases.push_back({loads[n], field[n]});
      const Calibration all = calibrate(model, cases, o.calibrate, context);
      for (int g = 0; g < 2; ++g) {
        double sum = 0, count = 0;
        for (std::size_t k = 0; k < group.size(); ++k) {
          if (group[k] != g) continue;
          sum += std::log(model.constraints()[k].stiffness / model.base_stiffness(k));
          ++count;
        }
        c.groups.push_back({sum / count, 0});
      }
      c.fit.solves = all.solves;
      c.fit.seconds = all.seconds;
      c.views.resize(1);
      noise.push_back(0);
    } else {
      std::vector<MeasuredCase> cases;
      for (std::size_t n = 0; n < row.loads; ++n) {
        noise.push_back(row.noise / 100 * rms_move(fine, truth[n]));
        const auto seed = static_cast<unsigned>(n + 1);
        if (seen == "markers") {
          cases.push_back({loads[n], {test::marked("markers", fine.b, truth[n], 9, noise[n], seed)}});
          continue;
        }
        test::Scan scan{2000, noise[n], row.stray / 100, [](Vec3) { return true; }, seed};
        if (seen == "half") scan.sees = [&](Vec3 out) { return dot(out, from) > 0; };
        cases.push_back({loads[n], {test::scanned("cloud", fine.b, truth[n], scan)}});
      }
      c = calibrate_measured(model, surface, cases, o, context);
    }
    const auto kpa = [&](std::size_t g, double deviations) {
      return 1000 * guess.young_mpa * std::exp(c.groups[g].log + deviations * c.groups[g].deviation);
    };
    double settled = 0, counted = 0;
    for (const double s : c.settled) {
      settled += s;
      counted += 1;
    }
    const MeasuredView& v = c.views[0];
    std::printf("| %s | %zu | %d x %d x %d | %.0f | %.0f | ", row.seen, row.loads, row.grid[0], row.grid[1],
                row.grid[2], row.noise, row.stray);
    if (v.drawn > 0) {
      std::printf("%.2f (%.2f) | %.1f | %.0f (%.0f to %.0f) | %.0f (%.0f to %.0f)", v.noise_mm, noise[0],
                  100.0 * static_cast<double>(v.rejected) / static_cast<double>(v.drawn), kpa(0, 0), kpa(0, -1.96),
                  kpa(0, 1.96), kpa(1, 0), kpa(1, -1.96), kpa(1, 1.96));
    } else {
      std::printf("| | %.0f | %.0f", kpa(0, 0), kpa(1, 0));
    }
    std::printf(" | %.1f | %.3f | %.3f | %.2f | %d | %.0f (%.0f) |\n", kpa(0, 0) / kpa(1, 0),
                nrms_of(model, body, loads[0], field[0]), nrms_of(model, body, loads[3], field[3]),
                counted > 0 ? settled / counted : 0, c.fit.solves, c.fit.seconds, c.estimate_s);
    std::fflush(stdout);
  }
  std::printf("\n");
}

}  // namespace osteo::bench
