// Lines and monotone curves through points, and how far two things go together.
#pragma once
#include <span>
#include <vector>

#include "osteo/core/statistics/basics.h"

namespace osteo::statistics {

// -- Intervals that are drawn: of a mean, and of a line through points.

/// Of a mean, by Student's t; NaN of fewer than two values.
[[nodiscard]] Interval mean_interval(std::span<const double> values, double level = 0.95);

/// Least squares, with Student's interval of the line itself.
struct FittedLine {
  double slope = kUndefined, intercept = kUndefined;  ///< NaN with fewer than three pairs or where x never varies
  double mean_x = 0, sum_xx = 0, n = 0, residual_sd = kUndefined, level = 0.95;
  [[nodiscard]] Estimate at(double x) const;
};
[[nodiscard]] FittedLine fitted_line(std::span<const double> x, std::span<const double> y, double level = 0.95);

// -- Curves that only rise, or only fall: force by distance to a nerve, say.

enum class Trend : int { rising, falling };

/// A step for each different x, rising; `at` goes straight from one to the next and stays level beyond the ends.
struct MonotoneCurve {
  std::vector<double> x, y;
  /// NaN of an empty curve. O(log n).
  [[nodiscard]] double at(double where) const;
};

/// Least squares among all curves that rise (fall), by pooling adjacent violators (Ayer et al. 1955). `weights` empty:
/// all alike; else > 0. O(n log n).
[[nodiscard]] MonotoneCurve isotonic_mean(std::span<const double> x, std::span<const double> y,
                                          Trend trend = Trend::rising, std::span<const double> weights = {});
/// The same for the quantile `share` (0 < share < 1): least sum of tilted absolute errors (Koenker and Bassett 1978).
/// Exact, by halving the range of values (Stout 2013); of equally good curves the lowest. O(n log n) but for the sort
/// of its halves.
[[nodiscard]] MonotoneCurve isotonic_quantile(std::span<const double> x, std::span<const double> y, double share,
                                              Trend trend = Trend::rising);

// -- How far two things go together.

/// `r`: -1 to 1; NaN with fewer than three pairs or where one never varies. p two-sided by Student's t with n - 2, for
/// pairs that know nothing of each other: several sessions of one person do.
struct Correlation {
  std::size_t n = 0;
  double r = kUndefined, p = kUndefined;
  Interval interval;
};
/// Interval by Fisher's transformation; needs four pairs.
[[nodiscard]] Correlation pearson(std::span<const double> x, std::span<const double> y, double level = 0.95);
/// Pearson's of the ranks; no interval: take by_people.
[[nodiscard]] Correlation spearman(std::span<const double> x, std::span<const double> y);

/// What is left of both once straight lines through `given` are taken away (with a constant), and how far that goes
/// together: as -P_xy / sqrt(P_xx P_yy) of the inverse of their correlation matrix. p by Student's t with n - 2 - k,
/// interval by Fisher's transformation with n - 3 - k, k lists given. r is NaN with fewer than k + 3 rows, where the
/// lists given leave nothing of x or y, or where one of them follows from the others. Error(usage) unless all lists are
/// as long. O(n k^2).
[[nodiscard]] Correlation partial_pearson(std::span<const double> x, std::span<const double> y,
                                          std::span<const std::vector<double>> given, double level = 0.95);
/// The same of the ranks of all of them; the interval is that of Pearson's.
[[nodiscard]] Correlation partial_spearman(std::span<const double> x, std::span<const double> y,
                                           std::span<const std::vector<double>> given, double level = 0.95);

/// Both, with intervals by drawing people with all their pairs: right where people come several times. `person[i]` is
/// who pair i is of.
struct CorrelationByPeople {
  std::size_t pairs = 0, people = 0;
  Correlation pearson, spearman;
  Bootstrap pearson_by_people, spearman_by_people;
};
[[nodiscard]] CorrelationByPeople correlation_by_people(std::span<const double> x, std::span<const double> y,
                                                        std::span<const int> person, const Resampling& resampling = {});

}  // namespace osteo::statistics
