#include "osteo/core/statistics/repeated.h"

#include <algorithm>
#include <cmath>

#include "check.h"
#include "osteo/core/statistics/basics.h"

namespace osteo::statistics {

RepeatedAnova repeated_anova(std::span<const double> values, std::size_t conditions) {
  need_finite(values, "the values");
  if (conditions < 2 || values.size() % conditions != 0 || values.size() / conditions < 2)
    refuse("repeated measures need at least two conditions and two people, each with all of them");
  const std::size_t k = conditions, n = values.size() / k;
  RepeatedAnova r;
  r.people = n;
  r.conditions = k;
  const auto at = [&](std::size_t person, std::size_t condition) { return values[person * k + condition]; };
  const double kd = static_cast<double>(k), nd = static_cast<double>(n), all = mean(values);
  std::vector<double> of_person(n, 0), of_condition(k, 0);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t c = 0; c < k; ++c) {
      of_person[i] += at(i, c) / kd;
      of_condition[c] += at(i, c) / nd;
    }
  }
  double ss_people = 0, ss_conditions = 0, ss_error = 0;
  for (const double m : of_person) ss_people += kd * (m - all) * (m - all);
  for (const double m : of_condition) ss_conditions += nd * (m - all) * (m - all);
  // What is left of each value: its covariance over people is the one that sphericity is about, with rows and columns
  // centred.
  std::vector<double> left(values.size()), covariance(k * k, 0);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t c = 0; c < k; ++c) {
      left[i * k + c] = at(i, c) - of_person[i] - of_condition[c] + all;
      ss_error += left[i * k + c] * left[i * k + c];
    }
  }
  double trace = 0, squares = 0;
  for (std::size_t a = 0; a < k; ++a) {
    for (std::size_t b = 0; b < k; ++b) {
      double s = 0;
      for (std::size_t i = 0; i < n; ++i) s += left[i * k + a] * left[i * k + b];
      s /= nd - 1;
      if (a == b) trace += s;
      squares += s * s;
    }
  }
  r.df_conditions = kd - 1;
  r.df_error = (kd - 1) * (nd - 1);
  // Rounding alone is no error to test against.
  double size = 0;
  for (const double v : values) size += v * v;
  if (!(ss_error > 1e-24 * size)) return r;
  r.f = ss_conditions / r.df_conditions / (ss_error / r.df_error);
  r.p = fisher_f_p(r.f, r.df_conditions, r.df_error);
  r.epsilon_gg = std::clamp(trace * trace / ((kd - 1) * squares), 1 / (kd - 1), 1.0);
  const double hf_below = (kd - 1) * (nd - 1 - (kd - 1) * r.epsilon_gg);
  r.epsilon_hf = hf_below > 0 ? std::clamp((nd * (kd - 1) * r.epsilon_gg - 2) / hf_below, r.epsilon_gg, 1.0) : 1;
  r.p_gg = fisher_f_p(r.f, r.epsilon_gg * r.df_conditions, r.epsilon_gg * r.df_error);
  r.p_hf = fisher_f_p(r.f, r.epsilon_hf * r.df_conditions, r.epsilon_hf * r.df_error);
  r.partial_eta2 = ss_conditions / (ss_conditions + ss_error);
  r.generalised_eta2 = ss_conditions / (ss_conditions + ss_error + ss_people);
  return r;
}

OneWayAnova one_way_anova(std::span<const std::vector<double>> groups) {
  if (groups.size() < 2) refuse("an analysis of variance needs two groups");
  double n = 0, sum = 0;
  for (const auto& g : groups) {
    if (g.empty()) refuse("a group of the analysis of variance is empty");
    need_finite(g, "a group");
    n += static_cast<double>(g.size());
    for (const double v : g) sum += v;
  }
  const double all = sum / n;
  double between = 0, within = 0, size = 0;
  for (const auto& g : groups) {
    const double m = mean(g);
    between += static_cast<double>(g.size()) * (m - all) * (m - all);
    for (const double v : g) {
      within += (v - m) * (v - m);
      size += v * v;
    }
  }
  OneWayAnova r;
  r.df_groups = static_cast<double>(groups.size()) - 1;
  r.df_error = n - static_cast<double>(groups.size());
  if (r.df_error < 1 || !(within > 1e-24 * size)) return r;
  r.f = between / r.df_groups / (within / r.df_error);
  r.p = fisher_f_p(r.f, r.df_groups, r.df_error);
  return r;
}

Paired paired(std::span<const double> a, std::span<const double> b, double level) {
  need_same_size(a.size(), b.size());
  need_finite(a, "the first");
  need_finite(b, "the second");
  need_level(level);
  Paired r;
  r.people = a.size();
  if (a.size() < 2) return r;
  std::vector<double> d(a.size());
  for (std::size_t i = 0; i < d.size(); ++i) d[i] = a[i] - b[i];
  const double n = static_cast<double>(d.size()), sd = std::sqrt(variance(d));
  r.difference = mean(d);
  double largest = 0;
  for (std::size_t i = 0; i < d.size(); ++i) largest = std::max({largest, std::abs(a[i]), std::abs(b[i])});
  if (!(sd > 1e-13 * largest)) return r;
  r.df = n - 1;
  r.t = r.difference / (sd / std::sqrt(n));
  r.p = student_p(r.t, r.df);
  const double reach = student_quantile(0.5 + level / 2, r.df) * sd / std::sqrt(n);
  r.interval = {r.difference - reach, r.difference + reach};
  const double lo = non_centrality(r.t, r.df, 0.5 + level / 2), hi = non_centrality(r.t, r.df, 0.5 - level / 2);
  r.dz = {r.difference / sd, {lo / std::sqrt(n), hi / std::sqrt(n)}};
  const double both = variance(a) + variance(b), factor = hedges_factor(r.df), scale = sd * std::sqrt(2 / (n * both));
  r.g_av = {factor * r.difference / std::sqrt(both / 2), {factor * lo * scale, factor * hi * scale}};
  return r;
}

double power_paired(std::size_t people, double dz, double alpha) {
  need_level(alpha);
  if (people < 2) refuse("a paired test needs two people");
  const double df = static_cast<double>(people) - 1, critical = student_quantile(1 - alpha / 2, df);
  return student_beyond(critical, df, std::abs(dz) * std::sqrt(static_cast<double>(people)));
}

double people_needed_paired(double dz, double power, double alpha) {
  need_level(power);
  constexpr std::size_t kMax = 100000;
  if (!(std::abs(dz) > 0) || power_paired(kMax, dz, alpha) < power) return kUndefined;
  std::size_t lo = 1, hi = kMax;  // lo is too few, hi is enough
  while (hi - lo > 1) {
    const std::size_t middle = lo + (hi - lo) / 2;
    (power_paired(middle, dz, alpha) >= power ? hi : lo) = middle;
  }
  return static_cast<double>(hi);
}

double detectable_dz(std::size_t people, double power, double alpha) {
  need_level(power);
  double lo = 0, hi = 0.5;
  while (power_paired(people, hi, alpha) < power && hi < 1e3) hi *= 2;
  if (hi >= 1e3) return kUndefined;
  while (hi - lo > 1e-7) {
    const double middle = (lo + hi) / 2;
    (power_paired(people, middle, alpha) >= power ? hi : lo) = middle;
  }
  return hi;
}

}  // namespace osteo::statistics
