#include "osteo/simulation/tissue/calibrate.h"

#ifdef OSTEO_WITH_CERES
#include <ceres/ceres.h>
#endif

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <chrono>
#include <cmath>

#include "fit.h"
#include "osteo/core/base/error.h"

namespace osteo::inline simulation {

using namespace tissue;

namespace {

#ifdef OSTEO_WITH_CERES

class Cost final : public ceres::CostFunction {
 public:
  explicit Cost(Fit& fit) : fit_(fit) {
    set_num_residuals(fit.residuals());
    mutable_parameter_block_sizes()->push_back(fit.width());
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

CalibrationError calibration_error(std::span<const Vec3> rest, std::span<const Vec3> shape,
                                   std::span<const Vec3> truth) {
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

double force_error(std::span<const Vec3> rest, std::span<const Vec3> shape, std::span<const Vec3> truth,
                   const TissueLoad& load) {
  double own = 0, true_work = 0;
  for (const auto& [p, f] : load.forces_n) {
    own += dot(f, shape[p] - rest[p]);
    true_work += dot(f, truth[p] - rest[p]);
  }
  return own != 0 ? true_work / own - 1 : 0;
}

TissueModel with_log_factors(const TissueModel& model, const std::array<int, 3>& grid,
                             std::span<const double> log_factors) {
  if (log_factors.size() != grid_points(grid) * kTissueClasses)
    throw Error(ExitCode::usage, std::to_string(log_factors.size()) + " factors do not fit a grid of " +
                                     std::to_string(grid_points(grid)) + " points");
  TissueModel scaled = model;
  const std::vector<Share> share = shares(model, grid);
  std::vector<double> factors(share.size());
  for (std::size_t c = 0; c < share.size(); ++c) {
    double log = 0;
    for (std::size_t n = 0; n < 8; ++n)
      log += share[c].weight[n] *
             log_factors[share[c].at[n] * kTissueClasses + static_cast<std::size_t>(model.constraints()[c].kind)];
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
  throw Error(ExitCode::failed, "this build cannot calibrate: it was made without Ceres",
              "build with -DOSTEO_CERES=ON");
}

#else

bool has_ceres() {
  return true;
}

Descent tissue::descend(Fit& fit, std::vector<double> logs, const CalibrateOptions& options, const Context& context) {
  ceres::Problem problem;
  problem.AddResidualBlock(new Cost(fit), nullptr, logs.data());
  for (int i = 0; i < fit.parameters(); ++i) {
    problem.SetParameterLowerBound(logs.data(), i, options.least_log);
    problem.SetParameterUpperBound(logs.data(), i, options.most_log);
  }
  Watch watch(logs, context);
  ceres::Solver::Options o;
  o.linear_solver_type = ceres::DENSE_QR;
  // A few factors from the closed form are nearly a linear problem; a map far from uniform is a long valley, which the
  // dogleg follows better.
  o.trust_region_strategy_type = fit.parameters() > 8 ? ceres::DOGLEG : ceres::LEVENBERG_MARQUARDT;
  o.max_num_iterations = options.iterations;
  o.function_tolerance = options.tolerance;
  o.parameter_tolerance = 1e-5;
  o.num_threads = 1;
  o.logging_type = ceres::SILENT;
  o.callbacks.push_back(&watch);
  o.update_state_every_iteration = true;
  ceres::Solver::Summary summary;
  ceres::Solve(o, &problem, &summary);
  Descent d{summary.IsSolutionUsable(),
            summary.termination_type == ceres::CONVERGENCE,
            {},
            summary.final_cost,
            std::move(logs),
            std::move(watch.cost),
            std::move(watch.course)};
  if (!d.converged) d.why = summary.message;
  return d;
}

Calibration calibrate(TissueModel& model, std::span<const CalibrationCase> cases, const CalibrateOptions& options,
                      const Context& context) {
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
    Descent d = descend(fit, logs_of(start), options, context);
    if (!d.usable || !(d.cost < best_cost)) continue;
    best_cost = d.cost;
    best = d.parameters;
    result.cost = std::move(d.costs);
    result.course = std::move(d.course);
    result.converged = d.converged;
    result.why = d.why;
  }
  if (best.empty()) {
    model.scale({1, 1, 0, 1});
    result.why = "no factors were found with which the model comes to rest under these loads";
    return result;
  }
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

}  // namespace osteo::inline simulation
