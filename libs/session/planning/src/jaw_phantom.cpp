#include "osteo/session/planning/detail/jaw_phantom.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "osteo/core/base/portable_math.h"
#include "osteo/core/data/rigid_transform.h"

namespace osteo::inline session {
namespace {

constexpr int kStations = 160, kAround = 40;
constexpr double kDeg = std::numbers::pi / 180;

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double between(double lo, double hi) { return lo + (hi - lo) * static_cast<double>(engine_() >> 11U) * 0x1p-53; }

 private:
  std::mt19937_64 engine_;
};

struct Station {
  Vec3 at, across, up;  // across and up: unit, at right angles to the course
  double half_width = 0, half_height = 0, exponent = 2;
};

Vec3 place(const Station& s, double turns) {
  const auto [sin, cos] = portable::sin_cos_turns(turns);
  const auto power = [&](double v) { return (v < 0 ? -1 : 1) * portable::pow(std::abs(v), 2 / s.exponent); };
  return s.at + s.across * (s.half_width * power(cos)) + s.up * (s.half_height * power(sin));
}

TriangleSoup swept(const std::function<Station(double)>& station) {
  TriangleSoup out;
  for (int k = 0; k <= kStations; ++k) {
    const Station s = station(static_cast<double>(k) / kStations);
    for (int n = 0; n < kAround; ++n) out.points_mm.push_back(place(s, static_cast<double>(n) / kAround));
  }
  const auto at = [](int k, int n) { return static_cast<std::uint32_t>(k * kAround + n % kAround); };
  for (int k = 0; k < kStations; ++k) {
    for (int n = 0; n < kAround; ++n) {
      out.triangles.push_back({at(k, n), at(k, n + 1), at(k + 1, n + 1)});
      out.triangles.push_back({at(k, n), at(k + 1, n + 1), at(k + 1, n)});
    }
  }
  for (const int k : {0, kStations}) {
    const auto middle = static_cast<std::uint32_t>(out.points_mm.size());
    out.points_mm.push_back(station(static_cast<double>(k) / kStations).at);
    for (int n = 0; n < kAround; ++n) {
      if (k == 0)
        out.triangles.push_back({middle, at(k, n + 1), at(k, n)});
      else
        out.triangles.push_back({middle, at(k, n), at(k, n + 1)});
    }
  }
  return out;
}

// From chin to condyle on the left: place, up, half a width and height.
struct Knot {
  Vec3 at, up;
  double half_width, half_height;
};
constexpr std::array<Knot, 7> kJaw{{{{0, 0, 0}, {0, 0, 1}, 7, 14},
                                    {{15, 3, 0}, {0, 0, 1}, 6.8, 14},
                                    {{29, 19, 1}, {0, 0, 1}, 6.6, 13.5},
                                    {{37, 41, 3}, {0, -0.15, 1}, 6.8, 13},
                                    {{43, 65, 12}, {0, -0.7, 0.7}, 5.5, 15},
                                    {{46, 74, 35}, {0, -1, 0.2}, 4.5, 15},
                                    {{48, 78, 60}, {0, -1, 0}, 4, 7}}};

Knot knot(int n) {
  Knot k = kJaw[static_cast<std::size_t>(std::min(std::abs(n), 6))];
  if (n < 0) k.at.x = -k.at.x;
  return k;
}

// E. Catmull, R. Rom, A class of local interpolating splines (1974); x from -6 to 6.
template <class T>
T spline(double x, const std::function<T(int)>& value) {
  const int n = std::clamp(static_cast<int>(std::floor(x)), -6, 5);
  const double s = x - n;
  const T b = value(n), c = value(n + 1);
  const T a = n > -6 ? value(n - 1) : b * 2 - c, d = n < 5 ? value(n + 2) : c * 2 - b;
  return (b * 2 + (c - a) * s + (a * 2 - b * 5 + c * 4 - d) * (s * s) + (b * 3 - a - c * 3 + d) * (s * s * s)) * 0.5;
}

}  // namespace

JawPhantom make_jaw_phantom(std::uint64_t seed, double border_mm, double asymmetry_mm) {
  Random random(seed);
  const double size = random.between(0.93, 1.07), wide = random.between(0.94, 1.06), thick = random.between(0.95, 1.1);
  const double phase = random.between(0, 1);
  const auto course = [&](double x) {
    Vec3 p = spline<Vec3>(x, [](int n) { return knot(n).at; });
    p = {p.x * size * wide, p.y * size, p.z * size};
    // One side alone differs.
    if (x > 0) p += Vec3{1, 0, 0.6} * (asymmetry_mm * x / 6 * portable::sin_cos_turns(phase + x / 6).sin);
    return p;
  };
  const auto along = [&](double x) { return normalized(course(x + 1e-4) - course(x - 1e-4)); };
  const double side = random.between(0, 1) < 0.5 ? -1 : 1;
  const double from = random.between(0.5, 1.2), to = from + random.between(1.4, 2.7);
  const double bulge = random.between(0.15, 0.6);
  const auto station = [&](double x, double tumour) {
    const auto width = spline<double>(x, [](int n) { return knot(n).half_width; });
    const auto height = spline<double>(x, [](int n) { return knot(n).half_height; });
    const Vec3 t = along(x), up0 = spline<Vec3>(x, [](int n) { return knot(n).up; });
    const Vec3 up = normalized(up0 - t * dot(up0, t));
    Station s{course(x), cross(up, t), up, width * thick, height * size, 3.5};
    const double in = (side * x - from) / (to - from);
    if (in > 0 && in < 1) {
      const double rise = portable::sin_cos_turns(in / 2).sin;
      s.half_width *= 1 + tumour * rise * rise;
      s.half_height *= 1 + 0.3 * tumour * rise * rise;
    }
    return s;
  };
  // How the head lay in the scanner.
  const RigidTransform pose =
      rotation_about({}, {1, 0, 0}, random.between(-10, 10) * kDeg) *
      rotation_about({}, {0, 1, 0}, random.between(-10, 10) * kDeg) *
      rotation_about({0, 0, random.between(-40, 40)}, {0, 0, 1}, random.between(-10, 10) * kDeg);
  JawPhantom out;
  out.jaw = swept([&](double k) { return station(12 * k - 6, bulge); });
  for (Vec3& p : out.jaw.points_mm) p = pose(p);
  out.symmetry_at_mm = pose({});
  out.symmetry_normal = pose.rotation * Vec3{1, 0, 0};
  const auto plane = [&](double x, double towards, Vec3& at, Vec3& normal) {
    const Station s = station(x, 0);
    const Vec3 n = along(x) * towards;
    const double tilt = random.between(-8, 8) * kDeg;
    at = pose(s.at);
    normal = pose.rotation * rotation_about({}, s.up, tilt)(n);
  };
  plane(side * from, side, out.a_mm, out.a_normal);
  plane(side * to, -side, out.b_mm, out.b_normal);
  for (int n = -20; n <= 220; ++n) {
    const double x = side * (from + (to - from) * n / 200.0);
    const Station s = station(x, 0);
    // Centroid of what lies less than border_mm above the lowest place, by thin rows.
    double area = 0, moment = 0;
    for (int row = 0; row < 400; ++row) {
      const double h = -s.half_height + border_mm * (row + 0.5) / 400;
      if (h > s.half_height) break;
      const double width = portable::pow(1 - portable::pow(std::abs(h) / s.half_height, s.exponent), 1 / s.exponent);
      area += width;
      moment += width * h;
    }
    const Vec3 p = pose(s.at + s.up * (moment / area));
    if (dot(p - out.a_mm, out.a_normal) >= 0 && dot(p - out.b_mm, out.b_normal) >= 0) out.contour_mm.push_back(p);
  }

  const double bow = random.between(1, 4), twist = random.between(-25, 25), radius = random.between(5.4, 6.3);
  const double shaft = random.between(320, 380), flat = random.between(0.05, 0.12), lies = random.between(0, 1);
  out.donor.points_mm.clear();
  out.donor = swept([&](double k) {
    const auto [sin, cos] = portable::sin_cos_turns(lies + twist / 360 * k);
    const double ends = portable::pow(std::abs(2 * k - 1), 8);
    Station s;
    s.at = {bow * portable::sin_cos_turns(k / 2).sin + 90, 0, -600 - shaft * k};
    s.across = {cos, -sin, 0};
    s.up = {-sin, -cos, 0};
    s.half_width = radius * (1 + flat) * (1 + 0.6 * ends) * (1 + 0.05 * portable::sin_cos_turns(k).sin);
    s.half_height = radius * (1 - flat) * (1 + 0.6 * ends);
    s.exponent = 2.3;
    return s;
  });
  return out;
}

}  // namespace osteo::inline session
