// How often a surface winds around a point: crossings of a ray along x, fans that close openings, solid angles.
// Private to libs/geometry/distance.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "osteo/core/base/portable_math.h"
#include "osteo/geometry/distance/detail/fan.h"
#include "osteo/geometry/distance/voxelize.h"
#include "osteo/geometry/mesh/soup.h"

namespace osteo::inline geometry {

/// Triangles that close a surface, one fan for each connected set of open edges.
[[nodiscard]] std::vector<Fan> closing_fans(const Ordered& surface, const std::vector<Vec3>& points);

/// voxels_inside, which also tells how many solid angles it took: what an open surface costs.
[[nodiscard]] VoxelBits voxels_inside_counted(const TriangleSoup& soup, const Frame& frame, const Context& context,
                                              InsideReport* report, std::uint64_t& solid_angles);

/// Solid angle of a triangle seen from p, positive from the side it faces away from.
/// A. van Oosterom and J. Strackee, IEEE Trans. Biomed. Eng. 1983.
[[nodiscard]] inline double solid_angle(Vec3 a, Vec3 b, Vec3 c, Vec3 p) {
  a = a - p, b = b - p, c = c - p;
  const double la = length(a), lb = length(b), lc = length(c);
  const double det = dot(a, cross(b, c));
  const double along = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
  if (det == 0 && along == 0) return 0;
  return 2 * portable::atan2(det, along);
}

/// Where the plane z = `level` cuts a triangle: at (y[0], x[0]) the edge that goes up in z, at [1] the one that goes
/// down. Which edges are cut, and where, is a property of the edge alone, so that triangles that share it never leave a
/// gap nor overlap, whatever the rounding.
struct LevelCut {
  double y[2] = {0, 0}, x[2] = {0, 0};
  bool any = false;
};
[[nodiscard]] inline LevelCut cut(const Vec3& a, const Vec3& b, const Vec3& c, double level) {
  LevelCut result;
  const Vec3* corner[3] = {&a, &b, &c};
  for (int e = 0; e < 3; ++e) {
    const Vec3 *p = corner[e], *q = corner[e == 2 ? 0 : e + 1];
    const bool p_below = p->z < level, q_below = q->z < level;
    if (p_below == q_below) continue;
    const Vec3 &low = p_below ? *p : *q, &high = p_below ? *q : *p;
    const double t = (level - low.z) / (high.z - low.z);
    const int which = p_below ? 0 : 1;
    result.y[which] = low.y + t * (high.y - low.y);
    result.x[which] = low.x + t * (high.x - low.x);
    result.any = true;
  }
  return result;
}

/// Where the line along x through p passes a triangle: +1 where it enters what the triangle bounds, -1 where it leaves,
/// 0 where it passes beside.
struct LineCrossing {
  int turns = 0;
  double at = 0;  ///< x
};
[[nodiscard]] inline LineCrossing crossing_of_line(const Vec3& a, const Vec3& b, const Vec3& c, Vec3 p) {
  const LevelCut s = cut(a, b, c, p.z);
  if (!s.any) return {};
  const bool leaves = s.y[0] > s.y[1];
  const double y0 = leaves ? s.y[1] : s.y[0], y1 = leaves ? s.y[0] : s.y[1];
  if (!(y0 <= p.y && p.y < y1)) return {};
  const double x0 = leaves ? s.x[1] : s.x[0], x1 = leaves ? s.x[0] : s.x[1];
  const double x = std::clamp(x0 + (p.y - y0) * ((x1 - x0) / (y1 - y0)), std::min(x0, x1), std::max(x0, x1));
  return {leaves ? -1 : 1, x};
}

/// +1 or -1 when the ray that comes along x to p enters or leaves through the triangle, else 0.
[[nodiscard]] inline int crossing_before(const Vec3& a, const Vec3& b, const Vec3& c, Vec3 p) {
  const LineCrossing x = crossing_of_line(a, b, c, p);
  return x.turns != 0 && x.at <= p.x ? x.turns : 0;
}

}  // namespace osteo::inline geometry
