#include "osteo/core/statistics/basics.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "check.h"

namespace osteo::statistics {

double mean(std::span<const double> values) {
  if (values.empty()) return kUndefined;
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double variance(std::span<const double> values) {
  if (values.size() < 2) return kUndefined;
  const double m = mean(values);
  double sum = 0;
  for (const double v : values) sum += (v - m) * (v - m);
  return sum / static_cast<double>(values.size() - 1);
}

double quantile(std::span<const double> values, double share) {
  need_finite(values, "a quantile's values");
  if (!(share >= 0 && share <= 1)) refuse("the share of a quantile lies from 0 to 1");
  if (values.empty()) return kUndefined;
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  const double place = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  if (below + 1 >= sorted.size()) return sorted.back();
  return sorted[below] + (place - static_cast<double>(below)) * (sorted[below + 1] - sorted[below]);
}

Summary summarise(std::span<const double> values) {
  need_finite(values, "values to summarise");
  Summary s;
  s.n = values.size();
  if (values.empty()) return s;
  s.mean = mean(values);
  s.sd = std::sqrt(variance(values));
  s.q1 = quantile(values, 0.25);
  s.median = quantile(values, 0.5);
  s.q3 = quantile(values, 0.75);
  s.least = *std::min_element(values.begin(), values.end());
  s.most = *std::max_element(values.begin(), values.end());
  return s;
}

std::vector<double> ranks(std::span<const double> values) {
  need_finite(values, "values to rank");
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) { return values[i] < values[j]; });
  std::vector<double> rank(values.size());
  for (std::size_t i = 0, end = 0; i < order.size(); i = end) {
    while (end < order.size() && values[order[end]] == values[order[i]]) ++end;
    for (std::size_t j = i; j < end; ++j) rank[order[j]] = 0.5 * static_cast<double>(i + 1 + end);
  }
  return rank;
}

Interval wilson(double successes, double n, double level) {
  need_level(level);
  if (!(successes >= 0 && successes <= n)) refuse("a share is of so many out of so many");
  if (n == 0) return {};
  const double z = normal_quantile(0.5 + level / 2), p = successes / n, z2 = z * z / n;
  const double middle = (p + z2 / 2) / (1 + z2), half = std::sqrt(z2 * (p * (1 - p) + z2 / 4)) / (1 + z2);
  return {std::max(0.0, middle - half), std::min(1.0, middle + half)};
}

std::vector<double> holm(std::span<const double> p) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < p.size(); ++i) {
    if (!std::isnan(p[i])) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) { return p[i] < p[j]; });
  std::vector<double> adjusted(p.size(), kUndefined);
  double so_far = 0;
  for (std::size_t k = 0; k < order.size(); ++k) {
    so_far = std::max(so_far, std::min(1.0, p[order[k]] * static_cast<double>(order.size() - k)));
    adjusted[order[k]] = so_far;
  }
  return adjusted;
}

std::uint64_t Random::bits() {
  std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

std::size_t Random::below(std::size_t n) {
  if (n == 0) refuse("there is nothing to choose from");
  // Those beyond the last whole multiple of n would favour the first.
  const std::uint64_t beyond = (0 - static_cast<std::uint64_t>(n)) % n;
  std::uint64_t drawn = bits();
  while (drawn < beyond) drawn = bits();
  return static_cast<std::size_t>(drawn % n);
}

double Random::uniform() {
  return (static_cast<double>(bits() >> 12) + 0.5) * 0x1p-52;
}

double Random::normal() {
  return normal_quantile(uniform());
}

Bootstrap bootstrap(std::size_t people, const std::function<double(std::span<const std::size_t>)>& statistic,
                    const Resampling& r) {
  need_level(r.level);
  if (r.resamples < 100) refuse("a bootstrap of fewer than 100 resamples says nothing");
  Bootstrap result;
  if (people < 2) return result;
  Random random(r.seed);
  std::vector<std::size_t> drawn(people);
  std::vector<double> found;
  found.reserve(static_cast<std::size_t>(r.resamples));
  for (int i = 0; i < r.resamples; ++i) {
    for (std::size_t& d : drawn) d = random.below(people);
    const double value = statistic(drawn);
    if (std::isfinite(value)) {
      found.push_back(value);
    } else {
      ++result.left_out;
    }
  }
  if (result.left_out * 10 > r.resamples) return result;
  result.interval = {quantile(found, (1 - r.level) / 2), quantile(found, (1 + r.level) / 2)};
  return result;
}

}  // namespace osteo::statistics
