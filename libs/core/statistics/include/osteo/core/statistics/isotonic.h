// Curves that only rise, or only fall: force by distance to a nerve, say.
#pragma once
#include <span>
#include <vector>

#include "osteo/core/statistics/basics.h"

namespace osteo::statistics {

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

}  // namespace osteo::statistics
