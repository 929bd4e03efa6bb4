// What a calibration fits, without whoever minimises it: residuals of all cases and their Jacobian by the factors'
// logarithms.
#pragma once
#include <array>
#include <cmath>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "osteo/simulation/tissue/calibrate.h"

namespace osteo::inline simulation::tissue {

/// Which points of a grid a constraint lies between, and how much of each.
struct Share {
  std::array<std::uint32_t, 8> at{};
  std::array<double, 8> weight{};
};

/// Error(usage) where an axis has none.
std::size_t grid_points(const std::array<int, 3>& grid);
/// Of each constraint, by its middle in the body's box.
std::vector<Share> shares(const TissueModel& model, const std::array<int, 3>& grid);

// Logarithms of the classes' factors (axis edges, diagonals, faces, volumes). Faces begin small: the closed form has
// none. The others lean on edges, and on faces.
inline constexpr std::array<double, kTissueClasses> kStarts[3] = {
    {0, 0, -2, 0}, {0.7, 0.7, -2, 0}, {-0.7, -0.7, 3, -0.7}};

// What the shape under one load is held against.
class Goal {
 public:
  virtual ~Goal() = default;
  [[nodiscard]] virtual std::size_t rows() const = 0;
  // Parameters that are this load's alone, about 0 and of about 1: where what was measured lies.
  [[nodiscard]] virtual std::size_t own() const { return 0; }
  virtual void residuals(std::span<const Vec3> shape, const double* own, double* out) = 0;
  // What the residuals of the last shape change by when its points move by `du`; `stride` from row to row.
  virtual void along(std::span<const Vec3> du, double* column, std::size_t stride) const = 0;
  virtual void by_own(double* first, std::size_t stride) const {
    static_cast<void>(first);
    static_cast<void>(stride);
  }
};

class Fit {
 public:
  // Against the truth at every point.
  Fit(TissueModel& model, std::span<const CalibrationCase> cases, const CalibrateOptions& options,
      const Context& context);
  // Against goals, one a load; `level`: the logarithm of the factor on all of the closed form that it begins at and is
  // pulled to.
  Fit(TissueModel& model, std::vector<TissueLoad> loads, std::vector<std::unique_ptr<Goal>> goals, double level,
      const CalibrateOptions& options, const Context& context);

  [[nodiscard]] int parameters() const { return static_cast<int>(used_.size()); }
  // With those that are the goals' own.
  [[nodiscard]] int width() const { return static_cast<int>(used_.size() + owns_); }
  [[nodiscard]] int goal_rows() const { return static_cast<int>(goal_rows_); }
  [[nodiscard]] int residuals() const {
    return static_cast<int>(goal_rows_) + width() + static_cast<int>(neighbours_.size());
  }
  // Where a start begins: logarithms for the classes, beside the level of a map.
  [[nodiscard]] double seed(int parameter, const std::array<double, kTissueClasses>& classes) const {
    return of_map(parameter) ? level_ : class_level_ + classes[static_cast<std::size_t>(kind_of(parameter))];
  }
  [[nodiscard]] double cost(const std::vector<double>& logs);
  [[nodiscard]] double pull_goal(int parameter) const { return seed(parameter, kStarts[0]); }
  // Factors of a map and those of the classes are pulled as two families, or many points of a map would leave the
  // classes free.
  [[nodiscard]] double pull_of(int parameter) const {
    const double family = !options_.shared_grid || nodes_ == 1 ? parameters()
                          : of_map(parameter)                  ? parameters() - static_cast<int>(kTissueClasses)
                                                               : kTissueClasses;
    return options_.pull / std::sqrt(family);
  }

  void set(const double* logs);

  // False when a case finds no rest.
  bool evaluate(const double* logs, double* residuals, double** jacobian_rows);

  Calibration result;
  [[nodiscard]] const std::vector<std::vector<Vec3>>& shapes() const { return shape_; }
  // By their full numbers; 0 for those that are not there.
  [[nodiscard]] std::vector<double> all_of(const std::vector<double>& values) const {
    std::vector<double> all(numbers());
    for (std::size_t i = 0; i < used_.size(); ++i) all[used_[i]] = values[i];
    return all;
  }
  [[nodiscard]] std::size_t nodes() const { return nodes_; }
  [[nodiscard]] const std::vector<Share>& share() const { return share_; }
  // The number of a parameter among all_of()'s.
  [[nodiscard]] std::size_t number_of(int parameter) const { return used_[static_cast<std::size_t>(parameter)]; }
  [[nodiscard]] bool of_map(int parameter) const {
    return options_.shared_grid && used_[static_cast<std::size_t>(parameter)] < nodes_;
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

 private:
  // Numbers of parameters: of own grids point times classes plus class; of a shared one the points, then the classes.
  [[nodiscard]] std::size_t numbers() const {
    return options_.shared_grid ? nodes_ + kTissueClasses : nodes_ * kTissueClasses;
  }
  [[nodiscard]] TissueClass kind_of(int parameter) const {
    const std::size_t number = used_[static_cast<std::size_t>(parameter)];
    return static_cast<TissueClass>(options_.shared_grid ? number - nodes_ : number % kTissueClasses);
  }
  void lay_grid();

  // A map starts from, and is pulled towards, the one factor with which the closed form moves as far as the truth.
  void find_level(std::span<const CalibrationCase> cases, std::span<const double> scale);
  // H du/dlog_j = - sum over constraints of (share of j) * gradient of its energy, since dk/dlog = k.
  void differentiate(std::size_t n, double* jacobian, std::size_t first_row);

  TissueModel& model_;
  std::vector<TissueLoad> loads_;
  std::vector<std::unique_ptr<Goal>> goals_;
  std::size_t goal_rows_ = 0, owns_ = 0;
  CalibrateOptions options_;
  const Context& context_;
  EquilibriumSolver solver_;
  std::vector<std::array<std::uint32_t, 2>> neighbours_;  // parameters of the map that lie beside each other
  std::vector<std::vector<Vec3>> shape_;                  // where each case came to rest last
  std::vector<Share> share_;
  static constexpr std::uint32_t kNone = 0xffffffffU;
  std::vector<std::uint32_t> used_, parameter_of_;  // parameter -> number, and back
  std::size_t nodes_ = 1;
  double level_ = 0;        // of a map's points
  double class_level_ = 0;  // of the classes, where there is no map
};

#ifdef OSTEO_WITH_CERES
// From there by a trust region, down to where it ends.
struct Descent {
  bool usable = false, converged = false;
  std::string why;
  double cost = 0;
  std::vector<double> parameters;           // as Fit::width()
  std::vector<double> costs;                // after each accepted step
  std::vector<std::vector<double>> course;  // the parameters there
};
Descent descend(Fit& fit, std::vector<double> start, const CalibrateOptions& options, const Context& context);
#endif

}  // namespace osteo::inline simulation::tissue
