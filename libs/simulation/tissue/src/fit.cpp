#include "fit.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/error.h"

namespace osteo::inline simulation::tissue {
namespace {

constexpr double kBorder = 0.3;  // log: differences beyond are taken for borders

// 1 / the size of each case.
std::vector<double> scales_of(const TissueModel& model, std::span<const CalibrationCase> cases) {
  std::vector<double> scales;
  for (const CalibrationCase& c : cases) {
    if (c.truth_mm.size() != model.point_count())
      throw Error(ExitCode::usage, "the truth has " + std::to_string(c.truth_mm.size()) + " points, the model " +
                                       std::to_string(model.point_count()));
    double sum = 0;
    for (std::size_t p = 0; p < c.truth_mm.size(); ++p)
      sum += dot(c.truth_mm[p] - model.rest()[p], c.truth_mm[p] - model.rest()[p]);
    if (!(sum > 0) || !std::isfinite(sum))
      throw Error(ExitCode::usage, "a load of the calibration moves nothing, or its truth is not finite");
    const double rms = std::sqrt(sum / static_cast<double>(c.truth_mm.size()));
    scales.push_back(1 / (rms * std::sqrt(static_cast<double>(c.truth_mm.size() * cases.size()))));
  }
  return scales;
}

class NodeGoal final : public Goal {
 public:
  NodeGoal(std::span<const Vec3> truth, double scale) : truth_(truth), scale_(scale) {}
  [[nodiscard]] std::size_t rows() const override { return 3 * truth_.size(); }
  void residuals(std::span<const Vec3> shape, const double*, double* out) override {
    for (std::size_t p = 0; p < truth_.size(); ++p)
      for (std::size_t a = 0; a < 3; ++a) *out++ = (shape[p][a] - truth_[p][a]) * scale_;
  }
  void along(std::span<const Vec3> du, double* column, std::size_t stride) const override {
    for (std::size_t p = 0; p < truth_.size(); ++p)
      for (std::size_t a = 0; a < 3; ++a, column += stride) *column = du[p][a] * scale_;
  }

 private:
  std::span<const Vec3> truth_;
  double scale_;
};

std::vector<TissueLoad> loads_of(std::span<const CalibrationCase> cases) {
  std::vector<TissueLoad> loads;
  for (const CalibrationCase& c : cases) loads.push_back(c.load);
  return loads;
}

std::vector<std::unique_ptr<Goal>> goals_of(const TissueModel& model, std::span<const CalibrationCase> cases) {
  const std::vector<double> scales = scales_of(model, cases);
  std::vector<std::unique_ptr<Goal>> goals;
  for (std::size_t n = 0; n < cases.size(); ++n)
    goals.push_back(std::make_unique<NodeGoal>(cases[n].truth_mm, scales[n]));
  return goals;
}

}  // namespace

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

Fit::Fit(TissueModel& model, std::vector<TissueLoad> loads, std::vector<std::unique_ptr<Goal>> goals, double level,
         const CalibrateOptions& options, const Context& context)
    : model_(model),
      loads_(std::move(loads)),
      goals_(std::move(goals)),
      options_(options),
      context_(context),
      solver_(model, model.rest(), loads_.front()),
      shape_(loads_.size(), model.rest()),
      level_(level) {
  const auto held = [&](const TissueLoad& load) {
    std::vector<std::uint8_t> axes(model.point_count());
    for (const std::uint32_t p : load.fixed) axes.at(p) = 7;
    for (const Slider& s : load.sliders) axes.at(s.point) = static_cast<std::uint8_t>(axes.at(s.point) | s.held);
    return axes;
  };
  for (const TissueLoad& load : loads_) {
    if (held(load) != held(loads_.front()))
      throw Error(ExitCode::usage, "all loads of a calibration must fix the same points");
  }
  for (const auto& goal : goals_) {
    goal_rows_ += goal->rows();
    owns_ += goal->own();
  }
  lay_grid();
  if (nodes_ == 1 || !options_.shared_grid) class_level_ = level;
}

Fit::Fit(TissueModel& model, std::span<const CalibrationCase> cases, const CalibrateOptions& options,
         const Context& context)
    : Fit(model, loads_of(cases), goals_of(model, cases), 0, options, context) {
  find_level(cases, scales_of(model, cases));
}

double Fit::cost(const std::vector<double>& logs) {
  std::vector<double> r(static_cast<std::size_t>(residuals()));
  if (!evaluate(logs.data(), r.data(), nullptr)) return 1e300;
  double sum = 0;
  for (const double v : r) sum += 0.5 * v * v;
  return sum;
}

void Fit::find_level(std::span<const CalibrationCase> cases, std::span<const double> scale) {
  if (nodes_ == 1 || !options_.shared_grid) return;
  for (int round = 0; round < 3; ++round) {
    model_.scale({std::exp(level_), std::exp(level_), 0, std::exp(level_)});
    double own = 0, both = 0;
    for (std::size_t n = 0; n < cases.size(); ++n) {
      const Equilibrium at = solver_.solve(model_, shape_[n], cases[n].load.forces_n, options_.equilibrium, context_);
      ++result.solves;
      if (!at.converged) return;
      shape_[n] = at.points_mm;
      for (std::size_t p = 0; p < at.points_mm.size(); ++p) {
        const Vec3 u = (at.points_mm[p] - model_.rest()[p]) * scale[n],
                   t = (cases[n].truth_mm[p] - model_.rest()[p]) * scale[n];
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

void Fit::set(const double* logs) {
  std::vector<double> factors(model_.constraints().size());
  for (std::size_t c = 0; c < factors.size(); ++c) {
    double log = 0;
    for_parameters(c, [&](std::uint32_t j, double weight) { log += weight * logs[j]; });
    factors[c] = std::exp(log);
  }
  model_.scale_each(factors);
}

bool Fit::evaluate(const double* logs, double* residuals, double** jacobian_rows) {
  set(logs);
  const std::size_t parameters = used_.size(), wide = parameters + owns_;
  if (jacobian_rows != nullptr)
    std::fill(*jacobian_rows, *jacobian_rows + static_cast<std::size_t>(this->residuals()) * wide, 0.0);
  std::size_t row = 0, own = parameters;
  for (std::size_t n = 0; n < loads_.size(); ++n) {
    const Equilibrium at = solver_.solve(model_, shape_[n], loads_[n].forces_n, options_.equilibrium, context_);
    // Where it is at rest already (the same factors again, for their Jacobian) nothing was solved.
    if (at.iterations > 0) ++result.solves;
    if (!at.converged) {
      // From rest, before giving it up.
      ++result.failed_solves;
      ++result.solves;
      const Equilibrium again =
          solver_.solve(model_, model_.rest(), loads_[n].forces_n, options_.equilibrium, context_);
      if (!again.converged) return false;
      shape_[n] = again.points_mm;
    } else {
      shape_[n] = at.points_mm;
    }
    goals_[n]->residuals(shape_[n], logs + own, residuals + row);
    if (jacobian_rows != nullptr) {
      differentiate(n, *jacobian_rows, row);
      if (goals_[n]->own() > 0) goals_[n]->by_own(*jacobian_rows + row * wide + own, wide);
    }
    row += goals_[n]->rows();
    own += goals_[n]->own();
  }
  // What is a goal's own is held by next to nothing: only where nothing measured says where it lies.
  for (std::size_t i = 0; i < wide; ++i, ++row) {
    const double weight = i < parameters ? pull_of(static_cast<int>(i)) : 1e-4;
    residuals[row] = weight * (logs[i] - (i < parameters ? pull_goal(static_cast<int>(i)) : 0));
    if (jacobian_rows != nullptr) (*jacobian_rows)[row * wide + i] = weight;
  }
  for (const auto& [i, j] : neighbours_) {
    const double weight = options_.smooth / std::sqrt(static_cast<double>(neighbours_.size()));
    // Its square is that of a pseudo-Huber loss: d^2 for small differences, 2 kBorder |d| for large ones.
    const double d = (logs[i] - logs[j]) / kBorder, root = std::sqrt(1 + d * d), value = d * std::sqrt(2 / (root + 1));
    residuals[row] = weight * kBorder * value;
    if (jacobian_rows != nullptr) {
      const double slope = weight * (d != 0 ? d / (root * value) : 1);
      (*jacobian_rows)[row * wide + i] = slope;
      (*jacobian_rows)[row * wide + j] = -slope;
    }
    ++row;
  }
  return true;
}

void Fit::lay_grid() {
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

void Fit::differentiate(std::size_t n, double* jacobian, std::size_t first_row) {
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
      for (std::size_t a = 0; a < nodes.size(); ++a)
        right[k][nodes[a]] -= Vec3{g[3 * a], g[3 * a + 1], g[3 * a + 2]} * weight;
    });
  }
  std::vector<Vec3> du(points);
  const auto wide = static_cast<std::size_t>(width());
  for (std::size_t j = 0; j < parameters; ++j) {
    solver_.back_solve(right[j], du);
    goals_[n]->along(du, jacobian + first_row * wide + j, wide);
  }
}

}  // namespace osteo::inline simulation::tissue
