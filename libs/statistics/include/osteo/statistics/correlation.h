// How far two things go together.
#pragma once
#include <span>

#include "osteo/statistics/basics.h"

namespace osteo::statistics {

/// `r`: -1 to 1; NaN with fewer than three pairs or where one never varies. p two-sided by Student's t with n - 2, for pairs that know
/// nothing of each other: several sessions of one person do.
struct Correlation {
  std::size_t n = 0;
  double r = kUndefined, p = kUndefined;
  Interval interval;
};
/// Interval by Fisher's transformation; needs four pairs.
[[nodiscard]] Correlation pearson(std::span<const double> x, std::span<const double> y, double level = 0.95);
/// Pearson's of the ranks; no interval: take by_people.
[[nodiscard]] Correlation spearman(std::span<const double> x, std::span<const double> y);

/// Both, with intervals by drawing people with all their pairs: right where people come several times. `person[i]` is who pair i is of.
struct CorrelationByPeople {
  std::size_t pairs = 0, people = 0;
  Correlation pearson, spearman;
  Bootstrap pearson_by_people, spearman_by_people;
};
[[nodiscard]] CorrelationByPeople correlation_by_people(std::span<const double> x, std::span<const double> y, std::span<const int> person,
                                                        const Resampling& resampling = {});

}  // namespace osteo::statistics
