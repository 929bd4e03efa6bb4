// Small linear algebra that planning needs.
#pragma once
#include <array>
#include <cmath>
#include <utility>

#include "osteo/core/data/vec.h"

namespace osteo::inline session::planning {

/// Eigenvectors of a symmetric matrix as columns, largest eigenvalue first; by Jacobi's rotations.
inline Mat3 principal_axes(std::array<std::array<double, 3>, 3> m) {
  std::array<std::array<double, 3>, 3> v{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  for (int sweep = 0; sweep < 30; ++sweep) {
    for (std::size_t p = 0; p < 2; ++p) {
      for (std::size_t q = p + 1; q < 3; ++q) {
        if (m[p][q] == 0) continue;
        const double theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
        const double t = (theta >= 0 ? 1 : -1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const double c = 1 / std::sqrt(t * t + 1), s = t * c;
        for (std::size_t k = 0; k < 3; ++k) {
          const double a = m[k][p], b = m[k][q];
          m[k][p] = c * a - s * b;
          m[k][q] = s * a + c * b;
        }
        for (std::size_t k = 0; k < 3; ++k) {
          const double a = m[p][k], b = m[q][k];
          m[p][k] = c * a - s * b;
          m[q][k] = s * a + c * b;
          const double va = v[k][p], vb = v[k][q];
          v[k][p] = c * va - s * vb;
          v[k][q] = s * va + c * vb;
        }
      }
    }
  }
  std::array<std::size_t, 3> order{0, 1, 2};
  for (std::size_t a = 0; a < 2; ++a) {
    for (std::size_t b = a + 1; b < 3; ++b) {
      if (m[order[b]][order[b]] > m[order[a]][order[a]]) std::swap(order[a], order[b]);
    }
  }
  Mat3 out;
  for (std::size_t c = 0; c < 3; ++c) out.column[c] = normalized({v[0][order[c]], v[1][order[c]], v[2][order[c]]});
  return out;
}

}  // namespace osteo::inline session::planning
