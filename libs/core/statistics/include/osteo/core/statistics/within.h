// The same people under several conditions: how far the conditions differ within people.
#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "osteo/core/statistics/basics.h"

namespace osteo::statistics {

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
