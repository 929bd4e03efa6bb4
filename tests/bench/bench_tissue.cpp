// Tissue: the fast model against finite elements, calibration against black-box searches.
#include <Eigen/Dense>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <random>

#include "bench.h"
#include "bench_tissue.h"

namespace osteo {

using namespace bench;

namespace {

// A gear 2 m wide and 3/8 m thick, with a hole; voxels of 2 m / n.
test::Block gear(int n) {
  const double h = 2000.0 / n;
  return test::block(n, n, std::max(2, static_cast<int>(std::lround(375 / h))), h, [](Vec3 p) {
    const double x = p.x - 1000, y = p.y - 1000, r = std::hypot(x, y), a = std::atan2(y, x);
    return r > 250 && r < (std::cos(10 * a) > 0 ? 1000 : 780);
  });
}

// --- black boxes ---------------------------------------------------------------------------------------------------

using Objective = std::function<double(const Eigen::VectorXd&)>;
struct Search {
  int solves = 0;
  double best = 1e300, seconds = 0;
  int solves_to_goal = 0;  // to within 1 % of the goal; 0: never
};

// (mu/mu_w, lambda)-CMA-ES (N. Hansen, The CMA Evolution Strategy: A Tutorial, 2016).
Search cma_es(const Objective& f, const Eigen::VectorXd& start, double sigma, int most, double goal) {
  Search s;
  const double begin = now_s();
  const int n = static_cast<int>(start.size()), lambda = 4 + static_cast<int>(3 * std::log(n)), mu = lambda / 2;
  Eigen::VectorXd w(mu);
  for (int i = 0; i < mu; ++i) w[i] = std::log(mu + 0.5) - std::log(i + 1);
  w /= w.sum();
  const double mueff = 1 / w.squaredNorm(), cc = (4 + mueff / n) / (n + 4 + 2 * mueff / n),
               cs = (mueff + 2) / (n + mueff + 5), c1 = 2 / ((n + 1.3) * (n + 1.3) + mueff),
               cmu = std::min(1 - c1, 2 * (mueff - 2 + 1 / mueff) / ((n + 2) * (n + 2) + mueff)),
               damps = 1 + 2 * std::max(0.0, std::sqrt((mueff - 1) / (n + 1)) - 1) + cs,
               chi = std::sqrt(n) * (1 - 1.0 / (4 * n) + 1.0 / (21 * n * n));
  Eigen::VectorXd mean = start, ps = Eigen::VectorXd::Zero(n), pc = ps;
  Eigen::MatrixXd c = Eigen::MatrixXd::Identity(n, n);
  std::mt19937 random(1);
  std::normal_distribution<double> u;
  for (int generation = 0; s.solves < most && sigma > 1e-6; ++generation) {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(c);
    const Eigen::VectorXd d = eigen.eigenvalues().cwiseMax(1e-20).cwiseSqrt();
    std::vector<std::pair<double, Eigen::VectorXd>> tried;
    for (int k = 0; k < lambda; ++k) {
      Eigen::VectorXd z(n);
      for (int i = 0; i < n; ++i) z[i] = u(random);
      const Eigen::VectorXd y = eigen.eigenvectors() * d.asDiagonal() * z;
      const double value = f(mean + sigma * y);
      ++s.solves;
      s.best = std::min(s.best, value);
      if (s.solves_to_goal == 0 && s.best < 1.01 * goal) s.solves_to_goal = s.solves;
      tried.push_back({value, y});
    }
    std::sort(tried.begin(), tried.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    Eigen::VectorXd y = Eigen::VectorXd::Zero(n);
    for (int i = 0; i < mu; ++i) y += w[i] * tried[static_cast<std::size_t>(i)].second;
    mean += sigma * y;
    const Eigen::VectorXd whitened =
        eigen.eigenvectors() * d.cwiseInverse().asDiagonal() * eigen.eigenvectors().transpose() * y;
    ps = (1 - cs) * ps + std::sqrt(cs * (2 - cs) * mueff) * whitened;
    const bool h = ps.norm() / std::sqrt(1 - std::pow(1 - cs, 2.0 * (generation + 1))) < (1.4 + 2.0 / (n + 1)) * chi;
    pc = (1 - cc) * pc + (h ? std::sqrt(cc * (2 - cc) * mueff) : 0) * y;
    c = (1 - c1 - cmu) * c + c1 * (pc * pc.transpose() + (h ? 0 : cc * (2 - cc)) * c);
    for (int i = 0; i < mu; ++i)
      c += cmu * w[i] * tried[static_cast<std::size_t>(i)].second *
           tried[static_cast<std::size_t>(i)].second.transpose();
    sigma *= std::exp(cs / damps * (ps.norm() / chi - 1));
  }
  s.seconds = now_s() - begin;
  return s;
}

// Simulated annealing as in the thesis: a hundred random starts, then steps that shrink with the temperature.
Search annealing(const Objective& f, const Eigen::VectorXd& start, double range, int most, double goal) {
  Search s;
  const double begin = now_s();
  std::mt19937 random(2);
  std::uniform_real_distribution<double> u(-1, 1);
  std::normal_distribution<double> g;
  Eigen::VectorXd at = start;
  double value = 1e300;
  const auto tried = [&](const Eigen::VectorXd& x) {
    const double v = f(x);
    ++s.solves;
    s.best = std::min(s.best, v);
    if (s.solves_to_goal == 0 && s.best < 1.01 * goal) s.solves_to_goal = s.solves;
    return v;
  };
  for (int i = 0; i < 100; ++i) {
    Eigen::VectorXd x = start;
    for (Eigen::Index k = 0; k < x.size(); ++k) x[k] += range * u(random);
    if (const double v = tried(x); v < value) {
      value = v;
      at = x;
    }
  }
  while (s.solves < most) {
    const double cool = std::pow(1e-3, static_cast<double>(s.solves) / most);
    Eigen::VectorXd x = at;
    for (Eigen::Index k = 0; k < x.size(); ++k) x[k] += 0.5 * range * cool * g(random);
    const double v = tried(x);
    if (v < value || std::exp((value - v) / (0.05 * cool)) > 0.5 * (u(random) + 1)) {
      value = v;
      at = x;
    }
  }
  s.seconds = now_s() - begin;
  return s;
}

// --- the cases -----------------------------------------------------------------------------------------------------

Body make_gear(int n) {
  Body body{gear(n), {}};
  for (std::uint32_t p = 0; p < body.b.points.size(); ++p) {
    const Vec3 q = body.b.points[p];
    if (std::hypot(q.x - 1000, q.y - 1000) < 380) body.fixed.push_back(p);
  }
  return body;
}

std::vector<std::pair<std::string, TissueLoad>> gear_loads(const Body& body, double newtons) {
  std::vector<std::pair<std::string, TissueLoad>> loads;
  const auto begin = [&](const char* name) -> TissueLoad& {
    loads.push_back({name, {}});
    loads.back().second.fixed = body.fixed;
    return loads.back().second;
  };
  const double f = newtons, r = 160;
  TissueLoad& twist = begin("A twist");
  patch(body, {1900, 1000, 190}, r, {0, f, 0}, twist);
  patch(body, {100, 1000, 190}, r, {0, -f, 0}, twist);
  TissueLoad& mixed = begin("B mixed");
  patch(body, {1000, 1850, 190}, r, {f, 0, 0.3 * f}, mixed);
  patch(body, {300, 500, 190}, r, {0, 0.5 * f, -0.4 * f}, mixed);
  TissueLoad& shear = begin("C shear");
  for (std::uint32_t p = 0; p < body.b.points.size(); ++p) {
    if (body.b.points[p].z > 370 && std::hypot(body.b.points[p].x - 1000, body.b.points[p].y - 1000) > 400)
      shear.forces_n.push_back({p, {f / 40, 0, 0}});
  }
  patch(body, {1600, 1600, 300}, r, {0, 0, -f}, begin("D pull"));
  return loads;
}

void gear_calibration(const Context& context) {
  const Material m{0.1, 0.45};
  for (const int n : {16, 24}) {
    const Body body = make_gear(n);
    const auto loads = gear_loads(body, 222);
    std::printf("### Gear, %zu points, %zu tetrahedra, E 100 kPa, nu 0.45, 222 N\n\n", body.b.points.size(),
                body.b.tets.size());
    std::printf(
        "| load | T10 s | truth RMS mm | T4 off T10 | closed form off linear T4 | off T10 "
        "|\n|---|---|---|---|---|---|\n");
    std::vector<CalibrationCase> cases;
    double mean_t4 = 0, mean_t10 = 0;
    for (const auto& [name, load] : loads) {
      const Truth t10 = solve_fem(body, {m}, ElasticLaw::neo_hooke, TetOrder::t10, load);
      const Truth t4 = solve_fem(body, {m}, ElasticLaw::linear, TetOrder::t4, load);
      TissueModel model = TissueModel::of_voxels(body.b.points, body.b.tets, std::span(&m, 1));
      const double a = nrms_of(model, body, load, t4.x), b = nrms_of(model, body, load, t10.x);
      const CalibrationError fe = calibration_error(body.b.points, t4.x, t10.x);
      std::printf("| %s | %.1f%s | %.2f | %.3f | %.3f | %.3f |\n", name.c_str(), t10.seconds,
                  t10.converged ? "" : " (not at rest)", fe.truth_rms_mm, fe.nrms, a, b);
      mean_t4 += a / 4;
      mean_t10 += b / 4;
      cases.push_back({load, t10.x});
    }
    std::printf("| mean | | | | %.3f | %.3f |\n\n", mean_t4, mean_t10);
    if (n != 16) continue;

    // Four factors on load A.
    TissueModel model = TissueModel::of_voxels(body.b.points, body.b.tets, std::span(&m, 1));
    const Calibration c = calibrate(model, {cases.data(), 1}, {}, context);
    std::printf(
        "Four factors fitted to load A: %d equilibrium solves, %.2f s; factors %.3f %.3f %.4f %.3f (axis, diagonal, "
        "face, volume), "
        "uncertain by %.2f %.2f %.2f %.2f (log, for 1 %%); NRMS on A %.3f (closed form %.3f), on B %.3f, C %.3f, D "
        "%.3f.\n\n",
        c.solves, c.seconds, std::exp(c.log_factors[0]), std::exp(c.log_factors[1]), std::exp(c.log_factors[2]),
        std::exp(c.log_factors[3]), c.uncertainty[1], c.uncertainty[2], c.uncertainty[3], c.uncertainty[4],
        c.after[0].nrms, c.before[0].nrms, nrms_of(model, body, loads[1].second, cases[1].truth_mm),
        nrms_of(model, body, loads[2].second, cases[2].truth_mm),
        nrms_of(model, body, loads[3].second, cases[3].truth_mm));
    std::mt19937 random(7);
    std::uniform_real_distribution<double> u(-1, 1);
    double mean = 0, worst = 0, t4_mean = 0;
    int counted = 0;
    while (counted < 10) {
      const double angle = std::numbers::pi * u(random), radius = 700 + 250 * u(random);
      TissueLoad load;
      load.fixed = body.fixed;
      patch(body, {1000 + radius * std::cos(angle), 1000 + radius * std::sin(angle), 190 + 150 * u(random)}, 180,
            normalized({u(random), u(random), u(random)}) * 222, load);
      if (load.forces_n.size() < 4) continue;
      const Truth t10 = solve_fem(body, {m}, ElasticLaw::neo_hooke, TetOrder::t10, load);
      const Truth t4 = solve_fem(body, {m}, ElasticLaw::neo_hooke, TetOrder::t4, load);
      const double e = nrms_of(model, body, load, t10.x);
      mean += e / 10;
      worst = std::max(worst, e);
      t4_mean += calibration_error(body.b.points, t4.x, t10.x).nrms / 10;
      ++counted;
    }
    std::printf("Ten other random loads: mean NRMS %.3f, worst %.3f; linear-tetrahedra finite elements %.3f.\n\n", mean,
                worst, t4_mean);

    // The same four factors by search.
    TissueModel searched = TissueModel::of_voxels(body.b.points, body.b.tets, std::span(&m, 1));
    EquilibriumSolver solver(searched, searched.rest(), body.fixed);
    const Objective f = [&](const Eigen::VectorXd& logs) {
      for (Eigen::Index i = 0; i < 4; ++i) {
        if (!(std::abs(logs[i]) < 7)) return 1e3;
      }
      searched.scale({std::exp(logs[0]), std::exp(logs[1]), std::exp(logs[2]), std::exp(logs[3])});
      const Equilibrium r = solver.solve(searched, searched.rest(), loads[0].second.forces_n);
      return r.converged ? calibration_error(searched.rest(), r.points_mm, cases[0].truth_mm).nrms : 1e3;
    };
    Eigen::VectorXd start(4);
    start << 0, 0, -2, 0;
    const double goal = c.after[0].nrms;
    const Search cma = cma_es(f, start, 0.5, 800, goal), annealed = annealing(f, start, 2, 1500, goal);
    std::printf(
        "| way | solves | solves to within 1 %% of the fit | NRMS on A | s |\n|---|---|---|---|---|\n| "
        "Levenberg-Marquardt, implicit "
        "Jacobian | %d | | %.4f | %.2f |\n",
        c.solves, goal, c.seconds);
    for (const auto& [name, s] : {std::pair{"CMA-ES", cma}, {"annealing after 100 random starts", annealed}})
      std::printf("| %s | %d | %s | %.4f | %.1f |\n", name, s.solves,
                  s.solves_to_goal > 0 ? std::to_string(s.solves_to_goal).c_str() : "never", s.best, s.seconds);
    std::printf("\n");
  }
}

void incompressible() {
  std::printf(
      "### Poisson's ratio near a half: cube of 8 x 8 x 8 voxels, base held, load on top\n\n| nu | T4 off T10 | closed "
      "form off T10 | "
      "ratio |\n|---|---|---|---|\n");
  Body body{test::block(8, 8, 8, 25), {}};
  for (std::uint32_t p = 0; p < body.b.points.size(); ++p) {
    if (body.b.points[p].z < 1e-9) body.fixed.push_back(p);
  }
  for (const double nu : {0.45, 0.49, 0.499}) {
    const Material m{0.1, nu};
    TissueLoad load;
    load.fixed = body.fixed;
    patch(body, {100, 100, 200}, 60, {5, 0, -10}, load);
    const Truth t10 = solve_fem(body, {m}, ElasticLaw::linear, TetOrder::t10, load),
                t4 = solve_fem(body, {m}, ElasticLaw::linear, TetOrder::t4, load);
    TissueModel model = TissueModel::of_voxels(body.b.points, body.b.tets, std::span(&m, 1));
    const double fe = calibration_error(body.b.points, t4.x, t10.x).nrms, own = nrms_of(model, body, load, t10.x);
    std::printf("| %g | %.3f | %.3f | %.2f |\n", nu, fe, own, own / fe);
  }
  std::printf("\n");
}

void two_materials(const Context& context) {
  std::printf("### Cube of 1000 kPa below and 50 kPa above, nu 0.499: stiffness learnt from one uniform guess\n\n");
  Body body{test::block(8, 8, 8, 25), {}};
  for (std::uint32_t p = 0; p < body.b.points.size(); ++p) {
    if (body.b.points[p].z < 1e-9) body.fixed.push_back(p);
  }
  std::vector<Material> materials;
  for (const auto& t : body.b.tets) {
    double z = 0;
    for (const std::uint32_t p : t) z += body.b.points[p].z / 4;
    materials.push_back({z < 100 ? 1.0 : 0.05, 0.499});
  }
  TissueLoad load;
  load.fixed = body.fixed;
  patch(body, {100, 100, 200}, 60, {3, 0, -5}, load);
  patch(body, {200, 100, 60}, 60, {20, 0, 0}, load);
  const Truth truth = solve_fem(body, materials, ElasticLaw::neo_hooke, TetOrder::t10, load);
  const Material guess{0.2, 0.499};
  const TissueModel uniform = TissueModel::of_voxels(body.b.points, body.b.tets, std::span(&guess, 1));
  std::vector<CalibrationCase> cases{{load, truth.x}};
  for (const auto& [at, f] :
       {std::pair{Vec3{30, 170, 200}, Vec3{-4, -3, -2}}, {Vec3{100, 200, 70}, Vec3{0, -25, 10}}}) {
    TissueLoad l;
    l.fixed = body.fixed;
    patch(body, at, 60, f, l);
    cases.push_back({l, solve_fem(body, materials, ElasticLaw::neo_hooke, TetOrder::t10, l).x});
  }
  TissueLoad other;
  other.fixed = body.fixed;
  patch(body, {40, 40, 200}, 60, {-3, 4, -3}, other);
  const Truth unseen = solve_fem(body, materials, ElasticLaw::neo_hooke, TetOrder::t10, other);
  // Geometric means of what edges a voxel or more from the border were learnt to be, kPa.
  const auto learnt = [&](const TissueModel& model) {
    double sum[2] = {0, 0};
    int count[2] = {0, 0};
    for (std::size_t k = 0; k < model.constraints().size(); ++k) {
      const auto& q = model.constraints()[k];
      if (q.nodes != 2) continue;
      const double a = model.rest()[q.node[0]].z, b = model.rest()[q.node[1]].z;
      const int half = std::max(a, b) < 99 ? 0 : std::min(a, b) > 101 ? 1 : 2;
      if (half == 2) continue;
      sum[half] += std::log(1000 * guess.young_mpa * q.stiffness / model.base_stiffness(k));
      ++count[half];
    }
    return std::array{std::exp(sum[0] / count[0]), std::exp(sum[1] / count[1])};
  };
  std::printf(
      "| | fitted to | parameters | solves | s | NRMS | NRMS on another load | learnt kPa | contrast (true 20) "
      "|\n|---|---|---|---|---|---|---|---|---|\n");
  struct Row {
    const char* name;
    std::array<int, 3> grid;
    bool shared;
    std::size_t loads;
  };
  for (const Row& row :
       {Row{"homogeneous", {1, 1, 1}, true, 1}, Row{"map of 5 x 5 x 5", {5, 5, 5}, true, 1},
        Row{"map of 5 x 5 x 9", {5, 5, 9}, true, 1}, Row{"map of 9 x 9 x 9", {9, 9, 9}, true, 1},
        Row{"map of 5 x 5 x 9", {5, 5, 9}, true, 3}, Row{"a map of 5 x 5 x 5 for each class", {5, 5, 5}, false, 1}}) {
    TissueModel model = uniform;
    CalibrateOptions o;
    o.grid = row.grid;
    o.shared_grid = row.shared;
    if (row.grid[0] > 1) o.pull = 0.01;
    const Calibration c = calibrate(model, std::span(cases.data(), row.loads), o, context);
    const auto [low, high] = learnt(model);
    std::printf("| %s | %zu | %d | %d | %.1f | %.4f | %.3f | %.0f, %.0f | %.1f |\n", row.name, row.loads, c.parameters,
                c.solves, c.seconds, c.after[0].nrms, nrms_of(model, body, other, unseen.x), low, high, low / high);
    std::fflush(stdout);
  }
  std::printf("\n");
}

}  // namespace

void bench_tissue(const Context& context) {
  bench::tissue_elements();
  bench::tissue_time();
  bench::tissue_pressed();
  two_materials(context);
  bench::tissue_measured(context);
  incompressible();
  gear_calibration(context);
}

}  // namespace osteo
