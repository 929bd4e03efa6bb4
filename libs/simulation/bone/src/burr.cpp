#include "osteo/simulation/bone/burr.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "osteo/core/base/error.h"
#include "osteo/core/base/param.h"
#include "osteo/core/base/portable_math.h"

namespace osteo::inline simulation {
namespace {

constexpr double kShaftDiameterMm = 2.35, kShaftLengthMm = 60;

float efficiency_at(double falloff_per_rad, double sine_of_latitude) {
  const double latitude = portable::asin(std::clamp(std::abs(sine_of_latitude), 0.0, 1.0));
  return static_cast<float>(std::max(0.0, 1 - falloff_per_rad * latitude));
}

}  // namespace

std::string Burr::name() const {
  if (length_mm > 0) return "saw " + format_number(length_mm) + " mm";
  const std::string form =
      shape == BurrShape::ball ? "" : std::string(EnumNames<BurrShape>::values[static_cast<std::size_t>(shape)]) + " ";
  return std::string(row_of(kind).name) + " " + form + format_number(diameter_mm) + " mm";
}

RoundCone Burr::head() const {
  const double r = diameter_mm / 2;
  if (shape == BurrShape::cylinder) return {0, length_mm > 0 ? length_mm : 1.5 * diameter_mm, r, r};
  if (shape == BurrShape::taper) return {0, 2 * diameter_mm, r / 2, r};
  return {0, 0, r, r};
}

RoundCone Burr::shaft() const {
  const RoundCone h = head();
  const double r = std::min(kShaftDiameterMm, 0.7 * diameter_mm) / 2;
  return {h.length_mm + h.end_radius_mm, kShaftLengthMm, r, r};
}

const std::vector<Burr>& burr_library() {
  static const std::vector<Burr> library = [] {
    std::vector<Burr> all;
    for (const BurrShape shape : {BurrShape::ball, BurrShape::cylinder, BurrShape::taper}) {
      for (std::size_t n = 0; n < kBurrKinds.size(); ++n) {
        const double rate = kBurrKinds[n].rate_mm3_per_s_per_n, falloff = kBurrKinds[n].falloff_mm3_per_s_per_n_per_rad;
        for (int d = 1; d <= 7; ++d)
          all.push_back({static_cast<BurrKind>(n), static_cast<double>(d), rate * d / 4, falloff * d / 4, shape});
      }
    }
    return all;
  }();
  return library;
}

int burr_index(BurrKind kind, double diameter_mm, BurrShape shape) {
  const auto& all = burr_library();
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].kind == kind && all[i].diameter_mm == diameter_mm && all[i].shape == shape) return static_cast<int>(i);
  }
  std::string kinds;
  for (std::size_t n = 0; n < kBurrKinds.size(); ++n)
    kinds += (n == 0 ? "" : n + 1 == kBurrKinds.size() ? " or " : ", ") + std::string(kBurrKinds[n].name);
  throw Error(ExitCode::usage, "there is no burr of " + format_number(diameter_mm) + " mm",
              "burrs are " + kinds + ", of 1, 2, 3, 4, 5, 6 or 7 mm");
}

BurrSamples sample_head(const RoundCone& head, double falloff_per_rad) {
  constexpr double kSamples = 3000;
  const double r = head.largest_radius_mm(), volume = head.volume_mm3(), pitch = portable::cbrt(volume / kSamples);
  BurrSamples s;
  const int n = static_cast<int>(std::ceil(r / pitch)) + 1,
            top = n + static_cast<int>(std::ceil(head.length_mm / pitch));
  for (int k = -n; k <= top; ++k) {
    for (int j = -n; j <= n; ++j) {
      for (int i = -n; i <= n; ++i) {
        const Vec3 p{(i + 0.5) * pitch, (j + 0.5) * pitch, (k + 0.5) * pitch};
        if (head.distance_mm(p) > 0) continue;
        const Vec3 inward = normalized(Vec3{0, 0, head.foot_mm(portable::hypot(p.x, p.y), p.z)} - p);
        s.offset_mm.push_back(to_floats(p));
        s.inward.push_back(to_floats(inward));
        s.efficiency.push_back(efficiency_at(falloff_per_rad, inward.z));
      }
    }
  }
  s.sample_volume_mm3 = volume / static_cast<double>(s.offset_mm.size());
  return s;
}

BurrSurface sample_head_surface(const RoundCone& h, double falloff_per_rad, int samples) {
  // Along the profile from tip to top by area: the zone of the tip's ball, the side, the zone of the end's ball.
  const double b = h.slope(), a = std::sqrt(1 - b * b), r1 = h.start_radius_mm, r2 = h.end_radius_mm,
               pi = std::numbers::pi;
  const double tip = 2 * pi * r1 * r1 * (1 + b), top = 2 * pi * r2 * r2 * (1 - b);
  const double slant = h.length_mm * a, side = pi * (a * r1 + a * r2) * slant;
  BurrSurface s;
  s.sample_area_mm2 = (tip + side + top) / samples;
  for (int i = 0; i < samples; ++i) {
    const double area = (i + 0.5) * s.sample_area_mm2, angle = i * pi * (3 - std::sqrt(5.0));
    double foot = 0, normal_z = b, radius = r1;  // a point of the surface is foot + radius * normal
    if (area < tip) {
      normal_z = -1 + area / (2 * pi * r1 * r1);
    } else if (area >= tip + side) {
      foot = h.length_mm;
      radius = r2;
      normal_z = b + (area - tip - side) / (2 * pi * r2 * r2);
    } else {
      // Area of the frustum up to the share x of the slant: side * (2 c1 x + (c2 - c1) x^2) / (c1 + c2).
      const double c1 = r1, c2 = r2, share = (area - tip) / side * (c1 + c2);
      const double x =
          std::abs(c2 - c1) < 1e-12 ? share / (2 * c1) : (-c1 + std::sqrt(c1 * c1 + (c2 - c1) * share)) / (c2 - c1);
      foot = x * h.length_mm;
      radius = h.radius_at_mm(foot);
    }
    const double flat = std::sqrt(std::max(0.0, 1 - normal_z * normal_z));
    const portable::SinCos round = portable::sin_cos(angle);
    const Vec3 normal{flat * round.cos, flat * round.sin, normal_z};
    s.offset_mm.push_back(to_floats(Vec3{0, 0, foot} + normal * radius));
    s.inward.push_back(to_floats(-normal));
    s.reach_mm.push_back(static_cast<float>(radius));
    s.efficiency.push_back(efficiency_at(falloff_per_rad, normal_z));
  }
  return s;
}

}  // namespace osteo::inline simulation
