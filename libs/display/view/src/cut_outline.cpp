#include "osteo/display/view/live_cut.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <unordered_map>

namespace osteo::inline display {

std::vector<CutLine> section_of(const TriMesh& mesh, Vec3 through, Vec3 normal) {
  constexpr std::uint32_t kNone = 0xffffffffU;
  std::vector<double> above(mesh.points_mm.size());
  for (std::size_t p = 0; p < above.size(); ++p) above[p] = dot(from_floats(mesh.points_mm[p]) - through, normal);

  // Points lie on edges of the mesh; two triangles of a closed one meet in each.
  std::unordered_map<std::uint64_t, std::uint32_t> point_of_edge;
  std::vector<Vec3> points;
  std::vector<std::array<std::uint32_t, 2>> beside;
  std::vector<std::array<std::uint32_t, 2>> more;  // a third segment and on, where the mesh is no manifold
  const auto point_on = [&](std::uint32_t a, std::uint32_t b) {
    if (a > b) std::swap(a, b);
    const auto [it, is_new] =
        point_of_edge.try_emplace(std::uint64_t{a} << 32 | b, static_cast<std::uint32_t>(points.size()));
    if (is_new) {
      const Vec3 p = from_floats(mesh.points_mm[a]), q = from_floats(mesh.points_mm[b]);
      points.push_back(p + (q - p) * (above[a] / (above[a] - above[b])));
      beside.push_back({kNone, kNone});
    }
    return it->second;
  };
  for (const auto& t : mesh.triangles) {
    const std::array<bool, 3> up{above[t[0]] >= 0, above[t[1]] >= 0, above[t[2]] >= 0};
    if (up[0] == up[1] && up[1] == up[2]) continue;
    const std::size_t lone = up[1] == up[2] ? 0 : up[0] == up[2] ? 1 : 2;
    const std::uint32_t a = point_on(t[lone], t[(lone + 1) % 3]), b = point_on(t[lone], t[(lone + 2) % 3]);
    const auto room = [&](std::uint32_t p) { return beside[p][0] == kNone || beside[p][1] == kNone; };
    if (!room(a) || !room(b)) {
      more.push_back({a, b});
      continue;
    }
    beside[a][beside[a][0] == kNone ? 0 : 1] = b;
    beside[b][beside[b][0] == kNone ? 0 : 1] = a;
  }

  std::vector<CutLine> lines;
  std::vector<bool> done(points.size(), false);
  const auto walk = [&](std::uint32_t first) {
    CutLine line;
    std::uint32_t before = kNone, at = first;
    while (at != kNone && !done[at]) {
      done[at] = true;
      line.points_mm.push_back(points[at]);
      const std::uint32_t next = beside[at][0] != before ? beside[at][0] : beside[at][1];
      before = at;
      at = next;
    }
    line.closed = at == first && line.points_mm.size() > 2;
    lines.push_back(std::move(line));
  };
  for (std::uint32_t p = 0; p < points.size(); ++p) {  // open ends first, so that a line is walked whole
    if (!done[p] && beside[p][1] == kNone) walk(p);
  }
  for (std::uint32_t p = 0; p < points.size(); ++p) {
    if (!done[p]) walk(p);
  }
  for (const auto& m : more) lines.push_back({{points[m[0]], points[m[1]]}, false});
  return lines;
}

CutLine section_of(const RoundCone& shape, Vec3 at, Vec3 axis, Vec3 through, Vec3 normal) {
  // A cut of a round convex body is convex, and the same on both sides of the axis as seen along the normal: a line u
  // along it, half widths v beside it.
  const Vec3 flat = axis - normal * dot(axis, normal);
  const Vec3 u = length(flat) > 1e-9 ? normalized(flat) : any_perpendicular(normal), v = cross(normal, u);
  const Vec3 base = at - normal * dot(at - through, normal);
  const Vec3 side = any_perpendicular(axis), other = cross(axis, side);
  const auto distance = [&](double along, double across) {
    const Vec3 p = base + u * along + v * across - at;
    return shape.distance_mm({dot(p, side), dot(p, other), dot(p, axis)});
  };
  // Where it lies at all: the least distance along u, which has one minimum.
  const double reach = std::abs(shape.start_mm) + shape.length_mm + 2 * shape.largest_radius_mm();
  double lo = -reach, hi = reach;
  for (int n = 0; n < 60 && hi - lo > 1e-7; ++n) {
    const double a = lo + (hi - lo) * 0.382, b = lo + (hi - lo) * 0.618;
    (distance(a, 0) < distance(b, 0) ? hi : lo) = distance(a, 0) < distance(b, 0) ? b : a;
  }
  const double deepest = (lo + hi) / 2;
  if (!(distance(deepest, 0) < 0)) return {};
  const auto edge = [](double inside, double outside, auto&& f) {
    for (int n = 0; n < 40 && std::abs(outside - inside) > 1e-6; ++n) {
      const double m = (inside + outside) / 2;
      (f(m) < 0 ? inside : outside) = m;
    }
    return inside;
  };
  const auto along = [&](double a) { return distance(a, 0); };
  const double first = edge(deepest, -reach, along), last = edge(deepest, reach, along);
  constexpr int kHalf = 64;
  CutLine line;
  line.closed = true;
  std::array<double, kHalf + 1> at_u{}, half{};
  for (int n = 0; n <= kHalf; ++n) {
    const auto i = static_cast<std::size_t>(n);
    at_u[i] = (first + last) / 2 - (last - first) / 2 * std::cos(std::numbers::pi * n / kHalf);
    const double a = at_u[i];
    half[i] = n == 0 || n == kHalf ? 0 : edge(0, reach, [&](double across) { return distance(a, across); });
  }
  for (std::size_t n = 0; n <= kHalf; ++n) line.points_mm.push_back(base + u * at_u[n] + v * half[n]);
  for (std::size_t n = kHalf - 1; n > 0; --n) line.points_mm.push_back(base + u * at_u[n] - v * half[n]);
  return line;
}

}  // namespace osteo::inline display
