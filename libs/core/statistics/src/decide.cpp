#include "osteo/core/statistics/compare.h"

#include <algorithm>
#include <cmath>

#include "check.h"
#include "osteo/core/statistics/basics.h"

namespace osteo::statistics {

Roc roc(std::span<const double> positive, std::span<const double> negative, double level) {
  need_finite(positive, "the positive group");
  need_finite(negative, "the negative group");
  need_level(level);
  Roc r;
  if (positive.empty() || negative.empty()) return r;
  const double m = static_cast<double>(positive.size()), n = static_cast<double>(negative.size());
  std::vector<double> of_positive(positive.size()), of_negative(negative.size());
  // Counted in halves and divided once: no overlap is then exactly 1.
  double all = 0;
  for (std::size_t i = 0; i < positive.size(); ++i) {
    for (std::size_t j = 0; j < negative.size(); ++j) {
      const double won = positive[i] > negative[j] ? 1 : positive[i] == negative[j] ? 0.5 : 0;
      of_positive[i] += won;
      of_negative[j] += won;
      all += won;
    }
  }
  for (double& v : of_positive) v /= n;
  for (double& v : of_negative) v /= m;
  r.area.value = all / (m * n);
  if (positive.size() > 1 && negative.size() > 1) {
    const double z = normal_quantile(0.5 + level / 2);
    r.standard_error = std::sqrt(variance(of_positive) / m + variance(of_negative) / n);
    r.area.interval = {std::max(0.0, r.area.value - z * r.standard_error),
                       std::min(1.0, r.area.value + z * r.standard_error)};
    if (r.area.value >= 1) r.area.interval = {wilson(std::min(m, n), std::min(m, n), level).lo, 1};
    if (r.area.value <= 0) r.area.interval = {0, wilson(0, std::min(m, n), level).hi};
  }
  std::vector<double> thresholds(positive.begin(), positive.end());
  thresholds.insert(thresholds.end(), negative.begin(), negative.end());
  std::sort(thresholds.begin(), thresholds.end(), std::greater<>());
  thresholds.erase(std::unique(thresholds.begin(), thresholds.end()), thresholds.end());
  r.curve.push_back({std::numeric_limits<double>::infinity(), 0, 0});
  r.best = r.curve.front();
  for (const double t : thresholds) {
    const auto reach = [&](std::span<const double> values) {
      return static_cast<double>(std::count_if(values.begin(), values.end(), [&](double v) { return v >= t; })) /
             static_cast<double>(values.size());
    };
    r.curve.push_back({t, reach(positive), reach(negative)});
    const auto& p = r.curve.back();
    if (p.true_positive - p.false_positive > r.best.true_positive - r.best.false_positive + 1e-12) r.best = p;
  }
  return r;
}

namespace {

struct Normal {
  double mean = 0, sd = 0;
};
Normal fitted(std::span<const double> values) {
  return {mean(values), std::sqrt(variance(values))};
}

// Where both curves are equally high, between their means.
double crossing(const Normal& a, const Normal& b) {
  if (!(a.sd > 0 && b.sd > 0)) return kUndefined;
  const double lo = std::min(a.mean, b.mean), hi = std::max(a.mean, b.mean);
  if (!(hi > lo)) return kUndefined;
  // (x - m)^2 / s^2 + 2 ln s alike, as a quadratic in x - (middle of the means), which does not cancel.
  const double middle = (lo + hi) / 2, ma = a.mean - middle, mb = b.mean - middle, wa = 1 / (a.sd * a.sd),
               wb = 1 / (b.sd * b.sd);
  const double two = wa - wb, one = -2 * (ma * wa - mb * wb),
               none = ma * ma * wa - mb * mb * wb + 2 * std::log(a.sd / b.sd);
  const double under = one * one - 4 * two * none;
  if (under < 0) return kUndefined;
  const double q = -0.5 * (one + std::copysign(std::sqrt(under), one));
  for (const double x : {none / q, q / two}) {
    if (std::isfinite(x) && middle + x >= lo && middle + x <= hi) return middle + x;
  }
  return kUndefined;
}

}  // namespace

PassMark contrasting_groups(std::span<const double> competent, std::span<const double> others,
                            const Resampling& resampling) {
  need_finite(competent, "the competent group");
  need_finite(others, "the other group");
  PassMark r;
  if (competent.size() < 2 || others.size() < 2) return r;
  const Normal c = fitted(competent), o = fitted(others);
  r.higher_is_better = c.mean >= o.mean;
  const double mark = r.mark.value = crossing(c, o);
  if (std::isnan(mark)) return r;
  const double way = r.higher_is_better ? 1 : -1;
  r.competent_fail_fitted = normal_cdf(way * (mark - c.mean) / c.sd);
  r.other_pass_fitted = normal_cdf(way * (o.mean - mark) / o.sd);
  const auto share = [&](std::span<const double> values, bool passes) {
    const auto n =
        std::count_if(values.begin(), values.end(), [&](double v) { return (way * (v - mark) >= 0) == passes; });
    return static_cast<double>(n) / static_cast<double>(values.size());
  };
  r.competent_fail_counted = share(competent, false);
  r.other_pass_counted = share(others, true);
  // Both groups are drawn again, each as large as it is.
  const std::size_t people = competent.size() + others.size();
  std::vector<double> a(competent.size()), b(others.size());
  r.mark.interval = bootstrap(
                        people,
                        [&](std::span<const std::size_t> drawn) {
                          for (std::size_t i = 0; i < a.size(); ++i) a[i] = competent[drawn[i] % a.size()];
                          for (std::size_t i = 0; i < b.size(); ++i) b[i] = others[drawn[a.size() + i] % b.size()];
                          return crossing(fitted(a), fitted(b));
                        },
                        resampling)
                        .interval;
  return r;
}

namespace {

void need_power(const PowerSettings& s) {
  if (s.sessions < 1 || !(s.icc >= 0 && s.icc <= 1) || !(s.alpha > 0 && s.alpha < 1) || s.draws < 100 ||
      !std::isfinite(s.effect))
    refuse(
        "power needs a session a person, an icc from 0 to 1, alpha between 0 and 1, 100 draws and an effect that is a "
        "number");
}

}  // namespace

Estimate power_two_groups(std::size_t n_a, std::size_t n_b, const PowerSettings& s) {
  need_power(s);
  if (n_a < 2 || n_b < 2) refuse("power is of groups of two at least");
  // Means and variances of normal groups are drawn from their own distributions, so that large groups cost no more than
  // small ones.
  Random random(s.seed);
  const double v = s.icc + (1 - s.icc) / s.sessions, na = static_cast<double>(n_a), nb = static_cast<double>(n_b);
  int found = 0;
  for (int i = 0; i < s.draws; ++i) {
    const double noise = random.normal() * std::sqrt(v / na + v / nb);
    const double va = v * chi_squared_quantile(random.uniform(), na - 1) / (na - 1) / na;
    const double vb = v * chi_squared_quantile(random.uniform(), nb - 1) / (nb - 1) / nb;
    const double t = (s.effect + noise) / std::sqrt(va + vb),
                 df = (va + vb) * (va + vb) / (va * va / (na - 1) + vb * vb / (nb - 1));
    found += student_p(t, df) < s.alpha ? 1 : 0;
  }
  return {static_cast<double>(found) / s.draws, wilson(found, s.draws, 0.95)};
}

double detectable_effect(std::size_t n_a, std::size_t n_b, double power, const PowerSettings& settings) {
  if (!(power > 0 && power < 1)) refuse("power lies between 0 and 1");
  PowerSettings s = settings;
  const auto reaches = [&](double effect) {
    s.effect = effect;
    return power_two_groups(n_a, n_b, s).value >= power;
  };
  int lo = 0, hi = 1000;
  if (!reaches(10)) return kUndefined;
  while (hi - lo > 1) {
    const int middle = (lo + hi) / 2;
    (reaches(middle / 100.0) ? hi : lo) = middle;
  }
  return hi / 100.0;
}

double people_needed(double power, const PowerSettings& s) {
  need_power(s);
  if (!(power > 0 && power < 1)) refuse("power lies between 0 and 1");
  if (s.effect == 0) return kUndefined;
  const auto reaches = [&](std::size_t n) { return power_two_groups(n, n, s).value >= power; };
  std::size_t hi = 2;
  while (!reaches(hi)) {
    if (hi >= 100000) return kUndefined;
    hi = std::min<std::size_t>(100000, hi * 2);
  }
  std::size_t lo = std::max<std::size_t>(1, hi / 2);
  while (hi - lo > 1) {
    const std::size_t middle = (lo + hi) / 2;
    (reaches(middle) ? hi : lo) = middle;
  }
  return static_cast<double>(hi);
}

}  // namespace osteo::statistics
