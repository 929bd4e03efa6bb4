// A smooth closed shape with everything known: surface, normals, and a recording of a probe moving over it with a known
// force. It stands for the scanned duck of D. Morris 2006, chapter 7.
#pragma once
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "osteo/geometry/mesh/soup.h"
#include "osteo/simulation/haptics/fields.h"

namespace osteo::test {

inline constexpr double kDuckRadius = 30;

/// r = R (1 + 0.12 sin^3 t sin 3p + 0.06 sin^2 t cos 2t) over polar angle t and azimuth p.
inline double duck_radius(Vec3 direction) {
  const double c = direction.z, s = std::sqrt(std::max(0.0, 1 - c * c)), p = std::atan2(direction.y, direction.x);
  return kDuckRadius * (1 + 0.12 * s * s * s * std::sin(3 * p) + 0.06 * s * s * (2 * c * c - 1));
}
/// Positive outside; its slope is near 1.
inline double duck(Vec3 x) {
  const double n = length(x);
  return n > 0 ? n - duck_radius(x / n) : -kDuckRadius;
}
inline Vec3 duck_normal(Vec3 x) {
  const double e = 1e-5;
  return normalized({duck(x + Vec3{e, 0, 0}) - duck(x - Vec3{e, 0, 0}),
                     duck(x + Vec3{0, e, 0}) - duck(x - Vec3{0, e, 0}),
                     duck(x + Vec3{0, 0, e}) - duck(x - Vec3{0, 0, e})});
}

/// On a grid of n voxels along each axis, from -half to half.
inline CubicField duck_field(int n, double half = 40) {
  Frame f;
  f.dims = {n, n, n};
  const double h = 2 * half / (n - 1);
  f.spacing_mm = {h, h, h};
  f.origin_mm = {-half, -half, -half};
  std::vector<float> v(f.voxel_count());
  std::size_t at = 0;
  for (int k = 0; k < n; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i)
        v[at++] = static_cast<float>(duck(f.world_from_index({double(i), double(j), double(k)})));
  return CubicField(f, std::move(v));
}

/// 2 (rings - 1) sectors triangles.
inline TriangleSoup duck_mesh(int rings, int sectors, double scale = 1, Vec3 offset = {}) {
  TriangleSoup m;
  const auto at = [&](double t, double p) {
    const Vec3 d{std::sin(t) * std::cos(p), std::sin(t) * std::sin(p), std::cos(t)};
    return d * (duck_radius(d) * scale) + offset;
  };
  m.points_mm.push_back(at(0, 0));
  for (int r = 1; r < rings; ++r)
    for (int s = 0; s < sectors; ++s) m.points_mm.push_back(at(M_PI * r / rings, 2 * M_PI * s / sectors));
  m.points_mm.push_back(at(M_PI, 0));
  const auto id = [&](int r, int s) { return static_cast<std::uint32_t>(1 + (r - 1) * sectors + s % sectors); };
  const auto last = static_cast<std::uint32_t>(m.points_mm.size() - 1);
  for (int s = 0; s < sectors; ++s) {
    m.triangles.push_back({0, id(1, s), id(1, s + 1)});
    m.triangles.push_back({last, id(rings - 1, s + 1), id(rings - 1, s)});
    for (int r = 1; r + 1 < rings; ++r) {
      m.triangles.push_back({id(r, s), id(r + 1, s), id(r + 1, s + 1)});
      m.triangles.push_back({id(r, s), id(r + 1, s + 1), id(r, s + 1)});
    }
  }
  return m;
}

/// What a stiff probe would have recorded: it runs over the duck with a normal force of 1.2 +- 0.8 N and Coulomb
/// friction; the device lies where a spring of k = 0.5 N/mm explains the force (chapter 7's method).
struct DuckTick {
  Vec3 surface_mm, device_mm, force_n;
};
inline constexpr double kDuckStiffness = 0.5;
inline std::vector<DuckTick> duck_recording(double friction, double seconds = 20, double rate_hz = 1000) {
  const auto place = [](double s) {
    const double t = M_PI / 2 + 0.9 * std::sin(0.83 * s) + 0.15 * std::sin(2.9 * s),
                 p = 0.9 * s + 0.4 * std::sin(1.7 * s);
    const Vec3 d{std::sin(t) * std::cos(p), std::sin(t) * std::sin(p), std::cos(t)};
    return d * duck_radius(d);
  };
  std::vector<DuckTick> all;
  for (int i = 0; i < static_cast<int>(seconds * rate_hz); ++i) {
    const double s = i / rate_hz;
    DuckTick tick;
    tick.surface_mm = place(s);
    const Vec3 n = duck_normal(tick.surface_mm), v = normalized(place(s + 1e-4) - place(s - 1e-4));
    const double push = 1.2 + 0.8 * std::sin(2.3 * s);
    tick.force_n = n * push - v * (friction * push);
    tick.device_mm = tick.surface_mm - tick.force_n / kDuckStiffness;
    all.push_back(tick);
  }
  return all;
}

struct DuckError {
  double mean_n = 0, worst_n = 0, p95_n = 0;
  int lost = 0;  ///< ticks without contact
  double evaluations = 0;
};

}  // namespace osteo::test
