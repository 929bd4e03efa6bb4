#include "osteo/geometry/distance/compare.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <queue>
#include <utility>

#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"
#include "osteo/geometry/distance/triangle_tree.h"

namespace osteo::inline geometry {
namespace {

struct Piece {
  Vec3 a, b, c;
  double upper;         // no point of it is farther than this
  std::uint64_t order;  // ties
  friend bool operator<(const Piece& x, const Piece& y) {
    return x.upper != y.upper ? x.upper < y.upper : x.order > y.order;
  }
};

// No point of a piece is farther from the surface than this, where `near` is what is nearest to its middle: it is
// within reach of the middle; and the distance to one triangle is convex, so that it is largest at a corner.
double farthest(const TriangleSoup& surface, const ClosestPoint& near, Vec3 middle,
                const std::array<Vec3, 3>& corners) {
  const auto& t = surface.triangles[near.triangle];
  double reach = 0, convex = 0;
  for (const Vec3 p : corners) {
    reach = std::max(reach, length(p - middle));
    convex = std::max(
        convex,
        closest_on_triangle(p, surface.points_mm[t[0]], surface.points_mm[t[1]], surface.points_mm[t[2]]).distance_mm);
  }
  return std::min(near.distance_mm + reach, convex);
}

OneWayDistance one_way(const TriangleSoup& from, const TriangleSoup& surface, const TriangleTree& to, double extent,
                       const Context& context) {
  OneWayDistance result;
  const std::size_t n = from.triangles.size();
  std::vector<double> area(n);
  double total = 0;
  const auto corner = [&](std::size_t t, std::size_t i) { return from.points_mm[from.triangles[t][i]]; };
  for (std::size_t t = 0; t < n; ++t) {
    area[t] = length(cross(corner(t, 1) - corner(t, 0), corner(t, 2) - corner(t, 0))) / 2;
    total += area[t];
  }
  // About 200,000 samples, at least one a triangle, each standing for its share of the triangle's area.
  std::vector<std::uint32_t> count(n);
  std::vector<std::size_t> first(n + 1, 0);
  for (std::size_t t = 0; t < n; ++t) {
    count[t] = 1 + (total > 0 ? static_cast<std::uint32_t>(std::min(1e6, area[t] / total * 200000)) : 0);
    first[t + 1] = first[t] + count[t];
  }
  std::vector<std::pair<double, double>> samples(first[n]);  // distance, weight
  std::vector<Piece> pieces(n);
  std::vector<std::pair<double, Vec3>> worst(n);  // sample of each triangle
  parallel_for(n, 512, context.threads, [&](std::size_t begin, std::size_t end) {
    context.check_cancelled();
    std::uint32_t hint = ClosestPoint::kNone;
    for (std::size_t t = begin; t < end; ++t) {
      const Vec3 a = corner(t, 0), b = corner(t, 1), c = corner(t, 2);
      for (std::uint32_t s = 0; s < count[t]; ++s) {
        // A low-discrepancy sequence (R2: the plastic number), folded into the triangle.
        double u = std::fmod(0.5 + 0.7548776662466927 * s, 1.0), v = std::fmod(0.5 + 0.5698402909980532 * s, 1.0);
        if (count[t] == 1) u = v = 1.0 / 3;
        if (u + v > 1) u = 1 - u, v = 1 - v;
        const Vec3 x = a + (b - a) * u + (c - a) * v;
        const ClosestPoint p = to.closest(x, hint);
        hint = p.triangle;
        samples[first[t] + s] = {p.distance_mm, area[t] / count[t]};
        if (s == 0 || p.distance_mm > worst[t].first) worst[t] = {p.distance_mm, x};
      }
      const Vec3 m = (a + b + c) / 3;
      const ClosestPoint p = to.closest(m, hint);
      pieces[t] = {a, b, c, farthest(surface, p, m, {a, b, c}), t};
    }
  });
  double sum = 0, squares = 0, weight = 0;
  for (const auto& [d, w] : samples) {
    sum += d * w;
    squares += d * d * w;
    weight += w;
  }
  result.samples = samples.size();
  if (weight > 0) {
    result.mean_mm = sum / weight;
    result.rms_mm = std::sqrt(squares / weight);
  }
  std::sort(samples.begin(), samples.end());
  double passed = 0;
  for (const auto& [d, w] : samples) {
    passed += w;
    result.p95_mm = d;
    if (passed >= 0.95 * weight) break;
  }
  // Corners, where an extreme usually is, and samples: none of them may be farther than the maximum.
  std::vector<std::uint8_t> used(from.points_mm.size(), 0);
  for (const auto& t : from.triangles) {
    for (const auto v : t) used[v] = 1;
  }
  std::vector<double> at_point(used.size(), -1);
  parallel_for(used.size(), 1024, context.threads, [&](std::size_t begin, std::size_t end) {
    context.check_cancelled();
    std::uint32_t hint = ClosestPoint::kNone;
    for (std::size_t i = begin; i < end; ++i) {
      if (used[i] == 0) continue;
      const ClosestPoint p = to.closest(from.points_mm[i], hint);
      hint = p.triangle;
      at_point[i] = p.distance_mm;
    }
  });
  const auto corner_at = std::max_element(at_point.begin(), at_point.end());
  result.max_mm = *corner_at;
  result.worst_mm = from.points_mm[static_cast<std::size_t>(corner_at - at_point.begin())];
  for (const auto& [d, x] : worst) {
    if (d > result.max_mm) result.max_mm = d, result.worst_mm = x;
  }
  const auto offer = [&](Vec3 x) {
    const ClosestPoint p = to.closest(x);
    if (p.distance_mm > result.max_mm) {
      result.max_mm = p.distance_mm;
      result.worst_mm = x;
    }
    return p;
  };
  const double tolerance = 1e-4 * extent;
  std::priority_queue<Piece> queue(std::less<Piece>(), std::move(pieces));
  std::uint64_t questions = 0, order = n;
  while (!queue.empty() && queue.top().upper > result.max_mm + tolerance && questions < 200000) {
    if ((questions & 1023U) == 0) context.check_cancelled();
    const Piece q = queue.top();
    queue.pop();
    const Vec3 ab = (q.a + q.b) * 0.5, bc = (q.b + q.c) * 0.5, ca = (q.c + q.a) * 0.5;
    const std::array<std::array<Vec3, 3>, 4> parts{{{q.a, ab, ca}, {ab, q.b, bc}, {ca, bc, q.c}, {ab, bc, ca}}};
    for (const Vec3 x : {ab, bc, ca}) offer(x);  // the corners were asked when they were halves of edges
    for (const auto& part : parts) {
      const Vec3 m = (part[0] + part[1] + part[2]) / 3;
      const ClosestPoint p = offer(m);
      const double upper = std::min(q.upper, farthest(surface, p, m, part));
      if (upper > result.max_mm) queue.push({part[0], part[1], part[2], upper, order++});
    }
    questions += 7;
  }
  result.max_bound_mm = std::max(result.max_mm, queue.empty() ? 0.0 : queue.top().upper);
  return result;
}

}  // namespace

SurfaceComparison compare_surfaces(const TriangleSoup& a, const TriangleSoup& b, const Context& context) {
  const TriangleTree tree_a(a, context), tree_b(b, context);
  BoxMm both = bounds_of(a);
  const BoxMm other = bounds_of(b);
  both.include(other.lo);
  both.include(other.hi);
  const double extent = length(both.hi - both.lo);
  SurfaceComparison result;
  context.progress(0.1, "comparing");
  result.a_to_b = one_way(a, b, tree_b, extent, context);
  context.progress(0.55);
  result.b_to_a = one_way(b, a, tree_a, extent, context);
  context.progress(1.0);
  return result;
}

}  // namespace osteo::inline geometry
