// Two groups of people: whether and by how much they differ, one value for each person.
#pragma once
#include <span>
#include <string_view>

#include "osteo/core/statistics/basics.h"

namespace osteo::statistics {

/// Welch (1947): means without assuming equal spread. Of a - b. Two-sided. NaN with fewer than two in a group or no
/// spread in both.
struct Welch {
  double difference = kUndefined, t = kUndefined, df = kUndefined, p = kUndefined;
  Interval interval;
};
[[nodiscard]] Welch welch(std::span<const double> a, std::span<const double> b, double level = 0.95);

/// Mann and Whitney (1947): `u` counts the pairs in which a is the larger, ties as halves. Two-sided p, twice the
/// smaller tail: exact, ties and all, by counting all ways to share out the ranks, up to 80 people; beyond by the
/// normal approximation with correction for continuity and ties. O(n^2 * rank sum) where exact.
struct MannWhitney {
  double u = kUndefined, p = kUndefined;
  bool exact = false;
};
[[nodiscard]] MannWhitney mann_whitney(std::span<const double> a, std::span<const double> b);

/// A test by exchanging labels: exact when there are at most `limit` ways to do it, else `draws` at random, counted
/// with the one observed (so p is never 0). Two-sided, twice the smaller tail.
struct PermutationSettings {
  std::size_t limit = 200000;
  int draws = 20000;
  std::uint64_t seed = 1;
};
struct Permutation {
  double statistic = kUndefined, p = kUndefined;
  bool exact = false;
  double ways = 0;                 ///< that were looked at
  double smallest_p = kUndefined;  ///< that so few people could give at all
};
/// Difference of means, a - b.
[[nodiscard]] Permutation permutation_of_means(std::span<const double> a, std::span<const double> b,
                                               const PermutationSettings& settings = {});

/// Difference in pooled standard deviations, made smaller for small samples by the exact factor (Hedges 1981); interval
/// by the non-central t distribution, which assumes normal values of equal spread.
[[nodiscard]] Estimate hedges_g(std::span<const double> a, std::span<const double> b, double level = 0.95);

/// Cliff's delta (1993): share of pairs with a larger, less those with a smaller; -1 to 1. Interval: Feng and Cliff
/// (2004), from the unbiased variance; where the groups do not overlap at all, Wilson's bound with the smaller group's
/// size.
[[nodiscard]] Estimate cliffs_delta(std::span<const double> a, std::span<const double> b, double level = 0.95);

}  // namespace osteo::statistics
