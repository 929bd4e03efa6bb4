#include "osteo/core/statistics/repeated.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>
#include <Eigen/QR>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <map>
#include <numbers>

#include "check.h"
#include "osteo/core/statistics/basics.h"
#include "permute.h"

namespace osteo::statistics {

WithinPeople permutation_within_people(std::span<const double> values, std::span<const int> person,
                                       std::span<const int> condition, const PermutationSettings& settings) {
  need_same_size(values.size(), person.size());
  need_same_size(values.size(), condition.size());
  need_finite(values, "the values");
  std::map<int, Block> by_person;
  for (std::size_t i = 0; i < values.size(); ++i) {
    by_person[person[i]].values.push_back(values[i]);
    by_person[person[i]].labels.push_back(condition[i] != 0 ? 1 : 0);
  }
  std::vector<Block> blocks;
  WithinPeople r;
  for (auto& [code, block] : by_person) {
    int with = 0;
    for (const int l : block.labels) with += l;
    if (with == 0 || with == static_cast<int>(block.labels.size())) {
      ++r.left_out;
    } else {
      blocks.push_back(std::move(block));
    }
  }
  r.people = blocks.size();
  static_cast<Permutation&>(r) = permute(blocks, settings);
  return r;
}

namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

// All that the likelihood of a ratio of variances is made of. Sums inside people and of people's means are kept apart,
// so that nothing cancels where the ratio is large.
struct Model {
  Matrix x;
  Vector y;
  std::vector<std::vector<Eigen::Index>> rows_of;

  struct At {
    Matrix a;  ///< X' V^-1 X, V in units of the error's variance
    Vector beta;
    double q = 0;         ///< residuals' V^-1 residuals
    double deviance = 0;  ///< -2 log likelihood, without what does not depend on the ratio
    double slope = 0;     ///< of the deviance
    double log_det_v = 0, log_det_a = 0;
  };
  [[nodiscard]] At at(double ratio) const {
    const auto n = y.size(), p = x.cols();
    At r;
    r.a = Matrix::Zero(p, p);
    Matrix slope_a = Matrix::Zero(p, p);
    Vector b = Vector::Zero(p);
    for (const auto& rows : rows_of) {
      const double k = static_cast<double>(rows.size()), spread = 1 + ratio * k;
      Vector sum = Vector::Zero(p);
      double sum_y = 0;
      for (const auto i : rows) {
        sum += x.row(i).transpose();
        sum_y += y(i);
      }
      const Vector middle = sum / k;
      for (const auto i : rows) {
        const Vector d = x.row(i).transpose() - middle;
        r.a += d * d.transpose();
        b += d * (y(i) - sum_y / k);
      }
      r.a += sum * sum.transpose() / (k * spread);
      b += sum * sum_y / (k * spread);
      slope_a -= sum * sum.transpose() / (spread * spread);
      r.log_det_v += std::log(spread);
      r.slope += k / spread;
    }
    const Eigen::LDLT<Matrix> solver(r.a);
    r.beta = solver.solve(b);
    double slope_q = 0;
    const Vector residual = y - x * r.beta;
    for (const auto& rows : rows_of) {
      const double k = static_cast<double>(rows.size()), spread = 1 + ratio * k;
      double sum = 0;
      for (const auto i : rows) sum += residual(i);
      for (const auto i : rows) r.q += (residual(i) - sum / k) * (residual(i) - sum / k);
      r.q += sum * sum / (k * spread);
      slope_q -= sum * sum / (spread * spread);
    }
    r.log_det_a = solver.vectorD().array().log().sum();
    r.deviance = static_cast<double>(n - p) * std::log(r.q) + r.log_det_v + r.log_det_a;
    r.slope += static_cast<double>(n - p) * slope_q / r.q + solver.solve(slope_a).trace();
    return r;
  }

  [[nodiscard]] double best_ratio() const {
    std::vector<double> ratios{0.0};
    for (int i = -60; i <= 60; ++i) ratios.push_back(std::pow(10.0, i / 10.0));
    std::size_t best = 0;
    double least = at(0).deviance;
    for (std::size_t i = 1; i < ratios.size(); ++i) {
      const double here = at(ratios[i]).deviance;
      if (here < least) {
        least = here;
        best = i;
      }
    }
    double lo = ratios[best > 0 ? best - 1 : 0], hi = ratios[std::min(best + 1, ratios.size() - 1)];
    if (best == 0 && at(0).slope >= 0) return 0;
    if (at(lo).slope >= 0 || at(hi).slope <= 0) return ratios[best];
    std::uintmax_t rounds = 100;
    const auto found = boost::math::tools::toms748_solve([&](double r) { return at(r).slope; }, lo, hi,
                                                         boost::math::tools::eps_tolerance<double>(50), rounds);
    return (found.first + found.second) / 2;
  }
};

}  // namespace

MixedModel mixed_model(std::span<const double> y, std::span<const double> design, std::size_t columns,
                       std::span<const int> person, double level) {
  need_level(level);
  need_same_size(y.size(), person.size());
  need_same_size(y.size() * columns, design.size());
  need_finite(y, "the values");
  need_finite(design, "the design");
  if (columns == 0) refuse("a mixed model has one column at least");
  if (y.size() > 2000) refuse("a mixed model is of 2000 rows at most");
  const auto n = static_cast<Eigen::Index>(y.size()), p = static_cast<Eigen::Index>(columns);
  Model m;
  m.x = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(design.data(), n, p);
  m.y = Eigen::Map<const Vector>(y.data(), n);
  std::map<int, std::vector<Eigen::Index>> by_person;
  for (Eigen::Index i = 0; i < n; ++i) by_person[person[static_cast<std::size_t>(i)]].push_back(i);
  for (auto& [code, rows] : by_person) m.rows_of.push_back(std::move(rows));
  const auto people = static_cast<Eigen::Index>(m.rows_of.size());
  if (n <= p)
    refuse("a mixed model of " + std::to_string(columns) + " coefficients needs more than " + std::to_string(y.size()) +
           " rows");
  if (people == n) refuse("a mixed model needs people who come more than once");
  if (Eigen::ColPivHouseholderQR<Matrix>(m.x).rank() < p) refuse("columns of the mixed model depend on each other");

  MixedModel r;
  r.rows = y.size();
  r.people = m.rows_of.size();
  r.coefficients.resize(columns);
  const double rest = static_cast<double>(n - p);
  // Values that the columns explain wholly leave nothing to estimate spread from.
  if (m.at(0).q <= 1e-24 * m.y.squaredNorm() || m.at(0).q == 0) {
    const Vector beta = m.at(0).beta;
    for (Eigen::Index c = 0; c < p; ++c) r.coefficients[static_cast<std::size_t>(c)].value = beta(c);
    r.variance_people = r.variance_error = 0;
    return r;
  }
  const double ratio = m.best_ratio();
  const Model::At at = m.at(ratio);
  const double error = r.variance_error = at.q / rest;
  r.variance_people = ratio * error;
  r.log_likelihood = -0.5 * (rest * (std::log(2 * std::numbers::pi * error) + 1) + at.log_det_v + at.log_det_a);

  // Satterthwaite: how surely both variances are known, by the expected information of the restricted likelihood.
  const Matrix c = at.a.ldlt().solve(Matrix::Identity(p, p)) * error;
  Matrix z = Matrix::Zero(n, people), inverse = Matrix::Identity(n, n) / error;
  for (Eigen::Index g = 0; g < people; ++g) {
    const auto& rows = m.rows_of[static_cast<std::size_t>(g)];
    const double shared = ratio / (1 + ratio * static_cast<double>(rows.size())) / error;
    for (const auto i : rows) {
      z(i, g) = 1;
      for (const auto j : rows) inverse(i, j) -= shared;
    }
  }
  const Matrix vx = inverse * m.x, projection = inverse - vx * c * vx.transpose();
  const Matrix zp = z.transpose() * projection, zpz = zp * z, zvx = z.transpose() * vx;
  Eigen::Matrix2d information;
  information << projection.squaredNorm(), zp.squaredNorm(), zp.squaredNorm(), zpz.squaredNorm();
  information /= 2;
  const Matrix by_error = c * vx.transpose() * vx * c, by_people = c * zvx.transpose() * zvx * c;
  const Eigen::Matrix2d known = information.inverse();
  for (Eigen::Index k = 0; k < p; ++k) {
    auto& out = r.coefficients[static_cast<std::size_t>(k)];
    out.value = at.beta(k);
    out.standard_error = std::sqrt(c(k, k));
    const Eigen::Vector2d slope(by_error(k, k), by_people(k, k));
    // At the edge the variance between people is 0 and not estimated.
    const double spread = ratio > 0 ? slope.dot(known * slope) : slope(0) * slope(0) / information(0, 0);
    out.df = 2 * c(k, k) * c(k, k) / spread;
    if (!(out.df > 0) || !std::isfinite(out.df)) {
      out.df = kUndefined;
      continue;
    }
    out.t = out.value / out.standard_error;
    out.p = student_p(out.t, out.df);
    const double half = student_quantile(0.5 + level / 2, out.df) * out.standard_error;
    out.interval = {out.value - half, out.value + half};
  }
  return r;
}

}  // namespace osteo::statistics
