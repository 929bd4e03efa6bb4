// What a burr on a given path must remove, and what it does: for tests and benchmarks of removal.
#pragma once
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "osteo/simulation/haptics/device.h"
#include "osteo/simulation/haptics/renderer.h"

namespace osteo::test {

/// Bone on the inner side of a plane: dot(normal, p) < at_mm.
struct Face {
  Vec3 normal{0, 0, 1};
  double at_mm = 0;
};

/// A block of bone of 16 x 18 x 8 mm, x from -8, y from -6, its face near z = 0; densities exact; the face must not
/// stand steep.
inline BrickGrid block(double h, const Face& face) {
  Frame f;
  f.dims = {static_cast<int>(16 / h), static_cast<int>(18 / h), static_cast<int>(8 / h)};
  f.spacing_mm = {h, h, h};
  f.origin_mm = {-8, -6, -5};
  BrickGrid g = BrickGrid::dense(f);
  constexpr int n = 32;
  for (int k = 0; k < f.dims[2]; ++k)
    for (int j = 0; j < f.dims[1]; ++j)
      for (int i = 0; i < f.dims[0]; ++i) {
        const double inside = face.at_mm - dot(face.normal, f.world_from_index({double(i), double(j), double(k)}));
        if (inside < -0.87 * h) continue;
        // By 32^2 columns along z, each cut where the face is.
        double share = inside < 0.87 * h ? 0 : 1;
        for (int s = 0; s < n * n && inside < 0.87 * h; ++s) {
          const double x = (s % n + 0.5) / n - 0.5, y = (s / n + 0.5) / n - 0.5;
          const double high = (inside / h - face.normal.x * x - face.normal.y * y) / face.normal.z;
          share += std::clamp(high + 0.5, 0.0, 1.0) / (n * n);
        }
        g.set(g.find(i, j, k), static_cast<float>(std::min(share, 1.0)));
      }
  return g;
}

/// Straight from point to point, each leg at its speed; at the end it stays for a while.
struct Path {
  struct Leg {
    Vec3 to_mm;
    double mm_per_s;
  };
  Vec3 from_mm;
  std::vector<Leg> legs;
  double stay_s = 0;
  int tool = 3;
  Vec3 axis{0.6, 0, 0.8};

  [[nodiscard]] double seconds() const {
    double t = stay_s;
    Vec3 x = from_mm;
    for (const Leg& leg : legs) {
      t += length(leg.to_mm - x) / leg.mm_per_s;
      x = leg.to_mm;
    }
    return t;
  }
  [[nodiscard]] Vec3 at(double t_s) const {
    Vec3 x = from_mm;
    for (const Leg& leg : legs) {
      const double way = length(leg.to_mm - x), t = way / leg.mm_per_s;
      if (t_s < t) return x + (leg.to_mm - x) * (t_s / t);
      t_s -= t;
      x = leg.to_mm;
    }
    return x;
  }
  [[nodiscard]] DeviceSample sample(double t_s) const {
    DeviceSample s;
    s.position_mm = to_floats(at(t_s));
    s.axis = to_floats(normalized(axis));
    s.pedal = 255;
    s.tool = static_cast<std::uint8_t>(tool);
    return s;
  }
};

/// Volume of bone that the burr is in anywhere on its path: poses 0.02 mm apart, and points spread evenly through
/// the box around them.
inline double swept_mm3(const Path& path, const Face& face, int points = 200000) {
  const RoundCone head = burr_library()[static_cast<std::size_t>(path.tool)].head();
  const Vec3 axis = normalized(path.axis);
  std::vector<Vec3> poses{path.from_mm};
  for (const Path::Leg& leg : path.legs) {
    const Vec3 from = poses.back();
    const int n = static_cast<int>(std::ceil(length(leg.to_mm - from) / 0.02));
    for (int i = 1; i <= n; ++i) poses.push_back(from + (leg.to_mm - from) * (static_cast<double>(i) / n));
  }
  // Only poses that reach the bone count.
  const double lowest = std::max(-dot(axis, face.normal) * head.length_mm + head.end_radius_mm, head.start_radius_mm);
  std::erase_if(poses, [&](Vec3 x) { return dot(face.normal, x) - lowest > face.at_mm; });
  Vec3 lo{1e9, 1e9, 1e9}, hi{-1e9, -1e9, -1e9};
  for (const Vec3& x : poses) {
    for (std::size_t a = 0; a < 3; ++a) {
      const double end = x[a] + axis[a] * head.length_mm;
      lo[a] = std::min({lo[a], x[a] - head.start_radius_mm, end - head.end_radius_mm});
      hi[a] = std::max({hi[a], x[a] + head.start_radius_mm, end + head.end_radius_mm});
    }
  }
  // The lowest part of an oblique face within the box.
  double top = -1e9;
  for (const double x : {lo.x, hi.x})
    for (const double y : {lo.y, hi.y})
      top = std::max(top, (face.at_mm - face.normal.x * x - face.normal.y * y) / face.normal.z);
  hi.z = std::min(hi.z, top);
  if (poses.empty() || !(hi.z > lo.z)) return 0;
  int inside = 0;
  for (int n = 0; n < points; ++n) {
    // Multiples of roots that are no multiples of each other: spread evenly in all three.
    const auto part = [&](double a) { return (0.5 + a * n) - std::floor(0.5 + a * n); };
    const Vec3 p{lo.x + (hi.x - lo.x) * part(std::numbers::sqrt2), lo.y + (hi.y - lo.y) * part(2.6457513110645906),
                 lo.z + (hi.z - lo.z) * part(3.3166247903554)};
    if (!(dot(face.normal, p) < face.at_mm)) continue;
    for (const Vec3& x : poses) {
      const Vec3 q = p - x;
      const double along = dot(q, axis), off = std::sqrt(std::max(0.0, dot(q, q) - along * along));
      const double foot = head.foot_mm(off, along), r = head.radius_at_mm(foot);
      if (dot(q, q) - 2 * foot * along + foot * foot < r * r) {
        ++inside;
        break;
      }
    }
  }
  return (hi.x - lo.x) * (hi.y - lo.y) * (hi.z - lo.z) * inside / points;
}

/// What drilling along the path really removes, mm3: what is missing in the bone.
inline double removed_mm3(const Path& path, BrickGrid& bone, ContactMethod method, double rate_hz) {
  HapticSetup setup;
  setup.params.contact.method = method;
  setup.params.effects.vibration = setup.params.effects.shaft = setup.params.effects.fail_safe = false;
  setup.device = SpringHand::traits();
  HapticRenderer renderer(setup, bone, {}, 1 / rate_hz);
  const double before = bone.sum();
  const auto ticks = static_cast<int>(path.seconds() * rate_hz);
  for (int t = 0; t <= ticks; ++t) static_cast<void>(renderer.step(path.sample(t / rate_hz)));
  return (before - bone.sum()) * bone.frame().voxel_volume_mm3();
}

/// Along x at a depth below a face at z = 0, from above it; `passes` beside each other, back and forth.
inline Path groove(int tool, double depth_mm, double mm_per_s, int passes, double aside_mm, Vec3 axis = {0.6, 0, 0.8}) {
  Path p;
  p.tool = tool;
  p.axis = normalized(axis);
  const RoundCone head = burr_library()[static_cast<std::size_t>(tool)].head();
  const double lowest = std::max(head.start_radius_mm, head.end_radius_mm - head.length_mm * p.axis.z);
  Vec3 x{-2.03, -0.17 - 0.5 * aside_mm * (passes - 1), lowest - depth_mm};
  p.from_mm = x + Vec3{0, 0, depth_mm + 0.3};
  p.legs.push_back({x, 5});
  for (int n = 0; n < passes; ++n) {
    x.x = -x.x;
    p.legs.push_back({x, mm_per_s});
    if (n + 1 < passes) {
      x.y += aside_mm;
      p.legs.push_back({x, mm_per_s});
    }
  }
  return p;
}
/// Down at one place, and staying there.
inline Path dwell(int tool, double depth_mm, double stay_s, Vec3 axis = {0.6, 0, 0.8}) {
  Path p = groove(tool, depth_mm, 1, 0, 0, axis);
  p.stay_s = stay_s;
  return p;
}

}  // namespace osteo::test
