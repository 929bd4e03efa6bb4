// Gradients and Hessians against differences.
#pragma once
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "osteo/simulation/tissue/detail/energy.h"

namespace osteo::test {

inline std::vector<Vec3> shaken(const std::vector<Vec3>& x, double by, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> u(-by, by);
  std::vector<Vec3> y = x;
  for (Vec3& p : y) p += Vec3{u(random), u(random), u(random)};
  return y;
}

/// Of every element at `x`: the gradient by central differences of the energy, the Hessian by those of the gradient,
/// and symmetric.
inline void expect_exact_derivatives(const Energy& energy, const std::vector<Vec3>& x) {
  for (std::size_t e = 0; e < energy.element_count(); ++e) {
    const auto nodes = energy.nodes(e);
    const std::size_t n = nodes.size();
    std::vector<Vec3> local(n);
    for (std::size_t a = 0; a < n; ++a) local[a] = x[nodes[a]];
    std::vector<double> g(3 * n), h(9 * n * n), up(3 * n), down(3 * n);
    energy.element(e, local.data(), g.data(), h.data());
    for (std::size_t a = 0; a < n; ++a) {
      for (std::size_t c = 0; c < 3; ++c) {
        constexpr double kStep = 1e-5;
        auto moved = local;
        moved[a][c] += kStep;
        const double above = energy.element(e, moved.data(), up.data(), nullptr);
        moved[a][c] -= 2 * kStep;
        const double below = energy.element(e, moved.data(), down.data(), nullptr);
        EXPECT_NEAR((above - below) / (2 * kStep), g[3 * a + c], 1e-8) << n;
        for (std::size_t r = 0; r < 3 * n; ++r) {
          EXPECT_NEAR((up[r] - down[r]) / (2 * kStep), h[r * 3 * n + 3 * a + c], 1e-7) << n;
          EXPECT_NEAR(h[r * 3 * n + 3 * a + c], h[(3 * a + c) * 3 * n + r], 1e-12) << n;
        }
      }
    }
  }
}

}  // namespace osteo::test
