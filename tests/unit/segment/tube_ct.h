// CTs of tubes whose centre line and radius are known by a formula.
#pragma once
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include "osteo/core/base/parallel.h"
#include "osteo/core/data/volume.h"
#include "osteo/imaging/segment/tube.h"

namespace osteo::test {

struct Line {
  std::vector<Vec3> points;  ///< a tenth to a quarter of a mm apart
  double radius_mm = 1;
};

inline Line straight_line(double radius) {
  Line l{{}, radius};
  for (int i = 0; i <= 80; ++i) l.points.push_back(Vec3{-6, -7, -9} + Vec3{12, 15, 18} * (i / 80.0));
  return l;
}
/// Radius 5, rise 7 a turn, one and a half turns.
inline Line helix(double radius) {
  Line l{{}, radius};
  for (int i = 0; i <= 240; ++i) {
    const double a = 3 * std::numbers::pi * i / 240;
    l.points.push_back({5 * std::cos(a), 5 * std::sin(a), -5.25 + 7 * a / (2 * std::numbers::pi)});
  }
  return l;
}
/// Two straight parts that meet at 75 degrees in a bend of radius 2, as at the geniculate ganglion.
inline Line genu(double radius) {
  Line l{{}, radius};
  constexpr double kBend = 2, kTurn = 105 * std::numbers::pi / 180;
  for (int i = 0; i <= 32; ++i) l.points.push_back({-8.0 + 8.0 * i / 32, 0, 0});
  for (int i = 1; i <= 32; ++i) {
    const double a = kTurn * i / 32;
    l.points.push_back({kBend * std::sin(a), kBend * (1 - std::cos(a)), 0});
  }
  const Vec3 end = l.points.back(), along{std::cos(kTurn), std::sin(kTurn), 0};
  for (int i = 1; i <= 32; ++i) l.points.push_back(end + along * (8.0 * i / 32));
  for (Vec3& p : l.points) p = {p.x + 2, 0.8 * (p.y - 4), 0.6 * (p.y - 4)};  // out of the plane of the slices
  return l;
}

inline double distance_to(const Line& l, Vec3 p) {
  double best = 1e30;
  for (std::size_t i = 0; i + 1 < l.points.size(); ++i) {
    const Vec3 ab = l.points[i + 1] - l.points[i];
    const double t = std::clamp(dot(p - l.points[i], ab) / dot(ab, ab), 0.0, 1.0);
    best = std::min(best, length(p - (l.points[i] + ab * t)));
  }
  return best;
}

struct TubeCt {
  Vec3 spacing_mm{0.5, 0.5, 0.5};
  double noise_hu = 30;
  bool oblique = false;
  bool cellular = false;  ///< air cells of 1 to 2 mm radius up to 0.8 mm from the tube
  double inside_hu = 50, wall_hu = 960;
};

/// Voxels hold the mean of 27 samples, spread by (1 4 1)/6 along each axis as the phantom's, plus noise.
inline Image make_tube_ct(const Line& line, const TubeCt& s) {
  Vec3 lo{1e9, 1e9, 1e9}, hi = lo * -1;
  for (const Vec3 p : line.points) {
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], p[a] - 6);
      hi[a] = std::max(hi[a], p[a] + 6);
    }
  }
  Frame f;
  f.spacing_mm = s.spacing_mm;
  if (s.oblique) {
    const Vec3 u = normalized({1, 0.25, -0.15}), w = normalized(cross(u, {0.1, 1, 0.3}));
    f.direction = {{u, cross(w, u), w}};
  }
  Vec3 size;
  for (std::size_t a = 0; a < 3; ++a) {
    size[a] = (hi[a] - lo[a]) * (s.oblique ? 1.25 : 1);
    f.dims[a] = static_cast<int>(size[a] / s.spacing_mm[a]) + 1;
    size[a] = (f.dims[a] - 1) * s.spacing_mm[a];
  }
  f.origin_mm = (lo + hi) * 0.5 - f.direction * (size * 0.5);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  struct Ball {
    Vec3 c;
    double r;
  };
  std::vector<Ball> cells;
  for (int i = 0; s.cellular && i < 6000; ++i) {
    const Vec3 c{lo.x + (hi.x - lo.x) * unit(random), lo.y + (hi.y - lo.y) * unit(random),
                 lo.z + (hi.z - lo.z) * unit(random)};
    const double r = 1 + unit(random);
    if (distance_to(line, c) < line.radius_mm + r + 0.8) continue;
    if (std::any_of(cells.begin(), cells.end(), [&](const Ball& b) { return length(b.c - c) < b.r + r + 0.4; }))
      continue;
    cells.push_back({c, r});
  }
  const auto value = [&](Vec3 p) {
    for (const Ball& b : cells)
      if (length(p - b.c) < b.r) return -1000.0;
    return s.wall_hu;
  };
  const std::size_t n = f.voxel_count();
  std::vector<float> v(n);
  const auto nx = static_cast<std::size_t>(f.dims[0]), ny = static_cast<std::size_t>(f.dims[1]);
  parallel_for(n, 512, 0, [&](std::size_t begin, std::size_t end) {
    for (std::size_t at = begin; at < end; ++at) {
      const Vec3 index{double(at % nx), double(at / nx % ny), double(at / nx / ny)};
      const double near = distance_to(line, f.world_from_index(index)) - line.radius_mm;
      double sum = 0;
      for (int q = 0; q < 27; ++q) {
        const Vec3 p = f.world_from_index(index + Vec3{q % 3 - 1.0, q / 3 % 3 - 1.0, q / 9 - 1.0} / 3);
        const bool in = near < -1 || (near < 1 && distance_to(line, p) < line.radius_mm);
        sum += in ? s.inside_hu : value(p);
      }
      v[at] = static_cast<float>(sum / 27);
    }
  });
  for (std::size_t a = 0; a < 3; ++a) {
    const std::size_t stride = a == 0 ? 1 : a == 1 ? nx : nx * ny;
    std::vector<float> w(n);
    for (std::size_t at = 0; at < n; ++at) {
      const std::size_t i = at / stride % static_cast<std::size_t>(f.dims[a]);
      const float before = i > 0 ? v[at - stride] : v[at],
                  after = i + 1 < static_cast<std::size_t>(f.dims[a]) ? v[at + stride] : v[at];
      w[at] = (before + 4 * v[at] + after) / 6;
    }
    v = w;
  }
  const auto hu = make_voxels<std::int16_t>(n);
  // Twelve uniform draws: the same in every standard library.
  for (std::size_t at = 0; at < n; ++at) {
    double g = -6;
    for (int q = 0; q < 12; ++q) g += static_cast<double>(random()) / 4294967296.0;
    hu[at] = static_cast<std::int16_t>(std::lround(static_cast<double>(v[at]) + s.noise_hu * g));
  }
  return {f, hu};
}

/// Of the found line, how far it is from the true one; of the true one, how far from the found.
struct LineError {
  double mean_mm = 0, worst_mm = 0;
};
inline LineError line_error(const Tube& tube, const Line& truth) {
  LineError e;
  Line found;
  for (const TubeStation& s : tube.stations) found.points.push_back(s.at_mm);
  std::size_t n = 0;
  const auto add = [&](double d) {
    e.mean_mm += d;
    e.worst_mm = std::max(e.worst_mm, d);
    ++n;
  };
  for (const Vec3 p : found.points) add(distance_to(truth, p));
  for (std::size_t i = 0; i < truth.points.size(); ++i) add(distance_to(found, truth.points[i]));
  e.mean_mm /= static_cast<double>(n);
  return e;
}

}  // namespace osteo::test
