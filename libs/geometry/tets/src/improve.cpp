#include "improve.h"

#include <algorithm>
#include <cmath>

#include "osteo/geometry/distance/triangle_tree.h"
#include "osteo/geometry/tets/quality.h"
#include "point_tets.h"

namespace osteo::inline geometry {

double improve_tets(TetMesh& mesh, const TriangleSoup& surface, double target_deg, double spacing_mm,
                    const Context& context) {
  const auto p = [&](std::uint32_t i) {
    return Vec3{mesh.points_mm[i][0], mesh.points_mm[i][1], mesh.points_mm[i][2]};
  };
  // The worse of the smallest angle and 180 less the largest.
  const auto quality = [&](const std::array<std::uint32_t, 4>& t) {
    const Vec3 a = p(t[0]), b = p(t[1]), c = p(t[2]), d = p(t[3]);
    if (dot(cross(b - a, c - a), d - a) <= 0) return -1.0;
    const Dihedrals q = dihedral_angles(a, b, c, d);
    return std::min(q.min_deg, 180 - q.max_deg);
  };
  std::vector<float> now(mesh.tets.size());
  std::vector<std::uint32_t> bad;
  for (std::uint32_t t = 0; t < mesh.tets.size(); ++t) {
    now[t] = static_cast<float>(quality(mesh.tets[t]));
    if (now[t] < target_deg) bad.push_back(t);
  }
  double worst = 180;
  for (const float q : now) worst = std::min(worst, static_cast<double>(q));
  if (bad.empty()) return worst;
  const PointTets of_points(mesh);
  const auto &first = of_points.first, &around = of_points.tets;
  std::vector<std::uint32_t> on_boundary;
  (void)boundary_of(mesh, &on_boundary);
  std::vector<std::uint8_t> boundary(mesh.points_mm.size(), 0);
  for (const auto v : on_boundary) boundary[v] = 1;
  const TriangleTree tree(surface, context);
  std::vector<std::uint32_t> hint(mesh.points_mm.size(), 0);
  std::vector<float> allowed(mesh.points_mm.size(), -1);

  for (int pass = 0; pass < 24 && !bad.empty(); ++pass) {
    context.check_cancelled();
    std::vector<std::uint32_t> points;
    for (const std::uint32_t t : bad) points.insert(points.end(), mesh.tets[t].begin(), mesh.tets[t].end());
    std::sort(points.begin(), points.end());
    points.erase(std::unique(points.begin(), points.end()), points.end());
    for (const std::uint32_t v : points) {
      const std::uint32_t begin = first[v], end = first[v + 1];
      double before = 1e9, size = 0;
      Vec3 middle;
      int count = 0;
      for (std::uint32_t k = begin; k < end; ++k) {
        const auto& t = mesh.tets[around[k]];
        before = std::min(before, static_cast<double>(now[around[k]]));
        for (const auto w : t) {
          if (w == v || (boundary[v] != 0 && boundary[w] == 0)) continue;
          middle += p(w);
          ++count;
        }
      }
      if (before >= target_deg || count == 0) continue;
      middle = middle / count;
      const Vec3 start = p(v);
      size = length(middle - start);
      const std::array<float, 3> kept = mesh.points_mm[v];
      if (boundary[v] != 0 && allowed[v] < 0) {
        const ClosestPoint c = tree.closest(start);
        hint[v] = c.triangle;
        allowed[v] = static_cast<float>(c.distance_mm + 0.02 * spacing_mm);
      }
      double best = before;
      std::array<float, 3> best_at = kept;
      const auto try_at = [&](Vec3 x) {
        if (boundary[v] != 0) {
          const ClosestPoint c = tree.closest(x, hint[v]);
          if (c.distance_mm > allowed[v]) x = c.point_mm;
        }
        mesh.points_mm[v] = {static_cast<float>(x.x), static_cast<float>(x.y), static_cast<float>(x.z)};
        double q = 1e9;
        for (std::uint32_t k = begin; k < end && q > best; ++k) q = std::min(q, quality(mesh.tets[around[k]]));
        if (q > best) {
          best = q;
          best_at = mesh.points_mm[v];
        }
      };
      for (const double s : {0.1, 0.25, 0.5, 0.9}) try_at(start + (middle - start) * s);
      const double step = std::max(0.02 * spacing_mm, 0.3 * size) / (1 + pass % 4);
      // Directions of a cube's corners and faces, and along the edges.
      for (int d = 0; d < 26; ++d) {
        const int e = d < 13 ? d : d + 1;
        try_at(start + normalized(Vec3{double(e % 3 - 1), double(e / 3 % 3 - 1), double(e / 9 - 1)}) * step);
      }
      mesh.points_mm[v] = best_at;
      if (best > before) {
        for (std::uint32_t k = begin; k < end; ++k) now[around[k]] = static_cast<float>(quality(mesh.tets[around[k]]));
      }
    }
    bad.clear();
    worst = 180;
    for (std::uint32_t t = 0; t < mesh.tets.size(); ++t) {
      worst = std::min(worst, static_cast<double>(now[t]));
      if (now[t] < target_deg) bad.push_back(t);
    }
  }
  return worst;
}

}  // namespace osteo::inline geometry
