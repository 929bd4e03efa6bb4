#include "osteo/core/statistics/curves.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <Eigen/Dense>

#include "check.h"
#include "osteo/core/statistics/basics.h"

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

double norm_of(std::span<const double> x) {
  double sum = 0;
  for (const double v : x) sum += v * v;
  return std::sqrt(sum);
}

// What a straight line through `given` leaves of x. Empty where one of those follows from the others.
std::vector<double> left_of(std::span<const double> x, std::span<const std::vector<double>> given) {
  const auto n = static_cast<Eigen::Index>(x.size());
  Eigen::MatrixXd a(n, static_cast<Eigen::Index>(given.size()) + 1);
  a.col(0).setOnes();
  for (std::size_t k = 0; k < given.size(); ++k) {
    // Centred and of one size, so that units say nothing about what follows from what.
    auto column = a.col(static_cast<Eigen::Index>(k) + 1);
    const double middle = mean(given[k]);
    for (Eigen::Index i = 0; i < n; ++i) column[i] = given[k][static_cast<std::size_t>(i)] - middle;
    const double size = column.norm();
    if (size <= 1e-14 * norm_of(given[k])) return {};
    column *= std::sqrt(static_cast<double>(n)) / size;
  }
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(a);
  // A column that the others explain to ten digits says nothing of its own.
  const auto diagonal = qr.matrixR().diagonal().cwiseAbs();
  if (diagonal.minCoeff() <= 1e-10 * diagonal.maxCoeff()) return {};
  const Eigen::Map<const Eigen::VectorXd> v(x.data(), n);
  const Eigen::VectorXd rest = v - a * qr.solve(v);
  if (rest.norm() <= 1e-12 * v.norm()) return {};
  return {rest.begin(), rest.end()};
}

Correlation partial(std::span<const double> x, std::span<const double> y, std::span<const std::vector<double>> given,
                    double level) {
  need_pairs(x, y);
  need_level(level);
  for (const auto& g : given) {
    need_same_size(x.size(), g.size());
    need_finite(g, "a list given");
  }
  Correlation c;
  c.n = x.size();
  const std::size_t k = given.size();
  if (c.n < k + 3) return c;
  const std::vector<double> a = left_of(x, given), b = left_of(y, given);
  if (a.empty() || b.empty()) return c;
  c.r = product_moment(a, b);
  c.p = p_of(c.r, c.n - k);
  if (std::isfinite(c.r) && c.n > k + 3) {
    const double half = normal_quantile(0.5 + level / 2) / std::sqrt(static_cast<double>(c.n - k) - 3),
                 z = std::atanh(c.r);
    c.interval = {std::tanh(z - half), std::tanh(z + half)};
  }
  return c;
}

}  // namespace

Correlation partial_pearson(std::span<const double> x, std::span<const double> y,
                            std::span<const std::vector<double>> given, double level) {
  return partial(x, y, given, level);
}

Correlation partial_spearman(std::span<const double> x, std::span<const double> y,
                             std::span<const std::vector<double>> given, double level) {
  need_pairs(x, y);
  std::vector<std::vector<double>> of;
  for (const auto& g : given) {
    need_finite(g, "a list given");
    of.push_back(ranks(g));
  }
  return partial(ranks(x), ranks(y), of, level);
}

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

CorrelationByPeople correlation_by_people(std::span<const double> x, std::span<const double> y,
                                          std::span<const int> person, const Resampling& resampling) {
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
