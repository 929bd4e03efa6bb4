// Intervals that are drawn: of a mean, and of a line through points.
#pragma once
#include <span>

#include "osteo/core/statistics/basics.h"

namespace osteo::statistics {

/// Of a mean, by Student's t; NaN of fewer than two values.
[[nodiscard]] Interval mean_interval(std::span<const double> values, double level = 0.95);

/// Least squares, with Student's interval of the line itself.
struct FittedLine {
  double slope = kUndefined, intercept = kUndefined;  ///< NaN with fewer than three pairs or where x never varies
  double mean_x = 0, sum_xx = 0, n = 0, residual_sd = kUndefined, level = 0.95;
  [[nodiscard]] Estimate at(double x) const;
};
[[nodiscard]] FittedLine fitted_line(std::span<const double> x, std::span<const double> y, double level = 0.95);

}  // namespace osteo::statistics
