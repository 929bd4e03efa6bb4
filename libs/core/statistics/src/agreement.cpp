#include "osteo/core/statistics/agreement.h"

#include <algorithm>
#include <cmath>

#include "check.h"
#include "osteo/core/statistics/basics.h"

namespace osteo::statistics {

Kappa cohen_kappa(std::span<const int> a, std::span<const int> b, int categories, Weights weights, double level) {
  need_same_size(a.size(), b.size());
  need_level(level);
  if (categories < 2 || categories > 1000) refuse("kappa is of two to a thousand categories");
  for (const auto& list : {a, b}) {
    for (const int c : list) {
      if (c < 0 || c >= categories)
        refuse("category " + std::to_string(c) + " is not below " + std::to_string(categories));
    }
  }
  Kappa k;
  if (a.empty()) return k;
  const auto q = static_cast<std::size_t>(categories);
  const double n = static_cast<double>(a.size());
  std::vector<double> p(q * q), row(q), column(q);
  for (std::size_t i = 0; i < a.size(); ++i)
    p[static_cast<std::size_t>(a[i]) * q + static_cast<std::size_t>(b[i])] += 1 / n;
  for (std::size_t i = 0; i < q; ++i) {
    for (std::size_t j = 0; j < q; ++j) {
      row[i] += p[i * q + j];
      column[j] += p[i * q + j];
    }
  }
  const auto weight = [&](std::size_t i, std::size_t j) {
    const double apart = std::abs(static_cast<double>(i) - static_cast<double>(j)) / static_cast<double>(q - 1);
    return weights == Weights::none ? (i == j ? 1.0 : 0.0) : weights == Weights::linear ? 1 - apart : 1 - apart * apart;
  };
  std::vector<double> row_weight(q),
      column_weight(q);  // of a rating i by the first, j by the second, against the other's shares
  k.observed = k.expected = 0;
  for (std::size_t i = 0; i < q; ++i) {
    for (std::size_t j = 0; j < q; ++j) {
      const double w = weight(i, j);
      k.observed += w * p[i * q + j];
      k.expected += w * row[i] * column[j];
      row_weight[i] += w * column[j];
      column_weight[j] += w * row[i];
    }
  }
  const double room = 1 - k.expected;
  if (room < 1e-12) return k;
  k.value = (k.observed - k.expected) / room;
  double sum = 0;
  for (std::size_t i = 0; i < q; ++i) {
    for (std::size_t j = 0; j < q; ++j) {
      const double d = weight(i, j) - (row_weight[i] + column_weight[j]) * (1 - k.value);
      sum += p[i * q + j] * d * d;
    }
  }
  const double away = k.value - k.expected * (1 - k.value);
  k.standard_error = std::sqrt(std::max(0.0, sum - away * away) / n) / room;
  const double z = normal_quantile(0.5 + level / 2);
  k.interval = {std::max(-1.0, k.value - z * k.standard_error), std::min(1.0, k.value + z * k.standard_error)};
  return k;
}

Ratings Ratings::complete() const {
  std::vector<std::size_t> rows;
  for (std::size_t t = 0; t < targets_; ++t) {
    bool whole = true;
    for (std::size_t r = 0; r < raters_; ++r) whole = whole && at(t, r).has_value();
    if (whole) rows.push_back(t);
  }
  Ratings result(rows.size(), raters_);
  for (std::size_t t = 0; t < rows.size(); ++t) {
    for (std::size_t r = 0; r < raters_; ++r) result.at(t, r) = at(rows[t], r);
  }
  return result;
}

CategoryAgreement category_agreement(const Ratings& ratings, std::span<const double> categories, double level) {
  need_level(level);
  const std::size_t q = categories.size();
  if (q < 2) refuse("agreement is about two categories at least");
  CategoryAgreement result;
  result.raters = ratings.raters();
  std::vector<std::vector<double>> counts;  // a row for each target rated at all
  std::vector<std::vector<int>> category(ratings.raters(), std::vector<int>(ratings.targets(), -1));
  for (std::size_t t = 0; t < ratings.targets(); ++t) {
    std::vector<double> count(q);
    double all = 0;
    for (std::size_t r = 0; r < ratings.raters(); ++r) {
      const auto& given = ratings.at(t, r);
      if (!given) continue;
      const auto found = std::find(categories.begin(), categories.end(), *given);
      if (found == categories.end()) refuse("a rating is not one of the categories");
      category[r][t] = static_cast<int>(found - categories.begin());
      count[static_cast<std::size_t>(category[r][t])] += 1;
      all += 1;
    }
    if (all > 0) counts.push_back(std::move(count));
  }
  const auto size_of = [](const std::vector<double>& count) {
    double all = 0;
    for (const double c : count) all += c;
    return all;
  };
  // Gwet's AC1: chance agreement from how often each category is given by anyone.
  const double n = static_cast<double>(counts.size());
  std::vector<double> share(q);
  double agree = 0;
  for (const auto& count : counts) {
    const double all = size_of(count);
    for (std::size_t c = 0; c < q; ++c) share[c] += count[c] / all / n;
    if (all < 2) continue;
    ++result.targets;
    for (const double c : count) agree += c * (c - 1) / (all * (all - 1));
  }
  if (result.targets > 0) {
    const double rated_twice = static_cast<double>(result.targets), choices = static_cast<double>(q);
    agree /= rated_twice;
    double by_chance = 0;
    for (const double s : share) by_chance += s * (1 - s) / (choices - 1);
    const double ac1 = (agree - by_chance) / (1 - by_chance);
    result.percent = 100 * agree;
    result.ac1.value = ac1;
    if (counts.size() > 1) {
      double sum = 0;
      for (const auto& count : counts) {
        const double all = size_of(count);
        double own = 0, own_chance = 0;
        for (std::size_t c = 0; c < q; ++c) {
          own += all < 2 ? 0 : count[c] * (count[c] - 1) / (all * (all - 1));
          own_chance += count[c] / all * (1 - share[c]) / (choices - 1);
        }
        const double linear = (n / rated_twice * (own - (all < 2 ? 0 : by_chance))) / (1 - by_chance) -
                              2 * (1 - ac1) * (own_chance - by_chance) / (1 - by_chance);
        sum += (linear - ac1) * (linear - ac1);
      }
      result.ac1_standard_error = std::sqrt(sum / (n * (n - 1)));
      const double t = student_quantile(0.5 + level / 2, n - 1);
      result.ac1.interval = {std::max(-1.0, ac1 - t * result.ac1_standard_error),
                             std::min(1.0, ac1 + t * result.ac1_standard_error)};
    }
  }
  // Every pair of raters, on what both rated.
  double sums[3] = {};
  int pairs = 0;
  for (std::size_t r = 0; r < ratings.raters(); ++r) {
    for (std::size_t s = r + 1; s < ratings.raters(); ++s) {
      std::vector<int> a, b;
      for (std::size_t t = 0; t < ratings.targets(); ++t) {
        if (category[r][t] < 0 || category[s][t] < 0) continue;
        a.push_back(category[r][t]);
        b.push_back(category[s][t]);
      }
      double values[3];
      for (const Weights w : {Weights::none, Weights::linear, Weights::quadratic})
        values[static_cast<int>(w)] =
            a.size() < 2 ? kUndefined : cohen_kappa(a, b, static_cast<int>(q), w, level).value;
      if (std::isnan(values[0])) {
        ++result.pairs_without_kappa;
        continue;
      }
      ++pairs;
      for (int w = 0; w < 3; ++w) sums[w] += values[w];
    }
  }
  if (pairs > 0) {
    result.kappa = sums[0] / pairs;
    result.kappa_linear = sums[1] / pairs;
    result.kappa_quadratic = sums[2] / pairs;
  }
  return result;
}

Icc icc(const Ratings& given, double level) {
  need_level(level);
  const Ratings ratings = given.complete();
  Icc r;
  r.targets = ratings.targets();
  r.raters = ratings.raters();
  r.left_out = given.targets() - ratings.targets();
  if (r.targets < 2 || r.raters < 2) return r;
  const double n = static_cast<double>(r.targets), k = static_cast<double>(r.raters);
  std::vector<double> row(r.targets), column(r.raters);
  double all = 0;
  for (std::size_t t = 0; t < r.targets; ++t) {
    for (std::size_t c = 0; c < r.raters; ++c) {
      const double v = *ratings.at(t, c);
      if (!std::isfinite(v)) refuse("a rating is not a number");
      row[t] += v / k;
      column[c] += v / n;
      all += v / (n * k);
    }
  }
  double targets = 0, raters = 0, within = 0, error = 0;
  for (const double m : row) targets += k * (m - all) * (m - all);
  for (const double m : column) raters += n * (m - all) * (m - all);
  for (std::size_t t = 0; t < r.targets; ++t) {
    for (std::size_t c = 0; c < r.raters; ++c) {
      const double v = *ratings.at(t, c);
      within += (v - row[t]) * (v - row[t]);
      error += (v - row[t] - column[c] + all) * (v - row[t] - column[c] + all);
    }
  }
  const double R = r.ms_targets = targets / (n - 1), C = r.ms_raters = raters / (k - 1);
  const double W = r.ms_within = within / (n * (k - 1)), E = r.ms_error = error / ((n - 1) * (k - 1));
  // What is left by rounding is not variation.
  const double nothing = 1e-20 * (all * all + 1);
  if (R + W <= nothing) return r;
  const double high = 0.5 + level / 2;
  const auto of_mean = [&](double one) { return k * one / (1 + (k - 1) * one); };
  r.one_1.value = (R - W) / (R + (k - 1) * W);
  r.one_k.value = (R - W) / R;
  r.c_1.value = (R - E) / (R + (k - 1) * E);
  r.c_k.value = (R - E) / R;
  r.a_1.value = (R - E) / (R + (k - 1) * E + k * (C - E) / n);
  r.a_k.value = (R - E) / (R + (C - E) / n);
  for (Estimate* e : {&r.one_k, &r.c_k, &r.a_k}) {
    if (!std::isfinite(e->value)) e->value = kUndefined;
  }
  const auto by_f = [&](double f, double df1, double df2, Estimate& one, Estimate& mean_of_k) {
    const double lo = f / fisher_f_quantile(high, df1, df2), hi = f * fisher_f_quantile(high, df2, df1);
    one.interval = {(lo - 1) / (lo + k - 1), (hi - 1) / (hi + k - 1)};
    mean_of_k.interval = {1 - 1 / lo, 1 - 1 / hi};
  };
  if (W > nothing) by_f(R / W, n - 1, n * (k - 1), r.one_1, r.one_k);
  if (E > nothing) by_f(R / E, n - 1, (n - 1) * (k - 1), r.c_1, r.c_k);
  // Satterthwaite's degrees of freedom for raters and error together (McGraw and Wong 1996, table 7).
  if (E > nothing && std::isfinite(r.a_1.value) && r.a_1.value < 1) {
    const double rho = r.a_1.value, a = k * rho / (n * (1 - rho)), b = 1 + k * rho * (n - 1) / (n * (1 - rho));
    const double both = a * C + b * E;
    const double v = both * both / (a * C * a * C / (k - 1) + b * E * b * E / ((n - 1) * (k - 1)));
    const double below = fisher_f_quantile(high, n - 1, v), above = fisher_f_quantile(high, v, n - 1);
    const double rest = k * C + (k * n - k - n) * E;
    r.a_1.interval = {n * (R - below * E) / (below * rest + n * R), n * (above * R - E) / (rest + n * above * R)};
    r.a_k.interval = {of_mean(r.a_1.interval.lo), of_mean(r.a_1.interval.hi)};
  }
  return r;
}

BlandAltman bland_altman(std::span<const double> a, std::span<const double> b, double level) {
  need_same_size(a.size(), b.size());
  need_finite(a, "the first list");
  need_finite(b, "the second list");
  need_level(level);
  BlandAltman r;
  r.n = a.size();
  if (r.n < 3) return r;
  std::vector<double> d;
  for (std::size_t i = 0; i < r.n; ++i) d.push_back(a[i] - b[i]);
  const double m = mean(d), n = static_cast<double>(r.n), z = normal_quantile(0.975),
               t = student_quantile(0.5 + level / 2, n - 1);
  r.sd = std::sqrt(variance(d));
  const auto with = [](double value, double half) { return Estimate{value, {value - half, value + half}}; };
  r.bias = with(m, t * r.sd / std::sqrt(n));
  r.lower = with(m - z * r.sd, t * r.sd * std::sqrt(3 / n));
  r.upper = with(m + z * r.sd, t * r.sd * std::sqrt(3 / n));
  return r;
}

}  // namespace osteo::statistics
