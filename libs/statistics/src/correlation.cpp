#include "osteo/statistics/correlation.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "check.h"
#include "distributions.h"

namespace osteo::statistics {
namespace {

void need_pairs(std::span<const double> x, std::span<const double> y) {
  need_same_size(x.size(), y.size());
  need_finite(x, "the first list");
  need_finite(y, "the second list");
}

double product_moment(std::span<const double> x, std::span<const double> y) {
  if (x.size() < 3) return kUndefined;
  const double mx = mean(x), my = mean(y);
  double xx = 0, yy = 0, xy = 0, size_x = 0, size_y = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += (x[i] - mx) * (x[i] - mx);
    yy += (y[i] - my) * (y[i] - my);
    xy += (x[i] - mx) * (y[i] - my);
    size_x += x[i] * x[i];
    size_y += y[i] * y[i];
  }
  // Equal values whose mean is rounded do not vary.
  if (xx <= 1e-28 * size_x || yy <= 1e-28 * size_y) return kUndefined;
  return std::clamp(xy / std::sqrt(xx) / std::sqrt(yy), -1.0, 1.0);
}

double p_of(double r, std::size_t n) {
  if (!std::isfinite(r)) return kUndefined;
  if (std::abs(r) >= 1) return 0;
  const double df = static_cast<double>(n) - 2;
  return student_p(r * std::sqrt(df / ((1 - r) * (1 + r))), df);
}

}  // namespace

Correlation pearson(std::span<const double> x, std::span<const double> y, double level) {
  need_pairs(x, y);
  need_level(level);
  Correlation c;
  c.n = x.size();
  c.r = product_moment(x, y);
  c.p = p_of(c.r, c.n);
  if (std::isfinite(c.r) && c.n > 3) {
    const double half = normal_quantile(0.5 + level / 2) / std::sqrt(static_cast<double>(c.n) - 3), z = std::atanh(c.r);
    c.interval = {std::tanh(z - half), std::tanh(z + half)};
  }
  return c;
}

Correlation spearman(std::span<const double> x, std::span<const double> y) {
  need_pairs(x, y);
  Correlation c;
  c.n = x.size();
  c.r = product_moment(ranks(x), ranks(y));
  c.p = p_of(c.r, c.n);
  return c;
}

CorrelationByPeople correlation_by_people(std::span<const double> x, std::span<const double> y, std::span<const int> person,
                                          const Resampling& resampling) {
  need_pairs(x, y);
  need_same_size(x.size(), person.size());
  std::map<int, std::vector<std::size_t>> by_person;
  for (std::size_t i = 0; i < person.size(); ++i) by_person[person[i]].push_back(i);
  std::vector<std::vector<std::size_t>> of;
  for (auto& [code, pairs] : by_person) of.push_back(std::move(pairs));
  CorrelationByPeople r;
  r.pairs = x.size();
  r.people = of.size();
  r.pearson = pearson(x, y, resampling.level);
  r.spearman = spearman(x, y);
  std::vector<double> a, b;
  const auto with = [&](auto&& statistic) {
    return bootstrap(
        of.size(),
        [&](std::span<const std::size_t> drawn) {
          a.clear();
          b.clear();
          for (const std::size_t d : drawn) {
            for (const std::size_t i : of[d]) {
              a.push_back(x[i]);
              b.push_back(y[i]);
            }
          }
          return statistic();
        },
        resampling);
  };
  if (std::isfinite(r.pearson.r)) r.pearson_by_people = with([&] { return product_moment(a, b); });
  if (std::isfinite(r.spearman.r)) r.spearman_by_people = with([&] { return product_moment(ranks(a), ranks(b)); });
  return r;
}

}  // namespace osteo::statistics
