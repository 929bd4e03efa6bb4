#include "osteo/core/statistics/compare.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "check.h"
#include "osteo/core/statistics/basics.h"
#include "permute.h"

namespace osteo::statistics {
namespace {

void need_groups(std::span<const double> a, std::span<const double> b) {
  need_finite(a, "the first group");
  need_finite(b, "the second group");
}

// Of all ways to choose `k` of `ranks`: how many have each sum of doubled ranks.
std::vector<double> ways_by_sum(const std::vector<double>& ranks, std::size_t k) {
  std::size_t most = 0;
  for (const double r : ranks) most += static_cast<std::size_t>(std::lround(2 * r));
  std::vector<std::vector<double>> ways(k + 1, std::vector<double>(most + 1));
  ways[0][0] = 1;
  std::size_t so_far = 0, taken = 0;
  for (const double r : ranks) {
    const auto step = static_cast<std::size_t>(std::lround(2 * r));
    so_far += step;
    taken = std::min(taken + 1, k);
    for (std::size_t j = taken; j > 0; --j) {
      for (std::size_t s = so_far + 1; s-- > step;) ways[j][s] += ways[j - 1][s - step];
    }
  }
  return ways[k];
}

}  // namespace

Welch welch(std::span<const double> a, std::span<const double> b, double level) {
  need_groups(a, b);
  need_level(level);
  Welch w;
  if (a.empty() || b.empty()) return w;
  w.difference = mean(a) - mean(b);
  if (a.size() < 2 || b.size() < 2) return w;
  const double na = static_cast<double>(a.size()), nb = static_cast<double>(b.size());
  const double va = variance(a) / na, vb = variance(b) / nb;
  if (va + vb <= 0) return w;
  const double error = std::sqrt(va + vb);
  w.t = w.difference / error;
  w.df = (va + vb) * (va + vb) / (va * va / (na - 1) + vb * vb / (nb - 1));
  w.p = student_p(w.t, w.df);
  const double half = student_quantile(0.5 + level / 2, w.df) * error;
  w.interval = {w.difference - half, w.difference + half};
  return w;
}

MannWhitney mann_whitney(std::span<const double> a, std::span<const double> b) {
  need_groups(a, b);
  MannWhitney r;
  if (a.empty() || b.empty()) return r;
  std::vector<double> all(a.begin(), a.end());
  all.insert(all.end(), b.begin(), b.end());
  const std::vector<double> rank = ranks(all);
  const double na = static_cast<double>(a.size()), nb = static_cast<double>(b.size()), n = na + nb;
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += rank[i];
  r.u = sum - na * (na + 1) / 2;
  r.exact = all.size() <= 80;
  if (r.exact) {
    const bool first = a.size() <= b.size();
    if (!first) sum = n * (n + 1) / 2 - sum;
    const std::vector<double> ways = ways_by_sum(rank, std::min(a.size(), b.size()));
    const auto observed = static_cast<std::size_t>(std::lround(2 * sum));
    double below = 0, above = 0, whole = 0;
    for (std::size_t s = 0; s < ways.size(); ++s) {
      whole += ways[s];
      if (s <= observed) below += ways[s];
      if (s >= observed) above += ways[s];
    }
    r.p = std::min(1.0, 2 * std::min(below, above) / whole);
    return r;
  }
  double ties = 0;
  std::sort(all.begin(), all.end());
  for (std::size_t i = 0, end = 0; i < all.size(); i = end) {
    while (end < all.size() && all[end] == all[i]) ++end;
    const double t = static_cast<double>(end - i);
    ties += t * t * t - t;
  }
  const double spread = std::sqrt(na * nb / 12 * (n + 1 - ties / (n * (n - 1))));
  if (spread > 0) {
    const double away = std::max(r.u, na * nb - r.u) - na * nb / 2;
    r.p = std::min(1.0, 2 * normal_cdf(-(away - 0.5) / spread));
  } else {
    r.p = 1;
  }
  return r;
}

Permutation permutation_of_means(std::span<const double> a, std::span<const double> b,
                                 const PermutationSettings& settings) {
  need_groups(a, b);
  if (a.empty() || b.empty()) return {};
  std::vector<double> all(a.begin(), a.end());
  all.insert(all.end(), b.begin(), b.end());
  std::vector<int> labels(all.size());
  std::fill_n(labels.begin(), a.size(), 1);
  return permute({{all, labels}}, settings);
}

Estimate hedges_g(std::span<const double> a, std::span<const double> b, double level) {
  need_groups(a, b);
  need_level(level);
  if (a.size() < 2 || b.size() < 2) return {};
  const double na = static_cast<double>(a.size()), nb = static_cast<double>(b.size()), df = na + nb - 2;
  const double pooled = ((na - 1) * variance(a) + (nb - 1) * variance(b)) / df;
  if (pooled <= 0) return {};
  const double d = (mean(a) - mean(b)) / std::sqrt(pooled), scale = std::sqrt(1 / na + 1 / nb),
               factor = hedges_factor(df);
  const double t = d / scale;
  return {factor * d,
          {factor * scale * non_centrality(t, df, 0.5 + level / 2),
           factor * scale * non_centrality(t, df, 0.5 - level / 2)}};
}

Estimate cliffs_delta(std::span<const double> a, std::span<const double> b, double level) {
  need_groups(a, b);
  need_level(level);
  if (a.empty() || b.empty()) return {};
  const double na = static_cast<double>(a.size()), nb = static_cast<double>(b.size());
  std::vector<double> of_a(a.size()), of_b(b.size());
  const auto sign = [](double x, double y) { return x > y ? 1.0 : x < y ? -1.0 : 0.0; };
  // Counted whole and divided once: no overlap is then exactly 1.
  double all = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) {
      of_a[i] += sign(a[i], b[j]);
      of_b[j] += sign(a[i], b[j]);
      all += sign(a[i], b[j]);
    }
  }
  for (double& d : of_a) d /= nb;
  for (double& d : of_b) d /= na;
  Estimate e;
  const double delta = e.value = all / (na * nb), z = normal_quantile(0.5 + level / 2);
  if (a.size() < 2 || b.size() < 2) return e;
  double rows = 0, columns = 0, cells = 0;
  for (const double d : of_a) rows += (d - delta) * (d - delta);
  for (const double d : of_b) columns += (d - delta) * (d - delta);
  for (const double x : a) {
    for (const double y : b) cells += (sign(x, y) - delta) * (sign(x, y) - delta);
  }
  const double spread = std::max(0.0, (nb * nb * rows + na * na * columns - cells) / (na * nb * (na - 1) * (nb - 1)));
  if (std::abs(delta) >= 1) {
    const double n = std::min(na, nb), bound = (n - z * z) / (n + z * z);
    e.interval = delta > 0 ? Interval{bound, 1} : Interval{-1, -bound};
    return e;
  }
  const double zs = z * z * spread, room = 1 - delta * delta,
               half = z * std::sqrt(spread) * std::sqrt(room * room + zs);
  e.interval = {std::max(-1.0, (delta * room - half) / (room + zs)),
                std::min(1.0, (delta * room + half) / (room + zs))};
  return e;
}

}  // namespace osteo::statistics
