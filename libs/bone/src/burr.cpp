#include "osteo/bone/burr.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "osteo/base/error.h"
#include "osteo/base/param.h"

namespace osteo {

std::string Burr::name() const {
  return std::string(EnumNames<BurrKind>::values[static_cast<std::size_t>(kind)]) + " " + format_number(diameter_mm) + " mm";
}

const std::vector<Burr>& burr_library() {
  static const std::vector<Burr> library = [] {
    std::vector<Burr> all;
    for (const BurrKind kind : {BurrKind::cutting, BurrKind::diamond}) {
      const double rate = kind == BurrKind::cutting ? 6 : 2, falloff = kind == BurrKind::cutting ? 3 : 0.3;
      for (int d = 1; d <= 7; ++d) all.push_back({kind, static_cast<double>(d), rate * d / 4, falloff * d / 4});
    }
    return all;
  }();
  return library;
}

int burr_index(BurrKind kind, double diameter_mm) {
  const auto& all = burr_library();
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].kind == kind && all[i].diameter_mm == diameter_mm) return static_cast<int>(i);
  }
  throw Error(ExitCode::usage, "there is no burr of " + format_number(diameter_mm) + " mm",
              "burrs are cutting or diamond, of 1, 2, 3, 4, 5, 6 or 7 mm");
}

BurrSamples sample_burr(const Burr& burr) {
  constexpr double kSamples = 3000;
  const double r = burr.diameter_mm / 2;
  const double ball = 4.0 / 3 * std::numbers::pi * r * r * r;
  const double pitch = std::cbrt(ball / kSamples);
  BurrSamples s;
  const int n = static_cast<int>(std::ceil(r / pitch)) + 1;
  for (int k = -n; k <= n; ++k) {
    for (int j = -n; j <= n; ++j) {
      for (int i = -n; i <= n; ++i) {
        const Vec3 p{(i + 0.5) * pitch, (j + 0.5) * pitch, (k + 0.5) * pitch};
        const double d = length(p);
        if (d > r) continue;
        s.offset_mm.push_back({static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
        const double latitude = std::abs(std::numbers::pi / 2 - std::acos(std::clamp(p.z / d, -1.0, 1.0)));
        s.efficiency.push_back(
            static_cast<float>(std::max(0.0, 1 - burr.falloff_mm3_per_s_per_n_per_rad * latitude / burr.rate_mm3_per_s_per_n)));
      }
    }
  }
  s.sample_volume_mm3 = ball / static_cast<double>(s.offset_mm.size());
  return s;
}

}  // namespace osteo
