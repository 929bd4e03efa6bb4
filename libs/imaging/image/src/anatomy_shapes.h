// Solids and tubes that the head is made of, as signed distances (mm, negative inside).
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "osteo/core/base/portable_math.h"
#include "osteo/imaging/image/detail/head_anatomy.h"

namespace osteo::inline imaging::anatomy {

// Distances are signed, negative inside, and grow by at most kLipschitz a mm: ellipsoids and sheared bodies are
// first-order.
inline constexpr double kLipschitz = 1.6;

// Union and intersection with a fillet of about k mm: polynomial, exact where the two are further apart than k.
inline double smin(double a, double b, double k) {
  const double h = std::max(k - std::abs(a - b), 0.0);
  return std::min(a, b) - h * h / (4 * k);
}
inline double smax(double a, double b, double k) {
  return -smin(-a, -b, k);
}
inline double ramp(double x, double from, double to) {  // 0 to 1, smooth
  const double t = std::clamp((x - from) / (to - from), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}
inline double mix(double a, double b, double t) {
  return a + (b - a) * t;
}

inline double ellipsoid(Vec3 p, Vec3 c, Vec3 r) {
  const Vec3 d = p - c;
  const Vec3 u{d.x / r.x, d.y / r.y, d.z / r.z};
  const Vec3 v{u.x / r.x, u.y / r.y, u.z / r.z};
  const double k0 = length(u), k1 = length(v);
  // First order; within flat ones not above 1.5 times what is sure.
  const double least = std::min({r.x, r.y, r.z});
  return k0 < 1 ? std::max(k1 > 1e-9 ? k0 * (k0 - 1) / k1 : -least, 1.5 * (k0 - 1) * least) : k0 * (k0 - 1) / k1;
}
inline double cone(Vec3 p, Vec3 a, Vec3 b, double ra, double rb) {  // round cone
  const Vec3 ab = b - a;
  const double t = std::clamp(dot(p - a, ab) / dot(ab, ab), 0.0, 1.0);
  return length(p - (a + ab * t)) - mix(ra, rb, t);
}
inline double box(Vec3 p, Vec3 c, Vec3 half, double round) {
  const Vec3 q{std::abs(p.x - c.x) - half.x + round, std::abs(p.y - c.y) - half.y + round,
               std::abs(p.z - c.z) - half.z + round};
  const Vec3 o{std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0)};
  return length(o) + std::min(std::max({q.x, q.y, q.z}), 0.0) - round;
}
inline double torus(Vec3 p, Vec3 c, Vec3 axis, double ring, double tube) {
  const Vec3 d = p - c;
  const double h = dot(d, axis), r = length(d - axis * h);
  return portable::hypot(r - ring, h) - tube;
}
inline double segment2(double x, double y, double ax, double ay, double bx, double by) {
  const double ux = bx - ax, uy = by - ay;
  const double t = std::clamp(((x - ax) * ux + (y - ay) * uy) / (ux * ux + uy * uy), 0.0, 1.0);
  return portable::hypot(x - ax - ux * t, y - ay - uy * t);
}
// Distance in the axial plane from an ellipse around (0, y0), to first order.
inline double arch(Vec3 p, double rx, double y0, double ry) {
  const double u = p.x / rx, v = (p.y - y0) / ry, f = portable::hypot(u, v);
  return std::abs(f - 1) / std::max(portable::hypot(u / rx, v / ry) / std::max(f, 1e-9), 1e-9);
}

// splitmix64.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    std::uint64_t z = state_ += 0x9e3779b97f4a7c15ULL;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  }
  double uniform() { return (static_cast<double>(next() >> 11) + 0.5) * 0x1p-53; }
  double uniform(double lo, double hi) { return mix(lo, hi, uniform()); }
  /// Near normal (the sum of twelve), cut at two standard deviations.
  double normal() {
    double sum = -6;
    for (int i = 0; i < 12; ++i) sum += uniform();
    return std::clamp(sum, -2.0, 2.0);
  }

 private:
  std::uint64_t state_;
};

// A tube along a smooth line through given points (Catmull-Rom), as short straight pieces in chunks with boxes.
class Tube {
 public:
  Tube() = default;
  explicit Tube(const std::vector<TubePoint>& control) {
    constexpr int kSteps = 6;
    const auto n = static_cast<int>(control.size());
    const auto at = [&](int i) { return control[static_cast<std::size_t>(std::clamp(i, 0, n - 1))]; };
    points_.push_back(control.front());
    for (int i = 0; i + 1 < n; ++i) {
      const TubePoint a = at(i - 1), b = at(i), c = at(i + 1), d = at(i + 2);
      Chunk chunk{{1e30, 1e30, 1e30}, {-1e30, -1e30, -1e30}, points_.size() - 1, 0};
      for (int s = 1; s <= kSteps; ++s) {
        const double t = static_cast<double>(s) / kSteps, t2 = t * t, t3 = t2 * t;
        const double wa = -0.5 * t3 + t2 - 0.5 * t, wb = 1.5 * t3 - 2.5 * t2 + 1, wc = -1.5 * t3 + 2 * t2 + 0.5 * t,
                     wd = 0.5 * t3 - 0.5 * t2;
        points_.push_back(
            {a.at_mm * wa + b.at_mm * wb + c.at_mm * wc + d.at_mm * wd, mix(b.radius_mm, c.radius_mm, t)});
      }
      chunk.last = points_.size() - 1;
      for (std::size_t k = chunk.first; k <= chunk.last; ++k) {
        for (std::size_t x = 0; x < 3; ++x) {
          chunk.lo[x] = std::min(chunk.lo[x], points_[k].at_mm[x] - points_[k].radius_mm);
          chunk.hi[x] = std::max(chunk.hi[x], points_[k].at_mm[x] + points_[k].radius_mm);
        }
      }
      chunks_.push_back(chunk);
    }
  }
  /// Exact up to `reach`; beyond, the distance of the nearest box, which is more than `reach` and less than exact.
  [[nodiscard]] double distance(Vec3 p, double reach) const {
    double best = 1e30;
    for (const Chunk& c : chunks_) {
      const Vec3 o{std::max({c.lo.x - p.x, p.x - c.hi.x, 0.0}), std::max({c.lo.y - p.y, p.y - c.hi.y, 0.0}),
                   std::max({c.lo.z - p.z, p.z - c.hi.z, 0.0})};
      const double away = length(o);
      if (away > reach || away > std::max(best, 0.0)) {
        best = std::min(best, away);
        continue;
      }
      for (std::size_t k = c.first; k < c.last; ++k) {
        best = std::min(
            best, cone(p, points_[k].at_mm, points_[k + 1].at_mm, points_[k].radius_mm, points_[k + 1].radius_mm));
      }
    }
    return best;
  }
  [[nodiscard]] const std::vector<TubePoint>& points() const { return points_; }

 private:
  struct Chunk {
    Vec3 lo, hi;
    std::size_t first = 0, last = 0;
  };
  std::vector<TubePoint> points_;
  std::vector<Chunk> chunks_;
};

}  // namespace osteo::inline imaging::anatomy
