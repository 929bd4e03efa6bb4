// How far people who rate the same things agree.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "osteo/core/statistics/basics.h"

namespace osteo::statistics {

/// How a disagreement of categories i and j counts: all alike, |i - j|, or (i - j)^2.
enum class Weights : int { none, linear, quadratic };

/// Cohen's kappa (1960; weighted 1968) of two raters; `categories` are 0 to count - 1, in order where weights are used.
/// Interval by the large-sample variance of Fleiss, Cohen and Everitt (1969), cut at -1 and 1. NaN where chance alone
/// would agree on everything (both raters gave the same one category throughout). O(n + count^2).
struct Kappa {
  double value = kUndefined, standard_error = kUndefined;
  Interval interval;
  double observed = kUndefined, expected = kUndefined;  ///< weighted shares of agreement
};
[[nodiscard]] Kappa cohen_kappa(std::span<const int> a, std::span<const int> b, int categories,
                                Weights weights = Weights::none, double level = 0.95);

/// Ratings of `targets` rows by `raters` columns; nothing where a rater left one out.
class Ratings {
 public:
  Ratings(std::size_t targets, std::size_t raters) : targets_(targets), raters_(raters), values_(targets * raters) {}
  [[nodiscard]] std::size_t targets() const { return targets_; }
  [[nodiscard]] std::size_t raters() const { return raters_; }
  [[nodiscard]] std::optional<double>& at(std::size_t target, std::size_t rater) {
    return values_[target * raters_ + rater];
  }
  [[nodiscard]] const std::optional<double>& at(std::size_t target, std::size_t rater) const {
    return values_[target * raters_ + rater];
  }
  /// Without the rows in which one is missing.
  [[nodiscard]] Ratings complete() const;

 private:
  std::size_t targets_, raters_;
  std::vector<std::optional<double>> values_;
};

/// Share of pairs of raters that gave the same, over targets rated at least twice, each target counting once; Gwet's
/// AC1 (2008), which does not collapse where nearly all get the same, with his variance over targets and Student's t;
/// the mean of all pairs' kappas (Light 1971). `targets` are those rated at least twice. Values are categories: equal
/// or not.
struct CategoryAgreement {
  std::size_t targets = 0, raters = 0;
  double percent = kUndefined;  ///< 0 to 100
  Estimate ac1;
  double ac1_standard_error = kUndefined;
  double kappa = kUndefined, kappa_linear = kUndefined, kappa_quadratic = kUndefined;
  int pairs_without_kappa = 0;  ///< of raters: fewer than two targets in common, or kappa not defined
};
/// `categories` in their order: all that could have been given. Error(usage) for a rating that is none of them, or
/// fewer than two.
[[nodiscard]] CategoryAgreement category_agreement(const Ratings& ratings, std::span<const double> categories,
                                                   double level = 0.95);

/// Intraclass correlations by analysis of variance (Shrout and Fleiss 1979, names of McGraw and Wong 1996), F intervals
/// of the latter. (1,.): raters differ from target to target; (A,.): agreement, the raters are a sample of raters;
/// (C,.): consistency, a rater's being strict throughout does not count. 1: of one rater; k: of the mean of all k.
struct Icc {
  std::size_t targets = 0, raters = 0, left_out = 0;  ///< left out: targets not rated by all
  double ms_targets = kUndefined, ms_raters = kUndefined, ms_error = kUndefined, ms_within = kUndefined;
  Estimate one_1, a_1, c_1, one_k, a_k, c_k;
};
/// Needs two raters and two complete targets, else all NaN; also NaN where nothing varies. O(targets * raters).
[[nodiscard]] Icc icc(const Ratings& ratings, double level = 0.95);

/// Bland and Altman (1986): mean of a - b, limits within which 95 % of differences lie, all with intervals (theirs for
/// the limits, by the approximate standard error sqrt(3 / n) SD). Needs three pairs.
struct BlandAltman {
  std::size_t n = 0;
  Estimate bias, lower, upper;
  double sd = kUndefined;
};
[[nodiscard]] BlandAltman bland_altman(std::span<const double> a, std::span<const double> b, double level = 0.95);

}  // namespace osteo::statistics
