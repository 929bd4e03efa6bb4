#include "osteo/simulation/nerve/detail/nerve_course.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <queue>

namespace osteo::inline simulation {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();

struct Edges {
  std::vector<std::vector<std::pair<std::uint32_t, double>>> of;
};

Vec3 point(const TriMesh& mesh, std::size_t n) {
  const auto& p = mesh.points_mm[n];
  return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
}

Edges edges_of(const TriMesh& mesh) {
  Edges e;
  e.of.resize(mesh.points_mm.size());
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      const double d = length(point(mesh, a) - point(mesh, b));
      e.of[a].emplace_back(b, d);
      e.of[b].emplace_back(a, d);
    }
  }
  return e;
}

// Distances over the surface from `start`, and the points that were reached, nearest first.
std::vector<std::uint32_t> spread(const Edges& edges, std::uint32_t start, std::vector<double>& distance) {
  using Item = std::pair<double, std::uint32_t>;
  std::priority_queue<Item, std::vector<Item>, std::greater<>> next;
  std::vector<std::uint32_t> reached;
  std::fill(distance.begin(), distance.end(), kFar);
  distance[start] = 0;
  next.emplace(0, start);
  while (!next.empty()) {
    const auto [d, at] = next.top();
    next.pop();
    if (d > distance[at]) continue;
    reached.push_back(at);
    for (const auto& [to, step] : edges.of[at]) {
      if (d + step >= distance[to]) continue;
      distance[to] = d + step;
      next.emplace(distance[to], to);
    }
  }
  return reached;
}

// Straight on behind the last point, as far as there is surface.
void extend(std::vector<NerveCourse::Point>& points, const std::vector<std::uint32_t>& reached, const TriMesh& face) {
  if (points.size() < 3) return;
  const NerveCourse::Point last = points.back();
  const Vec3 along = normalized(last.at_mm - points[points.size() - 3].at_mm);
  double most = 0;
  for (const std::uint32_t r : reached) {
    const Vec3 to = point(face, r) - last.at_mm;
    const double on = dot(to, along);
    if (length(to - along * on) < 2 * last.radius_mm + 0.25 * on) most = std::max(most, on);
  }
  for (double on = NerveCourse::kSpacingMm; on < std::min(most, 4 * last.radius_mm + 1); on += NerveCourse::kSpacingMm)
    points.push_back({last.at_mm + along * on, 0, last.radius_mm});
}

}  // namespace

NerveCourse course_of(const TriMesh& face, Vec3 distal, std::string name) {
  NerveCourse course;
  course.name = std::move(name);
  const Edges edges = edges_of(face);
  std::vector<double> distance(face.points_mm.size(), kFar);
  std::vector<bool> seen(face.points_mm.size(), false);
  struct Part {
    double along = 0;  // of its middle, by which parts are ordered
    std::vector<NerveCourse::Point> points;
  };
  std::vector<Part> parts;
  for (std::uint32_t n = 0; n < face.points_mm.size(); ++n) {
    if (seen[n]) continue;
    // From wherever one is the farthest is an end; what is farthest from that is the other.
    const std::uint32_t end = spread(edges, n, distance).back();
    const std::vector<std::uint32_t> reached = spread(edges, end, distance);
    for (const std::uint32_t r : reached) seen[r] = true;
    const double most = distance[reached.back()];
    if (most < 1) continue;
    const auto rings = static_cast<std::size_t>(std::max(1.0, std::round(most / NerveCourse::kSpacingMm)));
    std::vector<Vec3> middle(rings);
    std::vector<double> count(rings, 0), radius(rings, 0);
    const auto ring_of = [&](std::uint32_t r) {
      return std::min(rings - 1, static_cast<std::size_t>(distance[r] / most * static_cast<double>(rings)));
    };
    for (const std::uint32_t r : reached) {
      middle[ring_of(r)] += point(face, r);
      count[ring_of(r)] += 1;
    }
    for (std::size_t k = 0; k < rings; ++k) {
      if (count[k] > 0) middle[k] = middle[k] / count[k];
    }
    double mean_radius = 0, all = 0;
    for (const std::uint32_t r : reached) radius[ring_of(r)] += length(point(face, r) - middle[ring_of(r)]);
    for (std::size_t k = rings / 4; k < rings - rings / 4; ++k) {
      mean_radius += radius[k];
      all += count[k];
    }
    // Near the ends rings are not closed yet, only caps around a point.
    const auto caps = std::min(
        rings / 3, static_cast<std::size_t>(std::numbers::pi * mean_radius / all / NerveCourse::kSpacingMm) + 1);
    Part part;
    for (std::size_t k = caps; k + caps < rings; ++k) {
      if (count[k] >= 3) part.points.push_back({middle[k], 0, radius[k] / count[k]});
    }
    if (part.points.empty()) continue;
    for (int side = 0; side < 2; ++side) {
      extend(part.points, reached, face);
      std::reverse(part.points.begin(), part.points.end());
    }
    if (dot(part.points.front().at_mm - part.points.back().at_mm, distal) > 0)
      std::reverse(part.points.begin(), part.points.end());
    part.along = dot(part.points[part.points.size() / 2].at_mm, distal);
    parts.push_back(std::move(part));
  }
  std::stable_sort(parts.begin(), parts.end(), [](const Part& a, const Part& b) { return a.along < b.along; });
  for (const Part& p : parts) course.points.insert(course.points.end(), p.points.begin(), p.points.end());
  for (std::size_t k = course.points.size(); k-- > 1;)
    course.points[k - 1].to_distal_mm =
        course.points[k].to_distal_mm + length(course.points[k].at_mm - course.points[k - 1].at_mm);
  return course;
}

}  // namespace osteo::inline simulation
