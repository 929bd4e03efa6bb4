#include "osteo/simulation/tissue/detail/energy.h"

#include <algorithm>

namespace osteo::inline simulation {

double total_energy(const Energy& energy, std::span<const Vec3> x) {
  double sum = 0;
  Vec3 local[Energy::kMaxNodes];
  for (std::size_t e = 0; e < energy.element_count(); ++e) {
    const auto nodes = energy.nodes(e);
    for (std::size_t n = 0; n < nodes.size(); ++n) local[n] = x[nodes[n]];
    sum += energy.element(e, local, nullptr, nullptr);
  }
  return sum;
}

void total_gradient(const Energy& energy, std::span<const Vec3> x, std::span<Vec3> gradient) {
  std::fill(gradient.begin(), gradient.end(), Vec3{});
  Vec3 local[Energy::kMaxNodes];
  double g[3 * Energy::kMaxNodes];
  for (std::size_t e = 0; e < energy.element_count(); ++e) {
    const auto nodes = energy.nodes(e);
    for (std::size_t n = 0; n < nodes.size(); ++n) local[n] = x[nodes[n]];
    energy.element(e, local, g, nullptr);
    for (std::size_t n = 0; n < nodes.size(); ++n) gradient[nodes[n]] += Vec3{g[3 * n], g[3 * n + 1], g[3 * n + 2]};
  }
}

}  // namespace osteo::inline simulation
