// A fibula in its soft tissue: the donor bone of the phantom. Private to libs/imaging/image.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "osteo/core/base/portable_math.h"
#include "osteo/core/statistics/basics.h"
#include "osteo/imaging/image/detail/head_anatomy.h"

namespace osteo::inline imaging {

/// A shaft along z that is bowed and twisted, a little flat, and thicker at its ends; cortex about a canal of marrow
/// that ends in cancellous bone. Sizes are of the order of adults', chosen, not taken from a publication.
class FibulaAnatomy {
 public:
  static constexpr double kTopMm = -560;  ///< of the knee's end
  explicit FibulaAnatomy(std::uint64_t individual) {
    if (individual == 0) return;
    // Numbers that follow from the individual's alone.
    statistics::Random random(individual);
    const auto between = [&](double lo, double hi) { return lo + (hi - lo) * random.uniform(); };
    length_mm_ = between(320, 380);
    bow_mm_ = between(1, 4);
    twist_turns_ = between(-25, 25) / 360;
    lies_turns_ = between(0, 1);
    radius_mm_ = between(5.4, 6.3);
    flat_ = between(0.05, 0.12);
    cortex_mm_ = between(2.0, 3.0);
  }
  [[nodiscard]] double length_mm() const { return length_mm_; }

  [[nodiscard]] HeadAnatomy::Sample sample(Vec3 p) const {
    const double along = (kTopMm - p.z) / length_mm_;
    const double end = std::max(along - 1, -along) * length_mm_;  // beyond the ends above 0
    const double k = std::clamp(along, 0.0, 1.0);
    const double ends = portable::pow(std::abs(2 * k - 1), 8);
    const auto [sin, cos] = portable::sin_cos_turns(lies_turns_ + twist_turns_ * k);
    const double x = p.x - kMiddleX - bow_mm_ * portable::sin_cos_turns(k / 2).sin, y = p.y;
    const double u = (cos * x - sin * y), v = (sin * x + cos * y);
    const double a = radius_mm_ * (1 + flat_) * (1 + 0.6 * ends), b = radius_mm_ * (1 - flat_) * (1 + 0.6 * ends);
    // How far from a superellipse about its own size, in units of its smaller half axis: never more than the distance.
    const auto outside = [&](double half_u, double half_v) {
      const double r =
          portable::pow(portable::pow(std::abs(u) / half_u, kExponent) + portable::pow(std::abs(v) / half_v, kExponent),
                        1 / kExponent);
      return (r - 1) * std::min(half_u, half_v);
    };
    const double outer = std::max(outside(a, b), end), thin = cortex_mm_ * (1 - 0.6 * ends);
    const double inner = std::max(outside(a - thin, b - thin), end + thin);
    const double spongy = kSpongy * length_mm_ - std::min(k, 1 - k) * length_mm_;  // above 0 near the ends
    HeadAnatomy::Sample s;
    s.tissue = outer > 0 ? Tissue::soft : inner > 0 ? Tissue::cortical : spongy > 0 ? Tissue::diploe : Tissue::soft;
    // Slopes along the bone are below a tenth; twice that is left.
    s.margin_mm = kSure * std::min(std::abs(outer), std::abs(inner));
    if (inner < 0) s.margin_mm = std::min(s.margin_mm, kSure * std::abs(spongy));
    return s;
  }
  [[nodiscard]] Tissue tissue(Vec3 p) const { return sample(p).tissue; }

  static constexpr double kMiddleX = 90, kAroundMm = 20;

 private:
  static constexpr double kExponent = 2.3, kSpongy = 0.12, kSure = 0.75;
  double length_mm_ = 350, bow_mm_ = 2.5, twist_turns_ = 0.03, lies_turns_ = 0.1, radius_mm_ = 5.9, flat_ = 0.08,
         cortex_mm_ = 2.5;
};

}  // namespace osteo::inline imaging
