#include "osteo/simulation/tissue/measured.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>

#include "osteo/core/base/error.h"
#include "osteo/core/base/order.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/tet_mesh.h"
#include "surface_goal.h"

namespace osteo::inline simulation {

using namespace tissue;

BodySurface boundary_surface(const TissueModel& model) {
  TetMesh mesh;
  for (const Vec3& p : model.rest()) mesh.points_mm.push_back(to_floats(p));
  for (const auto& t : model.tets()) mesh.tets.push_back(t);
  std::vector<std::uint32_t> point_of;
  const TriMesh skin = boundary_of(mesh, &point_of);
  BodySurface surface;
  for (const std::uint32_t p : point_of) {
    surface.corners.push_back({p, p, p, p});
    surface.weights.push_back({1, 0, 0, 0});
  }
  surface.triangles = skin.triangles;
  return surface;
}

MeasuredError measured_error(const TissueModel& model, const BodySurface& surface, const MeasuredPoints& view,
                             std::span<const Vec3> shape, bool find_pose) {
  const Context context;
  SurfaceGoal goal(model, surface, {&view, 1}, find_pose, 5000, context);
  std::vector<double> own(goal.own()), r(goal.rows());
  goal.align(shape, own.data());
  goal.residuals(shape, own.data(), r.data());
  return goal.error(0, shape);
}

#ifndef OSTEO_WITH_CERES

MeasuredCalibration calibrate_measured(TissueModel&, const BodySurface&, std::span<const MeasuredCase>,
                                       const MeasuredOptions&, const Context&) {
  throw Error(ExitCode::failed, "this build cannot calibrate: it was made without Ceres",
              "build with -DOSTEO_CERES=ON");
}

#else

namespace {

using DenseMatrix = Eigen::MatrixXd;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Clock = std::chrono::steady_clock;

constexpr double kUsed = 0.8;  // share of the points, the nearest, that the level is found by: the others may be astray
constexpr int kMaxRounds = 6;
constexpr double kStray = 4;                 // noises
const double kFactorBefore = std::log(5.0);  // what nobody knows of a body's stiffness, one standard deviation
const double kClassBefore = std::log(1.5);   // and of one kind of constraint over another
const double kFacesBefore = std::log(5.0);   // of faces, which the closed form has none of

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

// Goals of several loads, and where their bodies rest with all of the closed form times one factor.
class Level {
 public:
  Level(const TissueModel& model, std::span<const MeasuredCase> cases, std::span<SurfaceGoal* const> goals,
        const CalibrateOptions& options, const Context& context)
      : model_(model),
        cases_(cases),
        goals_(goals),
        options_(options),
        context_(context),
        solver_(model, model.rest(), cases.front().load) {
    for (const SurfaceGoal* g : goals) own.emplace_back(g->own());
    rest = off({cases.size(), model.rest()}, own);
  }

  double rest = 0;                        // mean square distance when nothing moves
  std::vector<std::vector<double> > own;  // poses there
  int solves = 0;
  double solve_s = 0;  // of all loads, once

  struct At {
    double log = 0, off = 1e300;
    std::vector<std::vector<Vec3> > shapes;
    std::vector<std::vector<double> > own;
  };
  // From the stiffest down, since a body that is too soft may find no rest; then between.
  At find() {
    At at{0, 1e300, {cases_.size(), model_.rest()}, own}, best;
    int worse = 0;
    for (double log = std::min(4.0, options_.most_log); log >= options_.least_log && worse < 2; log -= 1) {
      at.log = log;
      if (!solve(at)) break;
      worse = at.off < best.off ? 0 : worse + 1;
      if (at.off < best.off) best = at;
    }
    constexpr double kGolden = 0.381966;
    double lo = best.log - 1, hi = best.log + 1;
    for (int n = 0; n < 10 && best.off < 1e299; ++n) {
      // A step into the wider side.
      At next = best;
      next.log += hi - best.log > best.log - lo ? kGolden * (hi - best.log) : -kGolden * (best.log - lo);
      const auto begin = Clock::now();
      const bool rests = solve(next);
      solve_s = seconds_since(begin);
      if (rests && next.off < best.off) {
        (next.log > best.log ? lo : hi) = best.log;
        best = std::move(next);
      } else {
        (next.log > best.log ? hi : lo) = next.log;
      }
    }
    return best;
  }

  bool solve(At& at) {
    TissueModel model = model_;
    const double f = std::exp(at.log);
    model.scale({f, f, 0, f});
    for (std::size_t n = 0; n < cases_.size(); ++n) {
      const Equilibrium e = solver_.solve(model, at.shapes[n], cases_[n].load.forces_n, options_.equilibrium, context_);
      ++solves;
      if (!e.converged) return false;
      at.shapes[n] = e.points_mm;
    }
    at.off = off(at.shapes, at.own);
    return true;
  }

  // Mean square of the nearest points, each load's alike.
  double off(const std::vector<std::vector<Vec3> >& shapes, std::vector<std::vector<double> >& poses) const {
    double sum = 0;
    for (std::size_t n = 0; n < goals_.size(); ++n) {
      goals_[n]->align(shapes[n], poses[n].data());
      std::vector<double> r(goals_[n]->rows());
      goals_[n]->residuals(shapes[n], poses[n].data(), r.data());
      std::vector<double> squares = goals_[n]->squares();
      const auto used = static_cast<std::ptrdiff_t>(kUsed * static_cast<double>(squares.size()));
      std::nth_element(squares.begin(), squares.begin() + used, squares.end());
      for (std::ptrdiff_t i = 0; i < used; ++i) sum += squares[static_cast<std::size_t>(i)] / static_cast<double>(used);
    }
    return sum / static_cast<double>(goals_.size());
  }

 private:
  const TissueModel& model_;
  std::span<const MeasuredCase> cases_;
  std::span<SurfaceGoal* const> goals_;
  const CalibrateOptions& options_;
  const Context& context_;
  EquilibriumSolver solver_;
};

// Of a view, at the fitted shape.
void describe(const SurfaceGoal& goal, std::size_t k, std::span<const Vec3> rest, std::span<const Vec3> shape,
              MeasuredView& view) {
  const SurfaceGoal::View& v = goal.views()[k];
  view.noise_mm = v.sigma_mm;
  view.after = goal.error(k, shape);
  const std::size_t n = v.drawn.size();
  std::vector<double> apart(n, 1e300);
  std::vector<bool> stray(n);
  for (std::size_t p = 0; p < n; ++p) {
    stray[p] = length(goal.left(k, p)) > kStray * v.sigma_mm * v.weight[p] * (v.markers() ? std::sqrt(3.0) : 1);
    view.rejected += stray[p] ? 1 : 0;
  }
  double with = 0, alone = 0;
  for (std::size_t p = 0; p < n; ++p) {
    if (stray[p]) continue;
    std::size_t near = n;
    for (std::size_t q = 0; q < n; ++q) {
      if (q == p || stray[q]) continue;
      const Vec3 d = goal.placed(k, p) - goal.placed(k, q);
      if (const double square = dot(d, d); square < apart[p]) {
        apart[p] = square;
        near = q;
      }
    }
    if (near == n) continue;
    with += dot(goal.left(k, p), goal.left(k, near));
    alone += dot(goal.left(k, p), goal.left(k, p));
  }
  view.correlation = alone > 0 ? std::clamp(with / alone, -0.9, 0.9) : 0;
  if (v.markers()) return;
  const double spacing = std::sqrt(upper_median(std::move(apart)));
  const std::vector<Vec3> x = goal.moved(shape), x0 = goal.moved(rest);
  std::vector<double> by, area, reach;
  std::vector<Vec3> middle, facing;
  double most = 0;
  for (const auto& t : goal.surface().triangles) {
    const Vec3 a = x[t[0]], b = x[t[1]], c = x[t[2]];
    middle.push_back((a + b + c) / 3);
    by.push_back(length(middle.back() - (x0[t[0]] + x0[t[1]] + x0[t[2]]) / 3));
    facing.push_back(cross(b - a, c - a));
    area.push_back(length(facing.back()) / 2);
    reach.push_back(std::max({2 * spacing, 0.6 * length(b - a), 0.6 * length(c - b), 0.6 * length(a - c)}));
    most = std::max(most, by.back());
  }
  double seen = 0, whole = 0;
  for (std::size_t t = 0; t < middle.size(); ++t) {
    if (by[t] < 0.1 * most) continue;
    whole += area[t];
    for (std::size_t p = 0; p < n; ++p) {
      // Not one round the corner.
      if (stray[p] || length(goal.placed(k, p) - middle[t]) > reach[t] ||
          !(dot(facing[goal.nearest(k, p)], facing[t]) > 0.7 * length(facing[goal.nearest(k, p)]) * length(facing[t])))
        continue;
      seen += area[t];
      break;
    }
  }
  view.seen_share = whole > 0 ? seen / whole : 0;
}

// One row each, in the order of loads; `plain`: shapes with the closed form as the problem has it, where there are any.
std::vector<MeasuredView> views_of(std::span<const MeasuredCase> cases, std::span<SurfaceGoal* const> goals,
                                   const std::vector<std::vector<Vec3> >* plain) {
  std::vector<MeasuredView> views;
  for (std::size_t n = 0; n < cases.size(); ++n) {
    for (std::size_t k = 0; k < cases[n].views.size(); ++k) {
      MeasuredView view;
      view.name = cases[n].views[k].name;
      view.load = n;
      view.markers = goals[n]->views()[k].markers();
      view.points = cases[n].views[k].points_mm.size();
      view.drawn = goals[n]->views()[k].drawn.size();
      if (plain != nullptr) view.before = goals[n]->error(k, (*plain)[n]);
      views.push_back(view);
    }
  }
  return views;
}

void tell_estimate(std::size_t rows, std::size_t width, double seconds, const Context& context) {
  const std::string reported = std::to_string(rows) + " distances and " + std::to_string(width) +
                               " parameters: the fit takes about " + format_number(std::max(1.0, std::round(seconds))) +
                               " s";
  if (seconds > 30) {
    context.warn(reported);
  } else {
    context.info(reported);
  }
}

/// Fits until the noise stays. `at`: parameters, those that it begins with and ends at. Returns how often it was
/// fitted.
int fit_until_the_noise_stays(Fit& fit, std::span<SurfaceGoal* const> goals, std::vector<double>& at,
                              const std::function<void()>& evaluate, const CalibrateOptions& options,
                              const Context& context) {
  for (int round = 1;; ++round) {
    Descent d = descend(fit, at, options, context);
    if (!d.usable)
      throw Error(ExitCode::failed,
                  "no factors were found with which the model comes to rest under these loads: " + d.why,
                  "make the loads smaller");
    at = d.parameters;
    fit.result.converged = d.converged;
    fit.result.why = d.why;
    fit.result.cost.insert(fit.result.cost.end(), d.costs.begin(), d.costs.end());
    for (auto& step : d.course) {
      step.resize(static_cast<std::size_t>(fit.parameters()));
      fit.result.course.push_back(std::move(step));
    }
    // The last evaluation of a descent need not be where it ended.
    evaluate();
    bool stays = true;
    for (std::size_t n = 0; n < goals.size(); ++n) {
      SurfaceGoal* const goal = goals[n];
      std::vector<double> before;
      for (const auto& v : goal->views()) before.push_back(v.sigma_mm);
      goal->widen_by_noise(fit.shapes()[n]);
      for (std::size_t k = 0; k < before.size(); ++k)
        stays = stays && std::abs(goal->views()[k].sigma_mm - before[k]) < 0.1 * before[k];
    }
    if (stays || round == kMaxRounds) return round;
  }
}

/// What is left at each view, and how its pose was found.
void describe_views(const Fit& fit, std::span<SurfaceGoal* const> goals, const TissueModel& model,
                    const std::vector<double>& at, bool find_pose, std::vector<MeasuredView>& views) {
  for (MeasuredView& view : views) {
    const std::size_t k =
        static_cast<std::size_t>(&view - views.data()) -
        static_cast<std::size_t>(
            std::find_if(views.begin(), views.end(), [&](const MeasuredView& o) { return o.load == view.load; }) -
            views.begin());
    describe(*goals[view.load], k, model.rest(), fit.shapes()[view.load], view);
    if (!find_pose) continue;
    const auto& v = goals[view.load]->views()[k];
    std::size_t own = static_cast<std::size_t>(fit.parameters()) + 6 * k;
    for (std::size_t n = 0; n < view.load; ++n) own += goals[n]->own();
    for (std::size_t a = 0; a < 3; ++a) {
      view.turned_deg[a] = at[own + a] * v.turn * 57.29577951308232;
      view.shifted_mm[a] = at[own + 3 + a] * v.shift;
    }
  }
}

/// Which point of a map, and which kind of constraint, each factor is of.
class FactorPlaces {
 public:
  FactorPlaces(const TissueModel& model, const Fit& fit, const CalibrateOptions& options)
      : fit_(fit), grid_(options.grid), shared_(options.shared_grid) {
    for (const Vec3& p : model.rest())
      for (std::size_t a = 0; a < 3; ++a) {
        lo_[a] = std::min(lo_[a], p[a]);
        hi_[a] = std::max(hi_[a], p[a]);
      }
  }
  [[nodiscard]] bool map() const { return fit_.nodes() > 1; }
  [[nodiscard]] bool shared() const { return shared_; }
  [[nodiscard]] std::size_t node_of(int i) const {
    return fit_.of_map(i) ? fit_.number_of(i) : shared_ ? fit_.nodes() : fit_.number_of(i) / kTissueClasses;
  }
  [[nodiscard]] std::size_t class_of(int i) const {
    return fit_.of_map(i) ? kTissueClasses
           : shared_      ? fit_.number_of(i) - fit_.nodes()
                          : fit_.number_of(i) % kTissueClasses;
  }

  /// Covariance of what nobody knew of the factors (and poses) before.
  [[nodiscard]] DenseMatrix before() const {
    DenseMatrix before = DenseMatrix::Zero(fit_.width(), fit_.width());
    const double far = 0.5 * std::max({hi_.x - lo_.x, hi_.y - lo_.y, hi_.z - lo_.z});
    for (int a = 0; a < fit_.width(); ++a) {
      if (a >= fit_.parameters()) {
        before(a, a) = 1;
        continue;
      }
      for (int b = 0; b < fit_.parameters(); ++b) {
        const double own = class_of(a) == static_cast<std::size_t>(TissueClass::face) ? kFacesBefore : kClassBefore;
        const bool everywhere = shared_ && (!fit_.of_map(a) || !fit_.of_map(b));  // one of them is a class's factor
        if (!everywhere || !map()) {
          const double apart = map() ? length(place(node_of(a)) - place(node_of(b))) / far : 0;
          before(a, b) += kFactorBefore * kFactorBefore * std::exp(-apart);
          if (!fit_.of_map(a) && class_of(a) == class_of(b)) before(a, b) += own * own * std::exp(-apart);
        } else if (a == b) {
          before(a, b) += own * own;
        }
      }
    }
    return before;
  }

 private:
  [[nodiscard]] Vec3 place(std::size_t node) const {
    Vec3 x;
    for (std::size_t a = 0; a < 3; ++a) {
      const auto many = static_cast<std::size_t>(grid_[a]);
      x[a] = many > 1 ? static_cast<double>(node % many) / static_cast<double>(many - 1) * (hi_[a] - lo_[a]) : 0;
      node /= many;
    }
    return x;
  }

  const Fit& fit_;
  std::array<int, 3> grid_;
  bool shared_;
  Vec3 lo_{1e300, 1e300, 1e300}, hi_ = lo_ * -1;
};

/// Of all parameters: noise, widened where neighbours go together, and what pulling put in place of `before`.
DenseMatrix covariance_of(const Fit& fit, std::span<const MeasuredView> views, const std::vector<double>& residuals,
                          const std::vector<double>& jacobian, const DenseMatrix& before) {
  const auto w = static_cast<Eigen::Index>(fit.width());
  const Eigen::Map<const RowMajor> j(jacobian.data(), static_cast<Eigen::Index>(residuals.size()), w);
  const Eigen::Index data_rows = fit.goal_rows();
  DenseMatrix data = DenseMatrix::Zero(w, w), spread = data;
  Eigen::Index row = 0;
  for (const MeasuredView& view : views) {
    const Eigen::Index n = static_cast<Eigen::Index>(view.drawn) * (view.markers ? 3 : 1);
    const DenseMatrix own = j.middleRows(row, n).transpose() * j.middleRows(row, n);
    const double left =
        Eigen::Map<const Eigen::VectorXd>(residuals.data() + row, n).squaredNorm() / static_cast<double>(n);
    // Values on a plane that go with their neighbours count as fewer, by the sum of what each goes with.
    const double wide = view.correlation > 0 ? (1 + view.correlation) / (1 - view.correlation) : 1;
    data += own;
    spread += own * (left * wide * wide);
    row += n;
  }
  const DenseMatrix prior = j.bottomRows(j.rows() - data_rows).transpose() * j.bottomRows(j.rows() - data_rows);
  // A class without a constraint (or faces that carry nothing) must not make it singular.
  DenseMatrix all = data + prior;
  all.diagonal().array() += 1e-14 * all.trace();
  const Eigen::LDLT<DenseMatrix> solved(all);
  const DenseMatrix inner = spread + prior * before * prior;
  return solved.solve(solved.solve(inner).transpose());
}

/// Logarithms of stiffness with their deviations: of all, of groups, of each point of the map.
void tell_stiffness(const TissueModel& model, const Fit& fit, const FactorPlaces& places, const std::vector<double>& at,
                    const DenseMatrix& covariance, const DenseMatrix& before, const MeasuredOptions& options,
                    MeasuredCalibration& result) {
  const auto w = static_cast<Eigen::Index>(fit.width());
  const std::size_t nodes = fit.nodes();
  const Eigen::VectorXd logs = Eigen::Map<const Eigen::VectorXd>(at.data(), w);
  const auto mean_of = [&](const auto& wanted) {
    Eigen::VectorXd share = Eigen::VectorXd::Zero(w);
    double count = 0;
    for (std::size_t c = 0; c < model.constraints().size(); ++c) {
      if (model.constraints()[c].nodes != 2 || !wanted(c)) continue;
      fit.for_parameters(c, [&](std::uint32_t i, double weight) { share[static_cast<Eigen::Index>(i)] += weight; });
      count += 1;
    }
    return Eigen::VectorXd(share / std::max(1.0, count));
  };
  const auto stiffness = [&](const Eigen::VectorXd& share) {
    return LogStiffness{share.dot(logs), std::sqrt(std::max(0.0, share.dot(covariance * share)))};
  };
  const Eigen::VectorXd whole = mean_of([](std::size_t) { return true; });
  result.all = stiffness(whole);
  int groups = 0;
  for (const int g : options.group_of) groups = std::max(groups, g + 1);
  for (int g = 0; g < groups; ++g)
    result.groups.push_back(stiffness(mean_of([&](std::size_t c) { return options.group_of[c] == g; })));
  // A point of the map: its own logarithm, with the classes' as edges have them on the whole.
  result.deviation.assign(nodes, 0);
  result.settled.assign(nodes, 0);
  for (std::size_t node = 0; node < nodes; ++node) {
    Eigen::VectorXd share = Eigen::VectorXd::Zero(w);
    bool there = !places.map();
    for (int i = 0; i < fit.parameters(); ++i) {
      if (fit.of_map(i)) {
        if (fit.number_of(i) != node) continue;
        share[i] = 1;
        there = true;
      } else if (places.shared()) {
        share[i] = whole[i];
      } else if (places.node_of(i) == node && places.class_of(i) < static_cast<std::size_t>(TissueClass::face)) {
        share[i] = 0.5;
        there = true;
      }
    }
    if (!there) continue;
    const double after = share.dot(covariance * share), unknown = share.dot(before * share);
    result.deviation[node] = std::sqrt(std::max(0.0, after));
    result.settled[node] = std::clamp(1 - after / unknown, 0.0, 1.0);
  }
}

}  // namespace

MeasuredCalibration calibrate_measured(TissueModel& model, const BodySurface& surface,
                                       std::span<const MeasuredCase> cases, const MeasuredOptions& options,
                                       const Context& context) {
  const auto begin = Clock::now();
  if (cases.empty()) throw Error(ExitCode::usage, "a calibration needs at least one load");
  MeasuredCalibration result;
  std::vector<std::unique_ptr<Goal> > owned;
  std::vector<SurfaceGoal*> goals;
  std::vector<TissueLoad> loads;
  for (const MeasuredCase& c : cases) {
    if (c.views.empty())
      throw Error(ExitCode::usage, "a load of the calibration has nothing that was measured under it");
    if (c.load.forces_n.empty())
      throw Error(ExitCode::usage,
                  "a load of the calibration has no force: without one no stiffness follows from how far a body moves");
    auto goal = std::make_unique<SurfaceGoal>(model, surface, c.views, options.find_pose, options.max_points, context);
    goals.push_back(goal.get());
    owned.push_back(std::move(goal));
    loads.push_back(c.load);
  }

  // The closed form as the problem has it; the one factor that explains most; both before the loss is known.
  Level level(model, cases, goals, options.calibrate, context);
  Level::At plain{0, 1e300, {cases.size(), model.rest()}, level.own};
  const bool rests = level.solve(plain);
  result.views = views_of(cases, goals, rests ? &plain.shapes : nullptr);
  const Level::At start = level.find();
  result.level_log = start.log;
  if (!(start.off < 0.98 * level.rest))
    throw Error(
        ExitCode::usage,
        "what was measured lies nearest to the body at rest: no stiffness explains it better than one that lets "
        "nothing move",
        "the noise may hide the movement, or it was measured under another load or in another frame than the mesh's");
  std::vector<double> at;
  double size = 0;
  std::size_t rows = 0;
  for (std::size_t n = 0; n < goals.size(); ++n) {
    std::vector<double> r(goals[n]->rows());
    goals[n]->residuals(start.shapes[n], start.own[n].data(), r.data());
    size = std::max(size, goals[n]->error(0, start.shapes[n]).moved_rms_mm);
    rows += goals[n]->rows();
  }
  Fit fit(model, std::move(loads), std::move(owned), start.log, options.calibrate, context);
  fit.result.solves = level.solves;
  for (int i = 0; i < fit.parameters(); ++i) at.push_back(fit.seed(i, kStarts[0]));
  for (const auto& pose : start.own) at.insert(at.end(), pose.begin(), pose.end());
  for (std::size_t n = 0; n < goals.size(); ++n) {
    goals[n]->set_scale(1 / (size * std::sqrt(static_cast<double>(rows))));
    goals[n]->widen_by_noise(start.shapes[n]);
  }

  const auto width = static_cast<std::size_t>(fit.width());
  std::vector<double> residuals(static_cast<std::size_t>(fit.residuals())), jacobian(residuals.size() * width);
  double* first = jacobian.data();
  const auto evaluate = [&] { return fit.evaluate(at.data(), residuals.data(), &first); };
  {
    const auto one = Clock::now();
    evaluate();
    // A few factors end after some steps; a map is a valley, gone along once for the shape and twice more for the
    // noise.
    const double steps = fit.parameters() > 8 ? 25 : 12;
    result.estimate_s =
        steps * (seconds_since(one) + level.solve_s + 2e-9 * static_cast<double>(residuals.size() * width * width));
    tell_estimate(rows, width, result.estimate_s, context);
  }
  result.rounds = fit_until_the_noise_stays(fit, goals, at, evaluate, options.calibrate, context);
  evaluate();

  describe_views(fit, goals, model, at, options.find_pose, result.views);
  const FactorPlaces places(model, fit, options.calibrate);
  const DenseMatrix before = places.before(),
                    covariance = covariance_of(fit, result.views, residuals, jacobian, before);
  tell_stiffness(model, fit, places, at, covariance, before, options, result);

  Calibration& c = fit.result;
  c.parameters = fit.parameters();
  std::vector<double> own(at.begin(), at.begin() + fit.parameters());
  const std::vector<double> full = fit.all_of(own);
  c.log_factors = full;
  std::vector<double> unsure(own.size());
  for (std::size_t i = 0; i < own.size(); ++i) {
    const auto at_i = static_cast<Eigen::Index>(i);
    unsure[i] = std::sqrt(std::max(0.0, covariance(at_i, at_i)));
  }
  c.uncertainty = fit.all_of(unsure);
  if (places.shared()) {
    const std::size_t nodes = fit.nodes();
    c.log_stiffness.assign(full.begin(), full.begin() + static_cast<std::ptrdiff_t>(nodes));
    c.log_factors.clear();
    for (std::size_t p = 0; p < nodes; ++p)
      for (std::size_t k = 0; k < kTissueClasses; ++k) c.log_factors.push_back(full[p] + full[nodes + k]);
  }
  c.seconds = seconds_since(begin);
  result.fit = std::move(c);
  return result;
}

#endif

}  // namespace osteo::inline simulation
