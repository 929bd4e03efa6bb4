// Component assessment: how far two raters agree on ten sessions, beyond chance.
#include <array>
#include <cmath>
#include <cstdio>

#include "osteo/core/statistics/agreement.h"

int main() {
  const std::array<int, 10> first{0, 0, 1, 1, 1, 2, 2, 2, 2, 0}, second{0, 0, 1, 1, 2, 2, 2, 2, 1, 0};
  const osteo::statistics::Kappa kappa = osteo::statistics::cohen_kappa(first, second, 3);
  std::printf("kappa %.4f (%.2f to %.2f)\n", kappa.value, kappa.interval.lo, kappa.interval.hi);
  return std::abs(kappa.value - (0.8 - 0.34) / (1 - 0.34)) < 1e-12
             ? 0
             : 1;  // 8 of 10 alike; by chance 0.3^2 + 0.3^2 + 0.4^2
}
