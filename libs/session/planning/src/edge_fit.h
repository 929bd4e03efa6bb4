// Edges of bone in a CT along given lines, and least squares over them.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <vector>

#include "osteo/core/data/rigid_transform.h"
#include "osteo/core/data/volume.h"

namespace osteo::inline session::planning {

class EdgeReader {
 public:
  EdgeReader(const Image& ct, double min_drop_hu, double metal_hu);
  struct Edge {
    double at_mm = 0, drop_hu = 0;
  };
  /// Along a unit direction from bone to what is not bone: where it drops most within `reach_mm` of the point.
  [[nodiscard]] std::optional<Edge> along(Vec3 point, Vec3 direction, double reach_mm) const;
  /// Nothing outside the CT.
  [[nodiscard]] std::optional<double> value(Vec3 point) const;

 private:
  const Image& ct_;
  Mat3 index_;
  Vec3 shift_;
  double min_drop_, metal_;
};

template <std::size_t N>
using Row = std::array<double, N>;
template <std::size_t N>
using Square = std::array<Row<N>, N>;

/// Gauss and Jordan with pivots; false where it is singular.
template <std::size_t N>
bool inverted(Square<N> m, Square<N>& out) {
  out = {};
  for (std::size_t k = 0; k < N; ++k) out[k][k] = 1;
  for (std::size_t k = 0; k < N; ++k) {
    std::size_t p = k;
    for (std::size_t r = k + 1; r < N; ++r)
      if (std::abs(m[r][k]) > std::abs(m[p][k])) p = r;
    if (std::abs(m[p][k]) < 1e-12) return false;
    std::swap(m[p], m[k]);
    std::swap(out[p], out[k]);
    const double d = m[k][k];
    for (std::size_t c = 0; c < N; ++c) {
      m[k][c] /= d;
      out[k][c] /= d;
    }
    for (std::size_t r = 0; r < N; ++r) {
      if (r == k) continue;
      const double f = m[r][k];
      for (std::size_t c = 0; c < N; ++c) {
        m[r][c] -= f * m[k][c];
        out[r][c] -= f * out[k][c];
      }
    }
  }
  return true;
}

template <std::size_t N, std::size_t M>
std::array<Row<N>, M> product(const std::array<Row<N>, M>& a, const Square<N>& b) {
  std::array<Row<N>, M> out{};
  for (std::size_t r = 0; r < M; ++r)
    for (std::size_t k = 0; k < N; ++k)
      for (std::size_t c = 0; c < N; ++c) out[r][c] += a[r][k] * b[k][c];
  return out;
}
/// a b a'.
template <std::size_t N, std::size_t M>
Square<M> carried(const std::array<Row<N>, M>& a, const Square<N>& b) {
  const auto ab = product<N, M>(a, b);
  Square<M> out{};
  for (std::size_t r = 0; r < M; ++r)
    for (std::size_t c = 0; c < M; ++c)
      for (std::size_t k = 0; k < N; ++k) out[r][c] += ab[r][k] * a[c][k];
  return out;
}

/// Student's 97.5 % quantile over the normal one's (Cornish and Fisher), times that.
inline double student(double freedom) {
  return 1.959964 + 2.3722 / freedom + 2.8225 / (freedom * freedom);
}

/// Slope of each measurement over the unknowns, what is left of it, and the patch that it belongs to.
template <std::size_t N>
struct Equation {
  Row<N> slope{};
  double rest = 0;
  std::array<int, 3> patch{};
};
template <std::size_t N>
struct Solved {
  Row<N> step{};
  Square<N> covariance{};
  double quantile = 0;  ///< half-width = this * root of the covariance
};
/// Least squares of slope . step = rest, and the covariance that sums over patches give for `rest` as it is.
template <std::size_t N>
std::optional<Solved<N>> least_squares(const std::vector<Equation<N>>& all) {
  Square<N> h{}, inverse;
  Row<N> g{};
  for (const auto& e : all) {
    for (std::size_t r = 0; r < N; ++r) {
      g[r] += e.slope[r] * e.rest;
      for (std::size_t c = 0; c < N; ++c) h[r][c] += e.slope[r] * e.slope[c];
    }
  }
  if (!inverted<N>(h, inverse)) return std::nullopt;
  Solved<N> out;
  for (std::size_t r = 0; r < N; ++r)
    for (std::size_t c = 0; c < N; ++c) out.step[r] += inverse[r][c] * g[c];
  std::map<std::array<int, 3>, Row<N>> sums;
  for (const auto& e : all) {
    double left = e.rest;
    for (std::size_t r = 0; r < N; ++r) left -= e.slope[r] * out.step[r];
    Row<N>& s = sums[e.patch];
    for (std::size_t r = 0; r < N; ++r) s[r] += e.slope[r] * left;
  }
  const double patches = static_cast<double>(sums.size());
  if (patches < N + 3) return std::nullopt;
  Square<N> middle{};
  for (const auto& [patch, s] : sums)
    for (std::size_t r = 0; r < N; ++r)
      for (std::size_t c = 0; c < N; ++c) middle[r][c] += s[r] * s[c];
  out.covariance = carried<N, N>(inverse, middle);
  // What the unknowns take up of the scatter.
  const double freedom = patches - static_cast<double>(N);
  for (auto& row : out.covariance)
    for (double& v : row) v *= patches / freedom;
  out.quantile = student(freedom);
  return out;
}

}  // namespace osteo::inline session::planning
