#include "osteo/simulation/bone/depth_map.h"

#include <cmath>

namespace osteo::inline simulation {
namespace {

float linear(const BrickGrid& g, Vec3 x) noexcept {
  const int i = static_cast<int>(std::floor(x.x)), j = static_cast<int>(std::floor(x.y)),
            k = static_cast<int>(std::floor(x.z));
  const auto u = static_cast<float>(x.x - i), v = static_cast<float>(x.y - j), w = static_cast<float>(x.z - k);
  // Two of three times all eight lie in one brick, which is then looked for once.
  if ((i & 7) != 7 && (j & 7) != 7 && (k & 7) != 7) {
    const VoxelKey first = g.find(i, j, k);
    if (first == BrickGrid::kNone) return 0;
    const auto row = [&](VoxelKey at) { return (1 - u) * g.value(first + at) + u * g.value(first + at + 1); };
    return (1 - w) * ((1 - v) * row(0) + v * row(8)) + w * ((1 - v) * row(64) + v * row(72));
  }
  const auto row = [&](int b, int c) { return (1 - u) * g.at(i, b, c) + u * g.at(i + 1, b, c); };
  return (1 - w) * ((1 - v) * row(j, k) + v * row(j + 1, k)) + w * ((1 - v) * row(j, k + 1) + v * row(j + 1, k + 1));
}

}  // namespace

double thickness_mm(const BrickGrid& bone, Vec3 start_mm, Vec3 inwards, double reach_mm, double gap_mm) noexcept {
  const double h = bone.frame().spacing_mm.x, step = 0.5 * h;
  const Vec3 x0 = bone.frame().index_from_world(start_mm), d = (transposed(bone.frame().direction) * inwards) / h;
  if (!std::isfinite(dot(x0, x0)) || !std::isfinite(dot(d, d)) ||
      std::abs(x0.x) + std::abs(x0.y) + std::abs(x0.z) > 1e6)
    return 0;
  float before = linear(bone, x0);
  double entered = before >= 0.5F ? 0 : -1, left = -1;
  for (double t = step;; t += step) {
    const float now = linear(bone, x0 + d * t);
    const double crossing = t - step * static_cast<double>((now - 0.5F) / (now == before ? 1.0F : now - before));
    if (entered < 0) {
      if (now >= 0.5F) entered = crossing;
      if (entered < 0 && t > 2 * h) return 0;
    } else if (left < 0) {
      if (now < 0.5F) left = crossing;
    } else if (now >= 0.5F && crossing - left <= gap_mm) {
      left = -1;
    }
    if (left >= 0 && t - left > gap_mm) return left - entered;
    if (entered >= 0 && t - entered >= reach_mm) return left >= 0 ? left - entered : reach_mm;
    before = now;
  }
}

}  // namespace osteo::inline simulation
