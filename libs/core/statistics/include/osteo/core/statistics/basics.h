// What all statistics here share: intervals, how a value that is not defined is told, random numbers that are the same
// everywhere.
//
// Convention of the whole library: a call that cannot mean anything (sizes that do not fit, a value that is not finite,
// a level outside 0 to 1) throws Error(usage). A statistic that these numbers do not define, such as a correlation with
// what never varies, is NaN.
#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

namespace osteo::statistics {

inline constexpr double kUndefined = std::numeric_limits<double>::quiet_NaN();

/// Both ends NaN where there is none.
struct Interval {
  double lo = kUndefined, hi = kUndefined;
};

/// A value with its interval.
struct Estimate {
  double value = kUndefined;
  Interval interval;
};

/// Sample standard deviation (n - 1); quartiles as type 7 of Hyndman and Fan (1996), as NumPy and R have them by
/// default.
struct Summary {
  std::size_t n = 0;
  double mean = kUndefined, sd = kUndefined, median = kUndefined, q1 = kUndefined, q3 = kUndefined, least = kUndefined,
         most = kUndefined;
};
[[nodiscard]] Summary summarise(std::span<const double> values);
/// Type 7; `share` from 0 to 1. NaN of nothing.
[[nodiscard]] double quantile(std::span<const double> values, double share);
[[nodiscard]] double mean(std::span<const double> values);
/// Divided by n - 1; NaN of fewer than two.
[[nodiscard]] double variance(std::span<const double> values);

/// Ranks from 1, the mean rank for equal values. O(n log n).
[[nodiscard]] std::vector<double> ranks(std::span<const double> values);

/// Wilson's score interval of a share: 0 <= successes <= n. NaN where n is 0.
[[nodiscard]] Interval wilson(double successes, double n, double level = 0.95);

/// Holm's step-down: p values so that the chance of any false alarm among them is held. NaN stays NaN and does not
/// count.
[[nodiscard]] std::vector<double> holm(std::span<const double> p);

/// SplitMix64 (Steele, Lea, Flood 2014): the same numbers on every machine and with every library, unlike the
/// distributions of <random>.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  [[nodiscard]] std::uint64_t bits();
  /// Each of 0 to n - 1 equally often; n > 0.
  [[nodiscard]] std::size_t below(std::size_t n);
  /// In (0, 1), never its ends.
  [[nodiscard]] double uniform();
  /// Standard normal, by inversion.
  [[nodiscard]] double normal();
  /// Fisher and Yates.
  template <class T>
  void shuffle(std::vector<T>& items) {
    for (std::size_t i = items.size(); i > 1; --i) std::swap(items[i - 1], items[below(i)]);
  }

 private:
  std::uint64_t state_;
};

struct Resampling {
  int resamples = 2000;  ///< at least 100
  double level = 0.95;
  std::uint64_t seed = 1;
};
/// Percentile bootstrap over `people`, who are drawn with all that they did: `statistic` gets the indices of those
/// drawn, some several times. Resamples whose statistic is NaN are left out and counted; where they are more than a
/// tenth, there is no interval.
struct Bootstrap {
  Interval interval;
  int left_out = 0;
};
[[nodiscard]] Bootstrap bootstrap(std::size_t people,
                                  const std::function<double(std::span<const std::size_t>)>& statistic,
                                  const Resampling& resampling = {});

// -- Distributions of statistics, by Boost.Math (in one source file: its headers are slow to compile).

[[nodiscard]] double normal_cdf(double z);
[[nodiscard]] double normal_quantile(double share);
/// Two-sided.
[[nodiscard]] double student_p(double t, double df);
[[nodiscard]] double student_quantile(double share, double df);
[[nodiscard]] double chi_squared_quantile(double share, double df);
[[nodiscard]] double fisher_f_quantile(double share, double df1, double df2);
/// The upper tail.
[[nodiscard]] double fisher_f_p(double f, double df1, double df2);
/// The share of the non-central t distribution beyond `critical` on either side.
[[nodiscard]] double student_beyond(double critical, double df, double non_centrality);
/// The non-centrality for which `share` of the non-central t distribution lies below t. NaN where it cannot be found.
[[nodiscard]] double non_centrality(double t, double df, double share);
/// Gamma(df / 2) / (sqrt(df / 2) Gamma((df - 1) / 2)): Hedges' factor. df > 1.
[[nodiscard]] double hedges_factor(double df);

}  // namespace osteo::statistics
