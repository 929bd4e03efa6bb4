// How far two things go together.
#pragma once
#include <span>
#include <vector>

#include "osteo/core/statistics/basics.h"

namespace osteo::statistics {

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
