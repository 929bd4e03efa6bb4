// The small motion that closes gaps along normals.
#pragma once
#include <array>
#include <cstddef>
#include <vector>

#include "osteo/core/data/rigid_transform.h"

namespace osteo::inline imaging::registration {

/// A point, a direction, and how far the point lies too far along it.
struct Gap {
  Vec3 at_mm, normal;
  double mm = 0;
};
struct Closing {
  RigidTransform motion;
  double offset_mm = 0;  // what all gaps have in common, which no motion closes
  double moved_mm = 0;   // by the motion, at 80 mm from the middle
};
/// The solution of the first `count` of N linear equations, their right sides in the last column. No pivoting: of
/// matrices that are positive definite. O(count^3).
template <std::size_t N>
std::array<double, N> solved(std::array<std::array<double, N + 1>, N> m, std::size_t count = N) {
  const auto right = [&](std::size_t i) -> double& { return m[i][N]; };
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = i + 1; j < count; ++j) {
      const double f = m[j][i] / m[i][i];
      for (std::size_t k = i; k < count; ++k) m[j][k] -= f * m[i][k];
      right(j) -= f * right(i);
    }
  }
  std::array<double, N> x{};
  for (std::size_t i = count; i-- > 0;) {
    double sum = right(i);
    for (std::size_t j = i + 1; j < count; ++j) sum -= m[i][j] * x[j];
    x[i] = sum / m[i][i];
  }
  return x;
}

/// Least squares over turn, shift and offset (small turns). At least seven gaps.
[[nodiscard]] Closing close_gaps(const std::vector<Gap>& gaps);

}  // namespace osteo::inline imaging::registration
