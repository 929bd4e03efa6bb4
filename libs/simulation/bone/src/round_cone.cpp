#include "osteo/simulation/bone/round_cone.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "osteo/core/base/portable_math.h"

namespace osteo::inline simulation {

double RoundCone::foot_mm(double radial_mm, double axial_mm) const {
  const double b = slope();
  return std::clamp(axial_mm - radial_mm * b / std::sqrt(1 - b * b), 0.0, length_mm);
}

double RoundCone::distance_mm(Vec3 p) const {
  const double radial = portable::hypot(p.x, p.y), axial = p.z - start_mm, t = foot_mm(radial, axial);
  return portable::hypot(radial, axial - t) - radius_at_mm(t);
}

double RoundCone::volume_mm3() const {
  // Frustum between the circles where side and balls touch, and the two caps beyond them.
  const double b = slope(), a = std::sqrt(1 - b * b), r1 = start_radius_mm, r2 = end_radius_mm;
  const auto cap = [](double r, double h) { return std::numbers::pi * h * h * (r - h / 3); };
  const double height = length_mm + b * (r2 - r1);  // between the circles: at b r1 and length + b r2
  const double c1 = a * r1, c2 = a * r2;
  return std::numbers::pi * height * (c1 * c1 + c1 * c2 + c2 * c2) / 3 + cap(r1, r1 * (1 + b)) + cap(r2, r2 * (1 - b));
}

double cap_depth_mm(double volume_mm3, double radius_mm) noexcept {
  // With x = d / r: x^2 (3 - x) = 3 v / (pi r^3). Newton from the shallow-cap estimate; the function rises on [0, 2].
  const double c = std::clamp(3 * volume_mm3 / (std::numbers::pi * radius_mm * radius_mm * radius_mm), 0.0, 4.0);
  if (c <= 0) return 0;
  double lo = 0, hi = 2, x = std::min(std::sqrt(c / 3), 1.9);
  for (int i = 0; i < 40; ++i) {
    const double f = x * x * (3 - x) - c;
    (f > 0 ? hi : lo) = x;
    const double slope = 3 * x * (2 - x);
    double next = slope > 1e-12 ? x - f / slope : 0.5 * (lo + hi);
    if (!(next > lo && next < hi)) next = 0.5 * (lo + hi);
    if (std::abs(next - x) < 1e-12) break;
    x = next;
  }
  return x * radius_mm;
}

namespace {

// Area of the part of a disc beyond a chord at signed distance c from its centre.
double segment_area(double r, double c) {
  if (c >= r) return 0;
  if (c <= -r) return std::numbers::pi * r * r;
  return r * r * portable::acos(c / r) - c * std::sqrt(r * r - c * c);
}

// Volume of the shape beyond the plane at `depth` below its farthest point in the direction (sine, cosine).
double cut_volume(const RoundCone& s, double sine, double cosine, double depth) {
  const double reach = std::max(s.start_radius_mm, s.length_mm * cosine + s.end_radius_mm);
  const double plane = reach - depth, lo = -s.start_radius_mm, hi = s.length_mm + s.end_radius_mm;
  constexpr int kSlices = 128;
  const double b = s.slope(), a = std::sqrt(1 - b * b), step = (hi - lo) / kSlices;
  double sum = 0;
  for (int i = 0; i < kSlices; ++i) {
    const double z = lo + (i + 0.5) * step;
    double r = 0;
    if (z < b * s.start_radius_mm) {
      r = std::sqrt(std::max(0.0, s.start_radius_mm * s.start_radius_mm - z * z));
    } else if (z > s.length_mm + b * s.end_radius_mm) {
      r = std::sqrt(std::max(0.0, s.end_radius_mm * s.end_radius_mm - (z - s.length_mm) * (z - s.length_mm)));
    } else {
      r = (s.start_radius_mm - b * z) / a;
    }
    // Near the pole the slices are nearly parallel to the plane: then a slice is in or out as a whole, in part by its
    // thickness.
    const double beyond = z * cosine - plane;
    if (sine > 1e-3) {
      sum += segment_area(r, -beyond / sine);
    } else {
      sum += std::numbers::pi * r * r * std::clamp(beyond / (step * std::abs(cosine)) + 0.5, 0.0, 1.0);
    }
  }
  return sum * step;
}

}  // namespace

CutDepth::CutDepth(const RoundCone& shape)
    : ball_(shape.length_mm == 0), radius_mm_(shape.largest_radius_mm()), volume_mm3_(shape.volume_mm3()) {
  if (ball_) return;
  table_.resize(static_cast<std::size_t>(kAngles) * kVolumes);
  for (int a = 0; a < kAngles; ++a) {
    const double cosine = std::clamp(-1 + 2.0 * a / (kAngles - 1), -1.0, 1.0), sine = std::sqrt(1 - cosine * cosine);
    const double deepest = std::max(shape.start_radius_mm, shape.length_mm * cosine + shape.end_radius_mm) +
                           std::max(shape.start_radius_mm, -shape.length_mm * cosine + shape.end_radius_mm);
    // Volume as a function of depth, finer where it begins; then inverted.
    constexpr int kDepths = 65;
    std::array<double, kDepths> depth{}, volume{};
    for (int d = 0; d < kDepths; ++d) {
      const double x = static_cast<double>(d) / (kDepths - 1);
      depth[static_cast<std::size_t>(d)] = deepest * x * x;
      volume[static_cast<std::size_t>(d)] = cut_volume(shape, sine, cosine, deepest * x * x);
    }
    volume[0] = 0;
    const double scale = volume_mm3_ / volume[kDepths - 1];
    for (double& v : volume) v *= scale;
    std::size_t at = 0;
    for (int k = 0; k < kVolumes; ++k) {
      // The root of the volume is nearly linear in depth for a ball's cap: interpolate in it.
      const double u = static_cast<double>(k) / (kVolumes - 1), v = u * u * volume_mm3_;
      while (at + 2 < kDepths && volume[at + 1] < v) ++at;
      const double u0 = std::sqrt(volume[at]), u1 = std::sqrt(volume[at + 1]);
      const double share = std::clamp((std::sqrt(v) - u0) / (u1 - u0), 0.0, 1.0);
      const double d = depth[at] + share * (depth[at + 1] - depth[at]);
      table_[static_cast<std::size_t>(a) * kVolumes + static_cast<std::size_t>(k)] = k == 0              ? 0
                                                                                     : k == kVolumes - 1 ? deepest
                                                                                                         : d;
    }
  }
}

double CutDepth::operator()(double volume_mm3, double cosine) const noexcept {
  if (!(volume_mm3 > 0)) return 0;
  if (ball_) return cap_depth_mm(volume_mm3, radius_mm_);
  const double u = std::min(std::sqrt(volume_mm3 / volume_mm3_), 1.0) * (kVolumes - 1);
  const double v = (std::clamp(cosine, -1.0, 1.0) + 1) / 2 * (kAngles - 1);
  const int i = std::min(static_cast<int>(u), kVolumes - 2), j = std::min(static_cast<int>(v), kAngles - 2);
  const double s = u - i, t = v - j;
  const auto at = [&](int a, int k) {
    return table_[static_cast<std::size_t>(a) * kVolumes + static_cast<std::size_t>(k)];
  };
  return (1 - t) * ((1 - s) * at(j, i) + s * at(j, i + 1)) + t * ((1 - s) * at(j + 1, i) + s * at(j + 1, i + 1));
}

double CutDepth::area_mm2(double volume_mm3, double cosine) const noexcept {
  if (ball_) {
    const double d = std::min(cap_depth_mm(volume_mm3, radius_mm_), radius_mm_);
    return std::numbers::pi * d * (2 * radius_mm_ - d);
  }
  // From the table's own slope, over a step that its rounding does not see.
  const double step = 0.02 * volume_mm3 + 1e-6 * volume_mm3_;
  const double rise = (*this)(volume_mm3 + step, cosine) - (*this)(volume_mm3, cosine);
  return step / std::max(rise, 1e-12);
}

}  // namespace osteo::inline simulation
