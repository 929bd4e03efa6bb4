// People who come several times: their sessions are not so many people.
#pragma once
#include <span>
#include <vector>

#include "osteo/core/statistics/compare.h"

namespace osteo::statistics {

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

}  // namespace osteo::statistics
