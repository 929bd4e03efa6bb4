#include "edge_fit.h"

namespace osteo::inline session::planning {
namespace {

constexpr double kSampleMm = 0.2, kSmoothMm = 0.5, kMetalReachMm = 3;
constexpr int kHalf = 8;  // of the filter, in samples: 1.6 mm

// Over a step, minus its height: the derivative of a Gaussian, scaled to a step of 1 that is not blurred otherwise.
const std::array<double, 2 * kHalf + 1>& filter() {
  static const auto weights = [] {
    std::array<double, 2 * kHalf + 1> w{};
    double step = 0;
    for (int k = -kHalf; k <= kHalf; ++k) {
      const double x = k * kSampleMm / kSmoothMm;
      w[static_cast<std::size_t>(k + kHalf)] = -x * std::exp(-x * x / 2);
      if (k < 0) step += w[static_cast<std::size_t>(k + kHalf)];
    }
    for (double& v : w) v /= step;
    return w;
  }();
  return weights;
}

}  // namespace

EdgeReader::EdgeReader(const Image& ct, double min_drop_hu, double metal_hu)
    : ct_(ct), min_drop_(min_drop_hu), metal_(metal_hu) {
  index_ = inverse(ct.frame.direction);
  for (Vec3& c : index_.column)
    c = {c.x / ct.frame.spacing_mm.x, c.y / ct.frame.spacing_mm.y, c.z / ct.frame.spacing_mm.z};
  shift_ = index_ * ct.frame.origin_mm * -1;
}

std::optional<double> EdgeReader::value(Vec3 point) const {
  const Vec3 i = index_ * point + shift_;
  for (std::size_t a = 0; a < 3; ++a)
    if (!(i[a] >= 0 && i[a] <= ct_.frame.dims[a] - 1)) return std::nullopt;
  return sample_linear(ct_, i);
}

std::optional<EdgeReader::Edge> EdgeReader::along(Vec3 point, Vec3 direction, double reach_mm) const {
  const int reach = static_cast<int>(std::ceil(reach_mm / kSampleMm)),
            metal = static_cast<int>(kMetalReachMm / kSampleMm);
  const int ends = std::max(reach + kHalf + 1, metal);
  std::vector<double> profile;
  profile.reserve(static_cast<std::size_t>(2 * ends + 1));
  for (int k = -ends; k <= ends; ++k) {
    const auto v = value(point + direction * (k * kSampleMm));
    if (!v || (std::abs(k) <= metal && *v > metal_)) return std::nullopt;
    profile.push_back(*v);
  }
  const auto drop = [&](int at) {
    double sum = 0;
    for (int k = -kHalf; k <= kHalf; ++k)
      sum += filter()[static_cast<std::size_t>(k + kHalf)] * profile[static_cast<std::size_t>(at + k + ends)];
    return sum;
  };
  int best = 0;
  double most = min_drop_;
  for (int k = -reach; k <= reach; ++k) {
    const double d = drop(k);
    if (d <= most) continue;
    most = d;
    best = k;
  }
  if (most <= min_drop_ || std::abs(best) == reach) return std::nullopt;
  const double before = drop(best - 1), after = drop(best + 1), bend = before - 2 * most + after;
  if (bend >= 0) return std::nullopt;
  return Edge{(best + (before - after) / (2 * bend)) * kSampleMm, most};
}

}  // namespace osteo::inline session::planning
