#include "osteo/simulation/tissue/damping.h"

#ifdef OSTEO_WITH_CERES
#include <ceres/ceres.h>
#endif

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "body_parts.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/order.h"
#include "osteo/core/base/parallel.h"
#include "osteo/core/base/param.h"
#include "osteo/core/statistics/basics.h"
#include "osteo/simulation/tissue/dynamics.h"
#include "osteo/simulation/tissue/implicit.h"

namespace osteo::inline simulation {

using namespace tissue;

#ifndef OSTEO_WITH_CERES

DampingFit fit_damping(const TissueModel&, const TissueLoad&, std::span<const std::uint32_t>, std::span<const Slider>,
                       const MeasuredMotion&, const DampingOptions&, const Context&) {
  throw Error(ExitCode::failed, "this build cannot fit damping: it was made without Ceres",
              "build with -DOSTEO_CERES=ON");
}

#else

namespace {

constexpr double kTurn = 2 * std::numbers::pi;
constexpr std::size_t kMinValues = 12;
constexpr double kMinSwings = 1.5;
constexpr double kMaxSteps = 5e7;

std::string shown(double v) {  // to four digits
  if (v == 0 || !std::isfinite(v)) return format_number(v);
  const double scale = std::pow(10, 3 - std::floor(std::log10(std::abs(v))));
  return format_number(std::round(v * scale) / scale);
}

// Channels of a simulation, at even steps from the release on.
struct Trace {
  double step_s = 0;
  std::vector<std::vector<double> > mm;
  bool finite = true;
  // Cubic between steps (E. Catmull, R. Rom 1974); before the release it hangs where it was plucked to.
  [[nodiscard]] double at(std::size_t channel, double t, double* by_time = nullptr) const {
    const auto& v = mm[channel];
    const double place = t / step_s;
    if (by_time != nullptr) *by_time = 0;
    if (!(place > 0)) return v.front();
    const auto n = std::min(static_cast<std::size_t>(place), v.size() - 2);
    const double s = place - static_cast<double>(n), b = v[n], c = v[n + 1], a = n > 0 ? v[n - 1] : b,
                 d = n + 2 < v.size() ? v[n + 2] : 2 * c - b;
    const double p1 = (c - a) / 2, p2 = a - 2.5 * b + 2 * c - d / 2, p3 = 1.5 * (b - c) + (d - a) / 2;
    if (by_time != nullptr) *by_time = (p1 + s * (2 * p2 + 3 * s * p3)) / step_s;
    return b + s * (p1 + s * (p2 + s * p3));
  }
};

// The body, let go as it was plucked.
class Release {
 public:
  Release(const TissueModel& model, std::span<const std::uint32_t> fixed, std::span<const Slider> sliders,
          const std::vector<MeasuredMotion::Channel>& channels, const DampingOptions& options, const Context& context)
      : model_(model), fixed_(fixed), sliders_(sliders), channels_(channels), options_(options), context_(context) {}

  // Where it is let go from; a factor on all stiffness is one on density the other way.
  std::vector<Vec3> start;

  [[nodiscard]] Trace run(Stepping stepping, double damping, double stiffness, double seconds) const {
    const double density = options_.density_kg_m3 / stiffness;
    if (stepping == Stepping::implicit_steps) {
      ImplicitDynamics d(model_, fixed_, {density, damping, options_.step_s}, sliders_);
      return go(d, seconds, [&](std::uint32_t p) { return d.positions_mm()[p]; });
    }
    TissueDynamics<double> d(model_, fixed_, {.density_kg_m3 = density, .damping_per_s = damping}, sliders_);
    return go(d, seconds, [&](std::uint32_t p) { return d.position_mm(p); });
  }

 private:
  template <class Dynamics, class At>
  [[nodiscard]] Trace go(Dynamics& d, double seconds, const At& at) const {
    for (std::uint32_t p = 0; p < start.size(); ++p) d.set_position(p, start[p]);
    Trace trace{d.step_s(), std::vector<std::vector<double> >(channels_.size()), true};
    const double steps = std::ceil(seconds / d.step_s()) + 3;
    if (!(steps < kMaxSteps))
      throw Error(ExitCode::usage,
                  shown(seconds) + " s are " + shown(steps) + " steps of " + shown(1000 * d.step_s()) + " ms, too many",
                  "cut the table to the swings that are seen, or take longer, implicit steps");
    for (long n = 0; n <= static_cast<long>(steps); ++n) {
      if (n > 0) d.step();
      if (n % 64 == 0) context_.check_cancelled();
      for (std::size_t c = 0; c < channels_.size(); ++c) {
        const double u = dot(at(channels_[c].point) - model_.rest()[channels_[c].point], channels_[c].along);
        trace.finite = trace.finite && std::isfinite(u);
        trace.mm[c].push_back(u);
      }
    }
    return trace;
  }

  const TissueModel& model_;
  std::span<const std::uint32_t> fixed_;
  std::span<const Slider> sliders_;
  const std::vector<MeasuredMotion::Channel>& channels_;
  const DampingOptions& options_;
  const Context& context_;
};

// A trace as if it had been measured at the same times.
MeasuredMotion as_measured(const Trace& trace, const MeasuredMotion& times) {
  MeasuredMotion m = times;
  for (std::size_t c = 0; c < m.channels.size(); ++c) {
    for (std::size_t i = 0; i < m.channels[c].mm.size(); ++i)
      m.channels[c].mm[i] = trace.at(c, m.channels[c].time_s[i]);
  }
  return m;
}

// Parameters: damping, log stiffness, release, amplitude, then of each channel where it rests and how it drifts; each
// scaled to about 1.
enum : std::size_t { kDamping, kStiffness, kRelease, kAmplitude, kOfChannels };

class DampingCost final : public ceres::CostFunction {
 public:
  DampingCost(const Release& release, Stepping stepping, const MeasuredMotion& used, double damping_scale, double w,
              double size, double span, const Context& context)
      : release_(release),
        stepping_(stepping),
        used_(used),
        damping_(damping_scale),
        w_(w),
        size_(size),
        span_(span),
        context_(context) {
    std::size_t values = 0;
    for (const auto& c : used.channels) values += c.mm.size();
    set_num_residuals(static_cast<int>(values));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(kOfChannels + 2 * used.channels.size()));
  }
  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const double* const p = parameters[0];
    const bool derive = jacobians != nullptr && jacobians[0] != nullptr;
    // Longer than the table: the release may be earlier.
    const double seconds = span_ + 0.5 * kTurn / w_;
    const double by_damping = 1e-2, by_stiffness = std::min(1e-3, 0.05 / (w_ * span_));
    const std::array<std::array<double, 2>, 5> around{{{p[0], p[1]},
                                                       {p[0] + by_damping, p[1]},
                                                       {std::max(0.0, p[0] - by_damping), p[1]},
                                                       {p[0], p[1] + by_stiffness},
                                                       {p[0], p[1] - by_stiffness}}};
    std::array<Trace, 5> trace;
    const std::size_t runs = derive ? 5 : 1;
    parallel_for(runs, 1, context_.threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        trace[i] = release_.run(stepping_, damping_ * around[i][0], std::exp(around[i][1]), seconds);
    });
    simulations += static_cast<int>(runs);
    for (std::size_t i = 0; i < runs; ++i) {
      if (!trace[i].finite) return false;
    }
    const std::size_t width = kOfChannels + 2 * used_.channels.size();
    std::size_t row = 0;
    const double later = p[kRelease] / w_, inverse = 1 / size_;
    for (std::size_t c = 0; c < used_.channels.size(); ++c) {
      const auto& channel = used_.channels[c];
      for (std::size_t i = 0; i < channel.mm.size(); ++i, ++row) {
        const double t = channel.time_s[i] - later;
        double speed = 0;
        const double u = trace[0].at(c, t, &speed), along = channel.time_s[i] / span_ - 0.5;
        residuals[row] =
            (p[kAmplitude] * u - channel.mm[i]) * inverse + p[kOfChannels + 2 * c] + p[kOfChannels + 2 * c + 1] * along;
        if (!derive) continue;
        double* const j = jacobians[0] + row * width;
        std::fill(j, j + width, 0.0);
        const double a = p[kAmplitude] * inverse;
        j[kDamping] = a * (trace[1].at(c, t) - trace[2].at(c, t)) / (around[1][0] - around[2][0]);
        j[kStiffness] = a * (trace[3].at(c, t) - trace[4].at(c, t)) / (around[3][1] - around[4][1]);
        j[kRelease] = -a * speed / w_;
        j[kAmplitude] = u * inverse;
        j[kOfChannels + 2 * c] = 1;
        j[kOfChannels + 2 * c + 1] = along;
      }
    }
    return true;
  }
  mutable int simulations = 0;

 private:
  const Release& release_;
  Stepping stepping_;
  const MeasuredMotion& used_;
  double damping_, w_, size_, span_;
  const Context& context_;
};

// Amplitude, rests and drifts that fit a trace best, and what they leave (over size, squared).
struct Linear {
  double amplitude = 0, left = 1e300;
  std::vector<double> of_channels;
};
Linear linear_fit(const Trace& trace, const MeasuredMotion& used, double later, double size, double span) {
  // Each channel without its own line, then one amplitude for all.
  double uu = 0, uy = 0, yy = 0;
  std::vector<std::array<double, 4> > lines;  // of u and of y: rest, drift
  for (int pass = 0; pass < 2; ++pass) {
    for (std::size_t c = 0; c < used.channels.size(); ++c) {
      const auto& channel = used.channels[c];
      double n = 0, s = 0, ss = 0, u0 = 0, u1 = 0, y0 = 0, y1 = 0;
      for (std::size_t i = 0; i < channel.mm.size(); ++i) {
        const double x = channel.time_s[i] / span - 0.5, u = trace.at(c, channel.time_s[i] - later),
                     y = channel.mm[i] / size;
        if (pass == 0) {
          n += 1;
          s += x;
          ss += x * x;
          u0 += u;
          u1 += u * x;
          y0 += y;
          y1 += y * x;
        } else {
          const double du = u - lines[c][0] - lines[c][1] * x, dy = y - lines[c][2] - lines[c][3] * x;
          uu += du * du;
          uy += du * dy;
          yy += dy * dy;
        }
      }
      if (pass == 0) {
        const double det = n * ss - s * s;
        lines.push_back(
            {(ss * u0 - s * u1) / det, (n * u1 - s * u0) / det, (ss * y0 - s * y1) / det, (n * y1 - s * y0) / det});
      }
    }
  }
  Linear r;
  if (!(uu > 0)) return r;
  const double a = uy / uu;
  r.amplitude = a * size;
  r.left = yy - a * uy;
  for (const auto& l : lines) {
    r.of_channels.push_back(l[2] - a * l[0]);
    r.of_channels.push_back(l[3] - a * l[1]);
  }
  return r;
}

MeasuredMotion from_release(const MeasuredMotion& motion, double release_s) {
  MeasuredMotion used;
  for (const auto& c : motion.channels) {
    used.channels.push_back({c.point, c.along, c.name, {}, {}});
    for (std::size_t i = 0; i < c.time_s.size(); ++i) {
      if (!std::isfinite(c.time_s[i]) || !std::isfinite(c.mm[i]) || (i > 0 && !(c.time_s[i] > c.time_s[i - 1])))
        throw Error(ExitCode::usage,
                    c.name + ": value " + std::to_string(i) + " is no number, or its time does not rise");
      if (c.time_s[i] < release_s) continue;
      used.channels.back().time_s.push_back(c.time_s[i] - release_s);
      used.channels.back().mm.push_back(c.mm[i]);
    }
  }
  return used;
}

/// What a table holds: how many values, and their root mean square about each channel's mean.
struct MotionTable {
  std::size_t values = 0;
  double size_mm = 0;
};

// Fills what is told of the table: span_s, interval_s, largest_mm.
MotionTable look_at_table(DampingFit& fit, double release_s) {
  std::vector<double> between;
  MotionTable table;
  double squares = 0, farthest = 0;
  for (const auto& c : fit.used.channels) {
    if (c.mm.size() < kMinValues)
      throw Error(ExitCode::usage,
                  c.name + ": " + std::to_string(c.mm.size()) + " values from " + shown(release_s) +
                      " s on, at least " + std::to_string(kMinValues) + " are needed",
                  "measure longer or more often, or let the release be earlier");
    table.values += c.mm.size();
    fit.span_s = std::max(fit.span_s, c.time_s.back());
    for (std::size_t i = 1; i < c.time_s.size(); ++i) between.push_back(c.time_s[i] - c.time_s[i - 1]);
    double mean = 0, largest = 0;
    for (const double u : c.mm) mean += u / static_cast<double>(c.mm.size());
    for (const double u : c.mm) {
      farthest = std::max(farthest, std::abs(u));
      squares += (u - mean) * (u - mean);
      largest = std::max(largest, std::abs(u - mean));
    }
    fit.largest_mm.push_back(largest);
  }
  if (fit.used.channels.empty()) throw Error(ExitCode::usage, "nothing was measured");
  fit.interval_s = upper_median(std::move(between));
  table.size_mm = std::sqrt(squares / static_cast<double>(table.values));
  if (!(table.size_mm > 1e-12 * farthest))
    throw Error(ExitCode::usage, "nothing moves in what was measured", "the displacements are all the same");
  return table;
}

/// Where a load holds the body before it is let go.
struct Plucked {
  std::vector<Vec3> points_mm;
  double moment = 0;   ///< mass times the square of the way, over all points
  double seen_mm = 0;  ///< the most that a channel sees of it
};

Plucked plucked_by(const TissueModel& model, const TissueLoad& pluck, std::span<const std::uint32_t> fixed,
                   std::span<const Slider> sliders, const MeasuredMotion& used, double density_kg_m3,
                   const Context& context) {
  EquilibriumSolver solver(model, model.rest(), pluck);
  const std::vector<Vec3>& rest = model.rest();
  Plucked to;
  to.points_mm = rest;
  for (const TissueLoad::Moved& m : pluck.moved) {
    for (std::size_t a = 0; a < 3; ++a) to.points_mm[m.point][a] += (m.held >> a & 1) != 0 ? m.by_mm[a] : 0;
  }
  const Equilibrium at = solver.solve(model, to.points_mm, pluck.forces_n, {}, context);
  if (!at.converged)
    throw Error(ExitCode::failed, "the body does not come to rest where it is plucked to: " + at.why,
                "make the load smaller");
  require_held(model, model.rest(), fixed, sliders);
  to.points_mm = at.points_mm;
  const std::vector<double> mass = masses(model, density_kg_m3);
  double largest = 0;
  for (std::size_t p = 0; p < rest.size(); ++p) {
    const Vec3 by = to.points_mm[p] - rest[p];
    to.moment += mass[p] * dot(by, by);
    largest = std::max(largest, length(by));
  }
  if (!(to.moment > 0)) throw Error(ExitCode::usage, "the load plucks nothing: no point moves under it");
  for (const auto& c : used.channels)
    to.seen_mm = std::max(to.seen_mm, std::abs(dot(to.points_mm[c.point] - rest[c.point], c.along)));
  if (!(to.seen_mm > 1e-6 * largest))
    throw Error(ExitCode::usage, "the load does not move what was measured (" + used.channels.front().name + ")",
                "check the point, the direction and which load plucked it");
  return to;
}

double hz_of_four_swings(const Release& release, const MeasuredMotion& used, double guess_hz) {
  const Trace t = release.run(Stepping::explicit_steps, 0, 1, 4 / guess_hz);
  MeasuredMotion even = used;
  for (auto& c : even.channels) {
    c.time_s.clear();
    for (int i = 0; i < 160; ++i) c.time_s.push_back(i / (40 * guess_hz));
    c.mm.assign(c.time_s.size(), 0);
  }
  return swing_of(as_measured(t, even), guess_hz / 3, 2 * guess_hz).hz;
}

void need_values_close_enough(const DampingFit& fit, const DampingOptions& options) {
  if (fit.interval_s > 0.5 / fit.model_hz)
    throw Error(ExitCode::usage,
                "values " + shown(1000 * fit.interval_s) + " ms apart tell frequencies up to " +
                    shown(0.5 / fit.interval_s) + " Hz, the body swings with " + shown(fit.model_hz) +
                    " Hz (by the problem's stiffness and density)",
                "measure more often, or mend young_kpa and the density where they are far off");
  if (options.fit_stiffness && fit.span_s * fit.model_hz < kMinSwings)
    throw Error(ExitCode::usage,
                "the table holds " + shown(fit.span_s) + " s from the release on, " + shown(fit.span_s * fit.model_hz) +
                    " swings of the body's " + shown(fit.model_hz) + " Hz; " + format_number(kMinSwings) +
                    " are needed",
                "measure longer, or mend young_kpa and the density where they are far off");
}

void need_swings(const DampingFit& fit) {
  if (!fit.measured.swings)
    throw Error(
        ExitCode::usage,
        "what was measured does not swing (or not above its noise): damping and stiffness cannot be separated from "
        "each "
        "other",
        "if the stiffness is known, leave it as it is: --no-fit-stiffness; else measure something that swings");
  if (fit.measured.hz * fit.span_s < kMinSwings)
    throw Error(ExitCode::usage,
                "the table holds " + shown(fit.measured.hz * fit.span_s) + " swings (" + shown(fit.measured.hz) +
                    " Hz in " + shown(fit.span_s) + " s); " + format_number(kMinSwings) + " are needed",
                "measure longer");
}

/// Where the fit begins.
struct DampingBegin {
  double damping_per_s = 0, stiffness_times = 1;
  double w0 = 0;  ///< radians a second of the undamped swing
};

// What the steps do to a single swing, in closed form.
DampingBegin begin_of(const DampingFit& fit, const DampingOptions& options) {
  const double h = options.step_s, decay = std::max(0.0, fit.measured.decay_per_s), w = kTurn * fit.measured.hz;
  const double w0 = fit.measured.swings ? std::hypot(w, decay) : kTurn * fit.model_hz;
  DampingBegin begin{2 * decay, std::pow(w0 / (kTurn * fit.model_hz), 2), w0};
  if (fit.measured.swings && options.stepping == Stepping::implicit_steps) {
    // Backward Euler: 1 / |z|^2 = 1 + ch + (wh)^2, and the angle of z is the swing's.
    const double root = std::exp(h * decay), ch = 2 * (root * std::cos(h * w) - 1);
    begin.damping_per_s = ch / h;
    begin.stiffness_times = std::max(1e-3, (root * root - 1 - ch) / (h * h)) / std::pow(kTurn * fit.model_hz, 2);
    if (!(begin.damping_per_s > -0.2 * decay) || h * w > 0.5 * std::numbers::pi) {
      const double taken = std::log1p(h * h * w * w) / (2 * h);
      throw Error(ExitCode::usage,
                  "steps of " + shown(1000 * h) + " ms alone let the swing die down by " + shown(taken) +
                      " /s; measured were " + shown(decay) + " /s",
                  decay > 0 ? "take steps of at most " + shown(1000 * decay / (w * w)) +
                                  " ms, or explicit ones, which take nothing away"
                            : "take explicit steps, which take nothing away");
    }
    begin.damping_per_s = std::max(0.0, begin.damping_per_s);
  }
  if (!options.fit_stiffness) begin.stiffness_times = 1;
  return begin;
}

/// What parameters of the fit are in units of.
struct DampingScales {
  double damping_per_s = 1, w0 = 1, plucked_by = 1;
};

// Ceres, from `p` on; those of `held` stay as they are.
void minimize(ceres::CostFunction* cost, std::vector<double>& p, const std::vector<int>& held, int iterations,
              DampingFit& fit) {
  ceres::Problem::Options borrows;
  borrows.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(borrows);
  problem.AddResidualBlock(cost, nullptr, p.data());
  if (!held.empty()) problem.SetManifold(p.data(), new ceres::SubsetManifold(static_cast<int>(p.size()), held));
  problem.SetParameterLowerBound(p.data(), kDamping, 0);
  problem.SetParameterLowerBound(p.data(), kStiffness, p[kStiffness] - 2);
  problem.SetParameterUpperBound(p.data(), kStiffness, p[kStiffness] + 2);
  problem.SetParameterLowerBound(p.data(), kRelease, -0.25 * kTurn);
  problem.SetParameterUpperBound(p.data(), kRelease, 0.25 * kTurn);
  ceres::Solver::Options o;
  o.linear_solver_type = ceres::DENSE_QR;
  o.max_num_iterations = iterations;
  o.function_tolerance = 1e-7;
  o.parameter_tolerance = 1e-6;
  o.num_threads = 1;
  o.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(o, &problem, &summary);
  if (!summary.IsSolutionUsable()) throw Error(ExitCode::failed, "no damping was found: " + summary.message);
  fit.converged = summary.termination_type == ceres::CONVERGENCE;
  if (!fit.converged) fit.why = summary.message;
}

// What is left after the fit, and how sure it is.
void tell_fit(const ceres::CostFunction& cost, const std::vector<double>& p, const std::vector<int>& held,
              const MotionTable& table, const DampingScales& at, double release_s, DampingFit& fit) {
  const std::size_t width = p.size();
  std::vector<double> residuals(table.values), jacobian(table.values * width);
  double* rows[1] = {jacobian.data()};
  const double* const at_p[1] = {p.data()};
  cost.Evaluate(at_p, residuals.data(), rows);
  std::vector<Eigen::Index> free;
  for (std::size_t i = 0; i < width; ++i) {
    if (std::find(held.begin(), held.end(), static_cast<int>(i)) == held.end())
      free.push_back(static_cast<Eigen::Index>(i));
  }
  const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> > all(
      jacobian.data(), static_cast<Eigen::Index>(table.values), static_cast<Eigen::Index>(width));
  const auto m = static_cast<Eigen::Index>(free.size());
  Eigen::MatrixXd information(m, m);
  for (Eigen::Index i = 0; i < m; ++i)
    for (Eigen::Index j = 0; j < m; ++j)
      information(i, j) = all.col(free[static_cast<std::size_t>(i)]).dot(all.col(free[static_cast<std::size_t>(j)]));
  const Eigen::MatrixXd inverse = information.ldlt().solve(Eigen::MatrixXd::Identity(m, m));
  double left = 0, next = 0;
  std::size_t row = 0;
  for (const auto& c : fit.used.channels) {
    fit.fitted_mm.emplace_back();
    for (std::size_t i = 0; i < c.mm.size(); ++i, ++row) {
      left += residuals[row] * residuals[row];
      if (i > 0) next += residuals[row] * residuals[row - 1];
      fit.fitted_mm.back().push_back(c.mm[i] + table.size_mm * residuals[row]);
    }
  }
  fit.residual_share = std::sqrt(left / static_cast<double>(table.values));
  fit.correlation = left > 0 ? std::clamp(next / left, -0.99, 0.99) : 0;
  const double freedom = std::max(1.0, static_cast<double>(table.values) - static_cast<double>(m));
  const double variance = left / freedom * (fit.correlation > 0 ? (1 + fit.correlation) / (1 - fit.correlation) : 1);
  const double wide = statistics::student_quantile(0.975, freedom);
  const auto error = [&](std::size_t parameter) {
    const auto place = std::find(free.begin(), free.end(), static_cast<Eigen::Index>(parameter));
    if (place == free.end()) return 0.0;
    const auto i = place - free.begin();
    return std::sqrt(std::max(0.0, inverse(i, i)) * variance);
  };
  const double c_error = wide * error(kDamping) * at.damping_per_s, c = p[kDamping] * at.damping_per_s;
  fit.damping_per_s = {c, std::max(0.0, c - c_error), c + c_error};
  const double s_error = wide * error(kStiffness);
  fit.stiffness_times = {std::exp(p[kStiffness]), std::exp(p[kStiffness] - s_error), std::exp(p[kStiffness] + s_error)};
  const double t_error = wide * error(kRelease) / at.w0, t = release_s + p[kRelease] / at.w0;
  fit.release_s = {t, t - t_error, t + t_error};
  fit.amplitude_times = p[kAmplitude] * at.plucked_by;
  for (std::size_t k = 0; k < fit.used.channels.size(); ++k) {
    const double per_s = table.size_mm / fit.span_s;
    fit.drift_mm_per_s.push_back(p[kOfChannels + 2 * k + 1] * per_s);
    fit.drift_error_mm_per_s.push_back(error(kOfChannels + 2 * k + 1) * per_s);
  }
}

}  // namespace

DampingFit fit_damping(const TissueModel& model, const TissueLoad& pluck, std::span<const std::uint32_t> fixed,
                       std::span<const Slider> sliders, const MeasuredMotion& motion, const DampingOptions& options,
                       const Context& context) {
  if (!(options.density_kg_m3 > 0)) throw Error(ExitCode::usage, "tissue needs a density above 0");
  if (options.stepping == Stepping::implicit_steps && !(options.step_s > 0))
    throw Error(ExitCode::usage, "steps in time need a length above 0");
  if (!pluck.contacts.empty())
    throw Error(ExitCode::usage, "a body that rests against something does not swing freely",
                "choose a load without contacts");
  for (const auto& c : motion.channels) {
    if (c.point >= model.point_count())
      throw Error(ExitCode::usage, c.name + ": there is no point " + std::to_string(c.point));
  }
  DampingFit fit;
  fit.used = from_release(motion, options.release_s);
  auto& used = fit.used;
  const MotionTable table = look_at_table(fit, options.release_s);
  const std::vector<Vec3>& rest = model.rest();
  const Plucked plucked = plucked_by(model, pluck, fixed, sliders, used, options.density_kg_m3, context);

  // The frequency of the body as it stands: J. Rayleigh's quotient of the shape, then what its channels do in four
  // swings.
  Release release(model, fixed, sliders, used.channels, options, context);
  const double guess_hz = std::sqrt(2 * total_energy(model, plucked.points_mm) / plucked.moment) / kTurn;
  const auto pluck_by = [&](double times) {
    std::vector<Vec3> x = rest;
    for (std::size_t p = 0; p < rest.size(); ++p) x[p] += (plucked.points_mm[p] - rest[p]) * times;
    return x;
  };
  const double gently =
      std::min(1.0, 1e-2 * fit.largest_mm.front() / plucked.seen_mm);  // small, so that it is that of small motion
  release.start = pluck_by(gently);
  fit.model_hz = hz_of_four_swings(release, used, guess_hz);
  ++fit.simulations;
  context.progress(0.1, "fitting");
  need_values_close_enough(fit, options);
  // Not slower than half a swing in the table, where a drift would be taken for one.
  fit.measured =
      swing_of(used, std::max(fit.model_hz / 8, 0.5 / fit.span_s), std::min(8 * fit.model_hz, 0.475 / fit.interval_s));
  if (options.fit_stiffness) need_swings(fit);

  const DampingBegin begin = begin_of(fit, options);
  const double w0 = begin.w0, size = table.size_mm;
  double damping = begin.damping_per_s;
  const double scale = std::max(2 * std::max(0.0, fit.measured.decay_per_s), 0.02 * w0);
  const bool fit_release = options.fit_release && fit.measured.swings;
  const double seconds = fit.span_s + 0.5 * kTurn / w0;
  std::vector<double> tried{damping};
  if (!fit.measured.swings) {
    tried.clear();
    for (double share = 0.05; share < 200; share *= 1.6) tried.push_back(share * w0);
  }
  Linear best;
  double later = 0;
  for (const double c : tried) {
    const Trace t = release.run(options.stepping, c, begin.stiffness_times, seconds);
    ++fit.simulations;
    if (!t.finite) continue;
    for (int n = -6; n <= 6; ++n) {
      if (n != 0 && !fit_release) continue;
      const Linear l = linear_fit(t, used, 0.04 * n * kTurn / w0, size, fit.span_s);
      if (l.left >= best.left) continue;
      best = l;
      damping = c;
      later = 0.04 * n * kTurn / w0;
    }
  }
  if (best.left > 1e299)
    throw Error(ExitCode::failed, "the model goes nowhere when it is let go", "make the load smaller");
  // As far as it really was plucked: large motion has another frequency than small one.
  double times = std::clamp(best.amplitude * gently, -1e6, 1e6);
  if (times == 0) times = gently;
  release.start = pluck_by(times);
  if (model.inverted(release.start) > 0) {
    times = std::copysign(gently, times);
    release.start = pluck_by(times);
  }
  std::vector<double> p{damping / scale, std::log(begin.stiffness_times), later * w0, best.amplitude * gently / times};
  p.insert(p.end(), best.of_channels.begin(), best.of_channels.end());
  std::vector<int> held;
  if (!options.fit_stiffness) held.push_back(kStiffness);
  if (!fit_release) held.push_back(kRelease);

  DampingCost cost(release, options.stepping, used, scale, w0, size, fit.span_s, context);
  minimize(&cost, p, held, options.iterations, fit);
  tell_fit(cost, p, held, table, {scale, w0, times}, options.release_s, fit);

  // How much of the decay is the steps' own.
  const double hz = fit.measured.swings ? fit.measured.hz : fit.model_hz;
  const auto swing_with = [&](double with, Trace& trace) {
    trace = release.run(options.stepping, with, fit.stiffness_times.value, seconds);
    ++fit.simulations;
    return swing_of(as_measured(trace, used), hz / 3, std::min(3 * hz, 0.475 / fit.interval_s));
  };
  Trace trace;
  fit.model = swing_with(p[kDamping] * scale, trace);
  fit.step_s = trace.step_s;
  fit.undamped = swing_with(0, trace);
  fit.undamped_swings = fit.undamped.swings;
  fit.simulations += cost.simulations;
  return fit;
}

#endif

}  // namespace osteo::inline simulation
