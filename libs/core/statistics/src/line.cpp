#include "osteo/core/statistics/curves.h"

#include <cmath>

#include "check.h"
#include "osteo/core/statistics/basics.h"

namespace osteo::statistics {

Interval mean_interval(std::span<const double> values, double level) {
  need_level(level);
  need_finite(values, "the values");
  if (values.size() < 2) return {};
  const double n = static_cast<double>(values.size()), m = mean(values);
  const double half = student_quantile(0.5 + level / 2, n - 1) * std::sqrt(variance(values) / n);
  return {m - half, m + half};
}

FittedLine fitted_line(std::span<const double> x, std::span<const double> y, double level) {
  need_same_size(x.size(), y.size());
  need_finite(x, "x");
  need_finite(y, "y");
  need_level(level);
  FittedLine line;
  line.level = level;
  line.n = static_cast<double>(x.size());
  if (x.size() < 3) return line;
  line.mean_x = mean(x);
  const double mean_y = mean(y);
  double xy = 0, rest = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    line.sum_xx += (x[i] - line.mean_x) * (x[i] - line.mean_x);
    xy += (x[i] - line.mean_x) * (y[i] - mean_y);
  }
  if (line.sum_xx <= 0) return line;
  line.slope = xy / line.sum_xx;
  line.intercept = mean_y - line.slope * line.mean_x;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double e = y[i] - line.intercept - line.slope * x[i];
    rest += e * e;
  }
  line.residual_sd = std::sqrt(rest / (line.n - 2));
  return line;
}

Estimate FittedLine::at(double x) const {
  Estimate e;
  e.value = intercept + slope * x;
  if (!std::isfinite(residual_sd)) return e;
  const double half =
      student_quantile(0.5 + level / 2, n - 2) * residual_sd * std::sqrt(1 / n + (x - mean_x) * (x - mean_x) / sum_xx);
  e.interval = {e.value - half, e.value + half};
  return e;
}

}  // namespace osteo::statistics
