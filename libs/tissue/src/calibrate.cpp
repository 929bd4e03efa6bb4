#include "osteo/tissue/calibrate.h"

#ifdef OSTEO_WITH_CERES
#include <ceres/ceres.h>
#endif

#include <Eigen/SVD>
#include <algorithm>
#include <chrono>
#include <cmath>

#include "osteo/base/error.h"

namespace osteo {
namespace {

constexpr double kBorder = 0.3;  // log: differences beyond are taken for borders

// Which grid points a constraint lies between, and how much of each.
struct Share {
  std::array<std::uint32_t, 8> at{};
  std::array<double, 8> weight{};
};

std::size_t grid_points(const std::array<int, 3>& grid) {
  std::size_t nodes = 1;
  for (const int n : grid) {
    if (n < 1) throw Error(ExitCode::usage, "the grid of stiffness needs at least one point along each axis");
    nodes *= static_cast<std::size_t>(n);
  }
  return nodes;
}

// Of each constraint, by its middle in the body's box.
std::vector<Share> shares(const TissueModel& model, const std::array<int, 3>& grid) {
  const auto& x = model.rest();
  Vec3 lo{1e300, 1e300, 1e300}, hi = lo * -1;
  for (const Vec3& p : x)
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], p[a]);
      hi[a] = std::max(hi[a], p[a]);
    }
  std::vector<Share> all;
  for (const auto& c : model.constraints()) {
    Vec3 middle{};
    for (std::size_t n = 0; n < c.nodes; ++n) middle += x[c.node[n]] / static_cast<double>(c.nodes);
    int cell[3];
    double t[3];
    for (std::size_t a = 0; a < 3; ++a) {
      const double at = grid[a] > 1 ? (middle[a] - lo[a]) / (hi[a] - lo[a]) * (grid[a] - 1) : 0;
      cell[a] = std::clamp(static_cast<int>(at), 0, std::max(0, grid[a] - 2));
      t[a] = grid[a] > 1 ? at - cell[a] : 0;
    }
    Share s;
    for (std::size_t n = 0; n < 8; ++n) {
      double w = 1;
      std::size_t at = 0, stride = 1;
      for (std::size_t a = 0; a < 3; ++a) {
        const int up = static_cast<int>(n >> a & 1);
        w *= up != 0 ? t[a] : 1 - t[a];
        at += static_cast<std::size_t>(std::min(cell[a] + up, grid[a] - 1)) * stride;
        stride *= static_cast<std::size_t>(grid[a]);
      }
      s.at[n] = static_cast<std::uint32_t>(at);
      s.weight[n] = w;
    }
    all.push_back(s);
  }
  return all;
}

#ifdef OSTEO_WITH_CERES

// Logarithms of the classes' factors (axis edges, diagonals, faces, volumes). Faces begin small: the closed form has none. The others lean
// on edges, and on faces.
constexpr std::array<double, kTissueClasses> kStarts[3] = {{0, 0, -2, 0}, {0.7, 0.7, -2, 0}, {-0.7, -0.7, 3, -0.7}};

class Fit {
 public:
  Fit(TissueModel& model, std::span<const CalibrationCase> cases, const CalibrateOptions& options, const Context& context)
      : model_(model), cases_(cases), options_(options), context_(context), solver_(model, model.rest(), cases.front().load) {
    const auto held = [&](const TissueLoad& load) {
      std::vector<std::uint8_t> axes(model.point_count());
      for (const std::uint32_t p : load.fixed) axes.at(p) = 7;
      for (const Slider& s : load.sliders) axes.at(s.point) = static_cast<std::uint8_t>(axes.at(s.point) | s.held);
      return axes;
    };
    for (const CalibrationCase& c : cases) {
      if (held(c.load) != held(cases.front().load)) throw Error(ExitCode::usage, "all loads of a calibration must fix the same points");
      if (c.truth_mm.size() != model.point_count())
        throw Error(ExitCode::usage,
                    "the truth has " + std::to_string(c.truth_mm.size()) + " points, the model " + std::to_string(model.point_count()));
      double sum = 0;
      for (std::size_t p = 0; p < c.truth_mm.size(); ++p) sum += dot(c.truth_mm[p] - model.rest()[p], c.truth_mm[p] - model.rest()[p]);
      if (!(sum > 0) || !std::isfinite(sum))
        throw Error(ExitCode::usage, "a load of the calibration moves nothing, or its truth is not finite");
      const double rms = std::sqrt(sum / static_cast<double>(c.truth_mm.size()));
      scale_.push_back(1 / (rms * std::sqrt(static_cast<double>(c.truth_mm.size() * cases.size()))));
      shape_.push_back(model.rest());
    }
    lay_grid();
    find_level();
  }

  [[nodiscard]] int parameters() const { return static_cast<int>(used_.size()); }
  [[nodiscard]] int residuals() const {
    return static_cast<int>(3 * model_.point_count() * cases_.size()) + parameters() + static_cast<int>(neighbours_.size());
  }
  // Where a start begins: logarithms for the classes, beside the level of a map.
  [[nodiscard]] double seed(int parameter, const std::array<double, kTissueClasses>& classes) const {
    return of_map(parameter) ? level_ : classes[static_cast<std::size_t>(kind_of(parameter))];
  }
  [[nodiscard]] double cost(const std::vector<double>& logs) {
    std::vector<double> r(static_cast<std::size_t>(residuals()));
    if (!evaluate(logs.data(), r.data(), nullptr)) return 1e300;
    double sum = 0;
    for (const double v : r) sum += 0.5 * v * v;
    return sum;
  }
  [[nodiscard]] double pull_goal(int parameter) const {
    return of_map(parameter) ? level_ : kStarts[0][static_cast<std::size_t>(kind_of(parameter))];
  }
  // Factors of a map and those of the classes are pulled as two families, or many points of a map would leave the classes free.
  [[nodiscard]] double pull_of(int parameter) const {
    const double family = !options_.shared_grid || nodes_ == 1 ? parameters()
                          : of_map(parameter)                  ? parameters() - static_cast<int>(kTissueClasses)
                                                               : kTissueClasses;
    return options_.pull / std::sqrt(family);
  }
  // A map starts from, and is pulled towards, the one factor with which the closed form moves as far as the truth.
  void find_level() {
    if (nodes_ == 1 || !options_.shared_grid) return;
    for (int round = 0; round < 3; ++round) {
      model_.scale({std::exp(level_), std::exp(level_), 0, std::exp(level_)});
      double own = 0, both = 0;
      for (std::size_t n = 0; n < cases_.size(); ++n) {
        const Equilibrium at = solver_.solve(model_, shape_[n], cases_[n].load.forces_n, options_.equilibrium, context_);
        ++result.solves;
        if (!at.converged) return;
        shape_[n] = at.points_mm;
        for (std::size_t p = 0; p < at.points_mm.size(); ++p) {
          const Vec3 u = (at.points_mm[p] - model_.rest()[p]) * scale_[n], t = (cases_[n].truth_mm[p] - model_.rest()[p]) * scale_[n];
          own += dot(u, u);
          both += dot(u, t);
        }
      }
      if (!(both > 0)) return;
      const double step = std::clamp(std::log(own / both), -2.0, 2.0);
      level_ = std::clamp(level_ + step, options_.least_log, options_.most_log);
      if (std::abs(step) < 0.05) return;
    }
  }

  void set(const double* logs) {
    std::vector<double> factors(model_.constraints().size());
    for (std::size_t c = 0; c < factors.size(); ++c) {
      double log = 0;
      for_parameters(c, [&](std::uint32_t j, double weight) { log += weight * logs[j]; });
      factors[c] = std::exp(log);
    }
    model_.scale_each(factors);
  }

  // False when a case finds no rest.
  bool evaluate(const double* logs, double* residuals, double** jacobian_rows) {
    set(logs);
    const std::size_t points = model_.point_count(), parameters = used_.size();
    double* out = residuals;
    for (std::size_t n = 0; n < cases_.size(); ++n) {
      const Equilibrium at = solver_.solve(model_, shape_[n], cases_[n].load.forces_n, options_.equilibrium, context_);
      // Where it is at rest already (the same factors again, for their Jacobian) nothing was solved.
      if (at.iterations > 0) ++result.solves;
      if (!at.converged) {
        // From rest, before giving it up.
        ++result.failed_solves;
        ++result.solves;
        const Equilibrium again = solver_.solve(model_, model_.rest(), cases_[n].load.forces_n, options_.equilibrium, context_);
        if (!again.converged) return false;
        shape_[n] = again.points_mm;
      } else {
        shape_[n] = at.points_mm;
      }
      for (std::size_t p = 0; p < points; ++p)
        for (std::size_t a = 0; a < 3; ++a) *out++ = (shape_[n][p][a] - cases_[n].truth_mm[p][a]) * scale_[n];
      if (jacobian_rows != nullptr) differentiate(n, *jacobian_rows, 3 * points * n);
    }
    for (std::size_t i = 0; i < parameters; ++i) {
      const double weight = pull_of(static_cast<int>(i));
      *out++ = weight * (logs[i] - pull_goal(static_cast<int>(i)));
      if (jacobian_rows == nullptr) continue;
      double* const row = *jacobian_rows + (3 * points * cases_.size() + i) * parameters;
      std::fill(row, row + parameters, 0.0);
      row[i] = weight;
    }
    for (std::size_t n = 0; n < neighbours_.size(); ++n) {
      const auto [i, j] = neighbours_[n];
      const double weight = options_.smooth / std::sqrt(static_cast<double>(neighbours_.size()));
      // Its square is that of a pseudo-Huber loss: d^2 for small differences, 2 kBorder |d| for large ones.
      const double d = (logs[i] - logs[j]) / kBorder, root = std::sqrt(1 + d * d), value = d * std::sqrt(2 / (root + 1));
      *out++ = weight * kBorder * value;
      if (jacobian_rows == nullptr) continue;
      double* const row = *jacobian_rows + (3 * points * cases_.size() + parameters + n) * parameters;
      std::fill(row, row + parameters, 0.0);
      const double slope = weight * (d != 0 ? d / (root * value) : 1);
      row[i] = slope;
      row[j] = -slope;
    }
    return true;
  }

  Calibration result;
  [[nodiscard]] const std::vector<std::vector<Vec3>>& shapes() const { return shape_; }
  // By their full numbers; 0 for those that are not there.
  [[nodiscard]] std::vector<double> all_of(const std::vector<double>& values) const {
    std::vector<double> all(numbers());
    for (std::size_t i = 0; i < used_.size(); ++i) all[used_[i]] = values[i];
    return all;
  }
  [[nodiscard]] std::size_t nodes() const { return nodes_; }

 private:
  // Numbers of parameters: of own grids point times classes plus class; of a shared one the points, then the classes.
  [[nodiscard]] std::size_t numbers() const { return options_.shared_grid ? nodes_ + kTissueClasses : nodes_ * kTissueClasses; }
  [[nodiscard]] bool of_map(int parameter) const { return options_.shared_grid && used_[static_cast<std::size_t>(parameter)] < nodes_; }
  [[nodiscard]] TissueClass kind_of(int parameter) const {
    const std::size_t number = used_[static_cast<std::size_t>(parameter)];
    return static_cast<TissueClass>(options_.shared_grid ? number - nodes_ : number % kTissueClasses);
  }
  // The parameters that scale a constraint, and how much of each.
  template <class F>
  void for_parameters(std::size_t c, F&& f) const {
    const auto kind = static_cast<std::size_t>(model_.constraints()[c].kind);
    for (std::size_t n = 0; n < 8; ++n) {
      if (share_[c].weight[n] == 0) continue;
      const std::size_t number = options_.shared_grid ? share_[c].at[n] : share_[c].at[n] * kTissueClasses + kind;
      if (const std::uint32_t j = parameter_of_[number]; j != kNone) f(j, share_[c].weight[n]);
    }
    if (!options_.shared_grid) return;
    if (const std::uint32_t j = parameter_of_[nodes_ + kind]; j != kNone) f(j, 1.0);
  }
  void lay_grid() {
    nodes_ = grid_points(options_.grid);
    share_ = shares(model_, options_.grid);
    std::vector<bool> near(numbers());
    for (std::size_t c = 0; c < share_.size(); ++c) {
      const auto kind = static_cast<std::size_t>(model_.constraints()[c].kind);
      for (std::size_t n = 0; n < 8; ++n) {
        const std::size_t at = share_[c].at[n];
        // A map of one point is the classes' own factors.
        if (share_[c].weight[n] > 1e-3 && !(options_.shared_grid && nodes_ == 1))
          near[options_.shared_grid ? at : at * kTissueClasses + kind] = true;
      }
      if (options_.shared_grid) near[nodes_ + kind] = true;
    }
    parameter_of_.assign(numbers(), kNone);
    for (std::uint32_t i = 0; i < near.size(); ++i) {
      if (!near[i]) continue;
      parameter_of_[i] = static_cast<std::uint32_t>(used_.size());
      used_.push_back(i);
    }
    if (options_.smooth <= 0 || nodes_ == 1 || !options_.shared_grid) return;
    std::size_t stride = 1;
    for (std::size_t a = 0; a < 3; ++a) {
      const auto many = static_cast<std::size_t>(options_.grid[a]);
      for (std::size_t p = 0; p < nodes_; ++p) {
        if (p / stride % many + 1 == many) continue;
        const std::uint32_t i = parameter_of_[p], j = parameter_of_[p + stride];
        if (i != kNone && j != kNone) neighbours_.push_back({i, j});
      }
      stride *= many;
    }
  }

  // H du/dlog_j = - sum over constraints of (share of j) * gradient of its energy, since dk/dlog = k.
  void differentiate(std::size_t n, double* jacobian, std::size_t first_row) {
    ++result.jacobians;
    const std::size_t points = model_.point_count(), parameters = used_.size();
    std::vector<std::vector<Vec3>> right(parameters, std::vector<Vec3>(points));
    Vec3 local[8];
    double g[24];
    for (std::size_t c = 0; c < model_.constraints().size(); ++c) {
      const auto nodes = model_.nodes(c);
      for (std::size_t a = 0; a < nodes.size(); ++a) local[a] = shape_[n][nodes[a]];
      model_.element(c, local, g, nullptr);
      for_parameters(c, [&](std::uint32_t k, double weight) {
        for (std::size_t a = 0; a < nodes.size(); ++a) right[k][nodes[a]] -= Vec3{g[3 * a], g[3 * a + 1], g[3 * a + 2]} * weight;
      });
    }
    std::vector<Vec3> du(points);
    for (std::size_t j = 0; j < parameters; ++j) {
      solver_.back_solve(right[j], du);
      for (std::size_t p = 0; p < points; ++p)
        for (std::size_t a = 0; a < 3; ++a) jacobian[(first_row + 3 * p + a) * parameters + j] = du[p][a] * scale_[n];
    }
  }

  TissueModel& model_;
  std::span<const CalibrationCase> cases_;
  CalibrateOptions options_;
  const Context& context_;
  EquilibriumSolver solver_;
  std::vector<double> scale_;                             // of each case: 1 / its size
  std::vector<std::array<std::uint32_t, 2>> neighbours_;  // parameters of the map that lie beside each other
  std::vector<std::vector<Vec3>> shape_;                  // where each case came to rest last
  std::vector<Share> share_;
  static constexpr std::uint32_t kNone = 0xffffffffU;
  std::vector<std::uint32_t> used_, parameter_of_;  // parameter -> number, and back
  std::size_t nodes_ = 1;
  double level_ = 0;
};

class Cost final : public ceres::CostFunction {
 public:
  explicit Cost(Fit& fit) : fit_(fit) {
    set_num_residuals(fit.residuals());
    mutable_parameter_block_sizes()->push_back(fit.parameters());
  }
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    double* const jacobian = jacobians != nullptr ? jacobians[0] : nullptr;
    double* rows = jacobian;
    return fit_.evaluate(parameters[0], residuals, jacobian != nullptr ? &rows : nullptr);
  }

 private:
  Fit& fit_;
};

class Watch final : public ceres::IterationCallback {
 public:
  Watch(const std::vector<double>& logs, const Context& context) : logs_(logs), context_(context) {}
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& s) override {
    if (s.step_is_successful || s.iteration == 0) {
      cost.push_back(s.cost);
      course.push_back(logs_);
    }
    context_.progress(std::min(0.95, 0.05 * s.iteration), "calibrating");
    return ceres::SOLVER_CONTINUE;
  }
  std::vector<double> cost;
  std::vector<std::vector<double>> course;

 private:
  const std::vector<double>& logs_;
  const Context& context_;
};

#endif

}  // namespace

CalibrationError calibration_error(std::span<const Vec3> rest, std::span<const Vec3> shape, std::span<const Vec3> truth) {
  const double n = static_cast<double>(rest.size());
  double off = 0, moved = 0;
  Eigen::Vector3d a = Eigen::Vector3d::Zero(), b = a;
  const auto vec = [](Vec3 v) { return Eigen::Vector3d(v.x, v.y, v.z); };
  for (std::size_t p = 0; p < rest.size(); ++p) {
    off += dot(shape[p] - truth[p], shape[p] - truth[p]);
    moved += dot(truth[p] - rest[p], truth[p] - rest[p]);
    a += vec(shape[p]) / n;
    b += vec(truth[p]) / n;
  }
  Eigen::Matrix3d cov = Eigen::Matrix3d::Zero();
  for (std::size_t p = 0; p < rest.size(); ++p) cov += (vec(truth[p]) - b) * (vec(shape[p]) - a).transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(cov, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d d = Eigen::Matrix3d::Identity();
  d(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  const Eigen::Matrix3d turn = svd.matrixU() * d * svd.matrixV().transpose();
  double left = 0;
  for (std::size_t p = 0; p < rest.size(); ++p) left += (turn * (vec(shape[p]) - a) + b - vec(truth[p])).squaredNorm();
  return {std::sqrt(off / moved), std::sqrt(left / moved), std::sqrt(off / n), std::sqrt(moved / n)};
}

double force_error(std::span<const Vec3> rest, std::span<const Vec3> shape, std::span<const Vec3> truth, const TissueLoad& load) {
  double own = 0, true_work = 0;
  for (const auto& [p, f] : load.forces_n) {
    own += dot(f, shape[p] - rest[p]);
    true_work += dot(f, truth[p] - rest[p]);
  }
  return own != 0 ? true_work / own - 1 : 0;
}

TissueModel with_log_factors(const TissueModel& model, const std::array<int, 3>& grid, std::span<const double> log_factors) {
  if (log_factors.size() != grid_points(grid) * kTissueClasses)
    throw Error(ExitCode::usage,
                std::to_string(log_factors.size()) + " factors do not fit a grid of " + std::to_string(grid_points(grid)) + " points");
  TissueModel scaled = model;
  const std::vector<Share> share = shares(model, grid);
  std::vector<double> factors(share.size());
  for (std::size_t c = 0; c < share.size(); ++c) {
    double log = 0;
    for (std::size_t n = 0; n < 8; ++n)
      log += share[c].weight[n] * log_factors[share[c].at[n] * kTissueClasses + static_cast<std::size_t>(model.constraints()[c].kind)];
    factors[c] = std::exp(log);
  }
  scaled.scale_each(factors);
  return scaled;
}

#ifndef OSTEO_WITH_CERES

bool has_ceres() {
  return false;
}

Calibration calibrate(TissueModel&, std::span<const CalibrationCase>, const CalibrateOptions&, const Context&) {
  throw Error(ExitCode::failed, "this build cannot calibrate: it was made without Ceres", "build with -DOSTEO_CERES=ON");
}

#else

bool has_ceres() {
  return true;
}

Calibration calibrate(TissueModel& model, std::span<const CalibrationCase> cases, const CalibrateOptions& options, const Context& context) {
  if (cases.empty()) throw Error(ExitCode::usage, "a calibration needs at least one load");
  const auto begin = std::chrono::steady_clock::now();
  Fit fit(model, cases, options, context);
  Calibration& result = fit.result;
  result.parameters = fit.parameters();
  const auto n = static_cast<std::size_t>(fit.parameters());

  // Before: the closed form, as the model stands without factors.
  {
    EquilibriumSolver solver(model, model.rest(), cases.front().load);
    TissueModel plain = model;
    plain.scale({1, 1, 0, 1});
    for (const CalibrationCase& c : cases) {
      const Equilibrium at = solver.solve(plain, plain.rest(), c.load.forces_n, options.equilibrium, context);
      result.before.push_back(calibration_error(model.rest(), at.points_mm, c.truth_mm));
    }
  }
  std::vector<double> best;
  double best_cost = 1e300;
  ceres::Solver::Summary best_summary;
  std::vector<std::array<double, kTissueClasses>> starts(kStarts, kStarts + std::clamp(options.starts, 1, 3));
  const auto logs_of = [&](const std::array<double, kTissueClasses>& classes) {
    std::vector<double> logs(n);
    for (std::size_t i = 0; i < n; ++i) logs[i] = fit.seed(static_cast<int>(i), classes);
    return logs;
  };
  double best_sample = 1e300;
  for (int k = 1; k <= options.samples; ++k) {
    std::array<double, kTissueClasses> classes{};
    constexpr int kPrimes[kTissueClasses] = {2, 3, 5, 7};
    for (std::size_t c = 0; c < kTissueClasses; ++c) {
      double share = 0, digit = 1;
      for (int i = k; i > 0; i /= kPrimes[c]) share += (digit /= kPrimes[c]) * (i % kPrimes[c]);
      classes[c] = kStarts[0][c] + 4 * share - 2;
    }
    if (const double cost = fit.cost(logs_of(classes)); cost < best_sample) {
      if (best_sample < 1e300) starts.pop_back();
      best_sample = cost;
      starts.push_back(classes);
    }
  }
  for (const auto& start : starts) {
    std::vector<double> logs = logs_of(start);
    ceres::Problem problem;
    problem.AddResidualBlock(new Cost(fit), nullptr, logs.data());
    for (std::size_t i = 0; i < n; ++i) {
      problem.SetParameterLowerBound(logs.data(), static_cast<int>(i), options.least_log);
      problem.SetParameterUpperBound(logs.data(), static_cast<int>(i), options.most_log);
    }
    Watch watch(logs, context);
    ceres::Solver::Options o;
    o.linear_solver_type = ceres::DENSE_QR;
    // A few factors from the closed form are nearly a linear problem; a map far from uniform is a long valley, which the dogleg follows
    // better.
    o.trust_region_strategy_type = n > 8 ? ceres::DOGLEG : ceres::LEVENBERG_MARQUARDT;
    o.max_num_iterations = options.iterations;
    o.function_tolerance = options.tolerance;
    o.parameter_tolerance = 1e-5;
    o.num_threads = 1;
    o.logging_type = ceres::SILENT;
    o.callbacks.push_back(&watch);
    o.update_state_every_iteration = true;
    ceres::Solver::Summary summary;
    ceres::Solve(o, &problem, &summary);
    if (summary.IsSolutionUsable() && summary.final_cost < best_cost) {
      best_cost = summary.final_cost;
      best = logs;
      best_summary = summary;
      result.cost = watch.cost;
      result.course = watch.course;
    }
  }
  if (best.empty()) {
    model.scale({1, 1, 0, 1});
    result.why = "no factors were found with which the model comes to rest under these loads";
    return result;
  }
  result.converged = best_summary.termination_type == ceres::CONVERGENCE;
  if (!result.converged) result.why = best_summary.message;
  // Once more at the answer: shapes and Jacobian.
  std::vector<double> residuals(static_cast<std::size_t>(fit.residuals())), jacobian(residuals.size() * n);
  double* rows = jacobian.data();
  fit.evaluate(best.data(), residuals.data(), &rows);
  for (std::size_t c = 0; c < cases.size(); ++c)
    result.after.push_back(calibration_error(model.rest(), fit.shapes()[c], cases[c].truth_mm));
  const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> j(
      jacobian.data(), static_cast<Eigen::Index>(3 * model.point_count() * cases.size()), static_cast<Eigen::Index>(n));
  const Eigen::MatrixXd information = j.transpose() * j;
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(information, Eigen::ComputeFullU | Eigen::ComputeFullV);
  // Variance of the residuals for 1 % of the truth's RMS in each coordinate.
  const double variance = 1e-4 / static_cast<double>(model.point_count() * cases.size()) / 3;
  std::vector<double> own(n);
  for (std::size_t i = 0; i < n; ++i) {
    double sum = 0;
    for (Eigen::Index k = 0; k < svd.singularValues().size(); ++k) {
      const double v = svd.matrixV()(static_cast<Eigen::Index>(i), k);
      sum += v * v / std::max(svd.singularValues()[k], 1e-14 * svd.singularValues()[0]);
    }
    own[i] = std::sqrt(sum * variance);
  }
  result.uncertainty = fit.all_of(own);
  const std::vector<double> all = fit.all_of(best);
  result.log_factors = all;
  if (options.shared_grid) {
    result.log_stiffness.assign(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(fit.nodes()));
    result.log_factors.clear();
    for (std::size_t p = 0; p < fit.nodes(); ++p)
      for (std::size_t k = 0; k < kTissueClasses; ++k) result.log_factors.push_back(all[p] + all[fit.nodes() + k]);
  }
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return result;
}

#endif

}  // namespace osteo
