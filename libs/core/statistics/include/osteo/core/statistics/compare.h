// Two groups of people: whether and by how much they differ, one value for each person; and from a value to a decision:
// ROC, pass marks, and how many people a study needs.
#pragma once
#include <span>
#include <string_view>
#include <vector>

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

/// How well a value tells two groups apart, larger meaning `positive`. Area by Mann and Whitney's count, its variance
/// by DeLong, DeLong and Clarke-Pearson (1988), interval cut at 0 and 1; where the groups do not overlap at all that
/// variance is 0 and Wilson's bound with the smaller group's size is taken.
struct Roc {
  struct Point {
    double threshold = 0, true_positive = 0, false_positive = 0;  ///< shares, of values >= threshold
  };
  Estimate area;
  double standard_error = kUndefined;
  std::vector<Point> curve;  ///< by falling threshold, from (0, 0) at +infinity to (1, 1)
  Point best;                ///< the largest true - false (Youden 1950); the highest threshold of equal ones
};
/// Both groups need one value at least; the standard error two.
[[nodiscard]] Roc roc(std::span<const double> positive, std::span<const double> negative, double level = 0.95);

/// Contrasting groups (Livingston and Zieky 1982): the pass mark lies where the normal curves of those who can and
/// those who cannot cross, between their means. NaN where they do not, or a group has fewer than two or no spread.
struct PassMark {
  Estimate mark;                                                                ///< interval by bootstrap in each group
  double competent_fail_fitted = kUndefined, other_pass_fitted = kUndefined;    ///< shares, by the curves
  double competent_fail_counted = kUndefined, other_pass_counted = kUndefined;  ///< shares, of those who were there
  bool higher_is_better = true;
};
[[nodiscard]] PassMark contrasting_groups(std::span<const double> competent, std::span<const double> others,
                                          const Resampling& resampling = {});

/// Chance that a comparison of two groups finds a difference, by simulating it: normal people, equal spread, `effect`
/// between the groups in standard deviations of a single session, each person's mean of `sessions` sessions of which
/// `icc` is the person's own share; Welch's t.
struct PowerSettings {
  double effect = 0.8;
  int sessions = 1;  ///< of each person, at least 1
  double icc = 0;    ///< 0 to 1; means nothing for one session
  double alpha = 0.05;
  int draws = 4000;  ///< at least 100
  std::uint64_t seed = 1;
};
/// Groups of at least two. The interval (Wilson) is that of the simulation.
[[nodiscard]] Estimate power_two_groups(std::size_t n_a, std::size_t n_b, const PowerSettings& settings = {});
/// The smallest effect that is found in `power` of such studies, to 0.01. NaN where even 10 is not.
[[nodiscard]] double detectable_effect(std::size_t n_a, std::size_t n_b, double power = 0.8,
                                       const PowerSettings& settings = {});
/// The fewest people in each of two equal groups for `power`, at most 100000. NaN for no effect.
[[nodiscard]] double people_needed(double power = 0.8, const PowerSettings& settings = {});

}  // namespace osteo::statistics
