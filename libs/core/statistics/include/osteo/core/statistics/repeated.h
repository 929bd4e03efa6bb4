// People who come several times, or under several conditions: their sessions are not so many people.
#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "osteo/core/statistics/basics.h"
#include "osteo/core/statistics/compare.h"

namespace osteo::statistics {

// -- People who come several times: their sessions are not so many people.

/// Whether a condition matters within people: labels are exchanged inside each person only. The statistic is the mean
/// over people of (mean with the condition, not 0, - mean without); with one pair a person this is the sign-flip test.
/// People who had only one of both are left out.
struct WithinPeople : Permutation {
  std::size_t people = 0, left_out = 0;
};
[[nodiscard]] WithinPeople permutation_within_people(std::span<const double> values, std::span<const int> person,
                                                     std::span<const int> condition,
                                                     const PermutationSettings& settings = {});

/// y = X b + a value of each person + error, both normal; by restricted maximum likelihood (Patterson and Thompson
/// 1971). The likelihood has one parameter left, the ratio of both variances: it is looked at over 12 decades and the
/// best place refined until its slope is 0. Degrees of freedom of each coefficient by Satterthwaite, with the expected
/// information: in balanced data exactly those of the analysis of variance.
struct MixedModel {
  struct Coefficient {
    double value = kUndefined, standard_error = kUndefined, df = kUndefined, t = kUndefined, p = kUndefined;
    Interval interval;
  };
  std::size_t rows = 0, people = 0;
  std::vector<Coefficient> coefficients;  ///< as the columns of X
  double variance_people = kUndefined, variance_error = kUndefined;
  double log_likelihood = kUndefined;  ///< restricted
  [[nodiscard]] double icc() const { return variance_people / (variance_people + variance_error); }
};
/// `design` is rows * columns values, row by row; put a column of ones into it. At most 2000 rows. Error(usage) where
/// columns depend on each other, or there are not more rows than columns and people need at least one to come twice.
/// O(rows^2 * columns) for the degrees of freedom.
[[nodiscard]] MixedModel mixed_model(std::span<const double> y, std::span<const double> design, std::size_t columns,
                                     std::span<const int> person, double level = 0.95);

// -- The same people under several conditions: how far the conditions differ within people.

/// Analysis of variance with repeated measures, one value for each person and condition. Degrees of freedom are
/// corrected by the epsilon of Greenhouse and Geisser (1959), and by that of Huynh and Feldt (1976; at most 1), since
/// differences between conditions may spread unequally. Generalised eta squared: Olejnik and Algina (2003).
struct RepeatedAnova {
  std::size_t people = 0, conditions = 0;
  double f = kUndefined, df_conditions = kUndefined, df_error = kUndefined, p = kUndefined;
  double epsilon_gg = kUndefined, p_gg = kUndefined;
  double epsilon_hf = kUndefined, p_hf = kUndefined;
  double partial_eta2 = kUndefined, generalised_eta2 = kUndefined;
};
/// `values`: people times conditions, a row for each person. At least two of both, else Error(usage). NaN where nothing
/// is left to err. O(people * conditions^2).
[[nodiscard]] RepeatedAnova repeated_anova(std::span<const double> values, std::size_t conditions);

/// Of values that know nothing of each other: several of one person do, and then its p means nothing.
struct OneWayAnova {
  double f = kUndefined, df_groups = kUndefined, df_error = kUndefined, p = kUndefined;
};
/// At least two groups, none empty, else Error(usage).
[[nodiscard]] OneWayAnova one_way_anova(std::span<const std::vector<double>> groups);

/// a - b of the same people, in pairs. p two-sided. `dz`: in standard deviations of the difference, its interval by the
/// non-central t distribution. `g_av`: in the mean standard deviation of both, with Hedges' factor for n - 1; interval
/// as Algina and Keselman (2003).
struct Paired {
  std::size_t people = 0;
  double difference = kUndefined, t = kUndefined, df = kUndefined, p = kUndefined;
  Interval interval;
  Estimate dz, g_av;
};
/// NaN with fewer than two pairs or where all differ alike.
[[nodiscard]] Paired paired(std::span<const double> a, std::span<const double> b, double level = 0.95);

/// Chance that a two-sided paired t test finds an effect of `dz`; exact for normal differences. `people` at least 2.
[[nodiscard]] double power_paired(std::size_t people, double dz, double alpha = 0.05);
/// The fewest people for `power`, at most 100000. NaN for no effect.
[[nodiscard]] double people_needed_paired(double dz, double power = 0.8, double alpha = 0.05);
/// The least dz that is found with `power`, to 1e-6. `people` at least 2.
[[nodiscard]] double detectable_dz(std::size_t people, double power = 0.8, double alpha = 0.05);

}  // namespace osteo::statistics
