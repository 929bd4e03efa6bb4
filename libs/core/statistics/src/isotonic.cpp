#include "osteo/core/statistics/curves.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "check.h"

namespace osteo::statistics {
namespace {

// Indices by rising x, and where each different x begins.
struct Places {
  std::vector<std::size_t> order, begin;  ///< begin has one more than there are places
};
Places places_of(std::span<const double> x, Trend trend) {
  Places p;
  p.order.resize(x.size());
  std::iota(p.order.begin(), p.order.end(), std::size_t{0});
  const bool rising = trend == Trend::rising;
  std::stable_sort(p.order.begin(), p.order.end(),
                   [&](std::size_t i, std::size_t j) { return rising ? x[i] < x[j] : x[j] < x[i]; });
  for (std::size_t i = 0; i < p.order.size(); ++i) {
    if (i == 0 || x[p.order[i]] != x[p.order[i - 1]]) p.begin.push_back(i);
  }
  p.begin.push_back(p.order.size());
  return p;
}

MonotoneCurve curve_of(std::span<const double> x, const Places& p, std::vector<double> y, Trend trend) {
  MonotoneCurve c;
  for (std::size_t i = 0; i + 1 < p.begin.size(); ++i) c.x.push_back(x[p.order[p.begin[i]]]);
  c.y = std::move(y);
  if (trend == Trend::falling) {
    std::reverse(c.x.begin(), c.x.end());
    std::reverse(c.y.begin(), c.y.end());
  }
  return c;
}

void need_curve(std::span<const double> x, std::span<const double> y) {
  need_same_size(x.size(), y.size());
  need_finite(x, "x");
  need_finite(y, "y");
}

}  // namespace

double MonotoneCurve::at(double where) const {
  if (x.empty() || std::isnan(where)) return kUndefined;
  const auto above = static_cast<std::size_t>(std::upper_bound(x.begin(), x.end(), where) - x.begin());
  if (above == 0) return y.front();
  if (above == x.size()) return y.back();
  const double share = (where - x[above - 1]) / (x[above] - x[above - 1]);
  return y[above - 1] + share * (y[above] - y[above - 1]);
}

MonotoneCurve isotonic_mean(std::span<const double> x, std::span<const double> y, Trend trend,
                            std::span<const double> weights) {
  need_curve(x, y);
  if (!weights.empty()) {
    need_same_size(x.size(), weights.size());
    need_finite(weights, "weights");
    for (const double w : weights) {
      if (!(w > 0)) refuse("weights are above 0");
    }
  }
  const Places p = places_of(x, trend);
  struct Pool {
    double sum = 0, weight = 0;
    std::size_t places = 0;
    [[nodiscard]] double level() const { return sum / weight; }
  };
  std::vector<Pool> pools;
  for (std::size_t i = 0; i + 1 < p.begin.size(); ++i) {
    Pool next{0, 0, 1};
    for (std::size_t j = p.begin[i]; j < p.begin[i + 1]; ++j) {
      const double w = weights.empty() ? 1 : weights[p.order[j]];
      next.sum += w * y[p.order[j]];
      next.weight += w;
    }
    while (!pools.empty() && pools.back().level() >= next.level()) {
      next = {pools.back().sum + next.sum, pools.back().weight + next.weight, pools.back().places + next.places};
      pools.pop_back();
    }
    pools.push_back(next);
  }
  std::vector<double> level;
  for (const Pool& pool : pools) level.insert(level.end(), pool.places, pool.level());
  return curve_of(x, p, std::move(level), trend);
}

MonotoneCurve isotonic_quantile(std::span<const double> x, std::span<const double> y, double share, Trend trend) {
  need_curve(x, y);
  if (!(share > 0 && share < 1)) refuse("the share of a quantile curve lies between 0 and 1");
  const Places p = places_of(x, trend);
  std::vector<double> values(y.begin(), y.end());
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  std::vector<double> level(p.begin.size() - 1);
  // Places from..to take values lo..hi. Whether a place is to lie at or below values[middle - 1] or above is a question
  // of counting, and where the one ends and the other begins splits both.
  struct Part {
    std::size_t from, to, lo, hi;
  };
  std::vector<Part> parts{{0, level.size(), 0, values.size()}};
  while (!parts.empty()) {
    const Part part = parts.back();
    parts.pop_back();
    if (part.from == part.to) continue;
    if (part.hi - part.lo == 1) {
      std::fill(level.begin() + static_cast<std::ptrdiff_t>(part.from),
                level.begin() + static_cast<std::ptrdiff_t>(part.to), values[part.lo]);
      continue;
    }
    const std::size_t middle = (part.lo + part.hi) / 2;
    const double below = values[middle - 1];
    std::size_t cut = part.from;
    double all = 0, low = 0, least = 0;
    for (std::size_t i = part.from; i < part.to; ++i) {
      for (std::size_t j = p.begin[i]; j < p.begin[i + 1]; ++j) {
        all += 1;
        low += y[p.order[j]] <= below ? 1 : 0;
      }
      // What keeping these places low costs beyond raising them, in steps of value; equal but for rounding: lower.
      const double cost = share * all - low;
      if (cost <= least + 1e-9) {
        least = std::min(least, cost);
        cut = i + 1;
      }
    }
    parts.push_back({part.from, cut, part.lo, middle});
    parts.push_back({cut, part.to, middle, part.hi});
  }
  return curve_of(x, p, std::move(level), trend);
}

}  // namespace osteo::statistics
