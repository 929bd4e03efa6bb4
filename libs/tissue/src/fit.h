// What a calibration fits, without whoever minimises it: residuals of all cases and their Jacobian by the factors' logarithms.
#pragma once
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "osteo/tissue/calibrate.h"

namespace osteo::tissue {

/// Which points of a grid a constraint lies between, and how much of each.
struct Share {
  std::array<std::uint32_t, 8> at{};
  std::array<double, 8> weight{};
};

/// Error(usage) where an axis has none.
std::size_t grid_points(const std::array<int, 3>& grid);
/// Of each constraint, by its middle in the body's box.
std::vector<Share> shares(const TissueModel& model, const std::array<int, 3>& grid);

// Logarithms of the classes' factors (axis edges, diagonals, faces, volumes). Faces begin small: the closed form has none. The others lean
// on edges, and on faces.
inline constexpr std::array<double, kTissueClasses> kStarts[3] = {{0, 0, -2, 0}, {0.7, 0.7, -2, 0}, {-0.7, -0.7, 3, -0.7}};

class Fit {
 public:
  Fit(TissueModel& model, std::span<const CalibrationCase> cases, const CalibrateOptions& options, const Context& context);

  [[nodiscard]] int parameters() const { return static_cast<int>(used_.size()); }
  [[nodiscard]] int residuals() const {
    return static_cast<int>(3 * model_.point_count() * cases_.size()) + parameters() + static_cast<int>(neighbours_.size());
  }
  // Where a start begins: logarithms for the classes, beside the level of a map.
  [[nodiscard]] double seed(int parameter, const std::array<double, kTissueClasses>& classes) const {
    return of_map(parameter) ? level_ : classes[static_cast<std::size_t>(kind_of(parameter))];
  }
  [[nodiscard]] double cost(const std::vector<double>& logs);
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
  void find_level();

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
  void lay_grid();

  // H du/dlog_j = - sum over constraints of (share of j) * gradient of its energy, since dk/dlog = k.
  void differentiate(std::size_t n, double* jacobian, std::size_t first_row);

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

}  // namespace osteo::tissue
