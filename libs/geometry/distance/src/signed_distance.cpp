#include <algorithm>
#include <cmath>

#include "osteo/geometry/distance/distance_map.h"
#include "tree_data.h"
#include "turns_tree.h"
#include "winding.h"

namespace osteo::inline geometry {

SignedDistance::SignedDistance(const TriangleSoup& soup, const Context& context) : tree_(soup, context) {
  Ordered mended;
  // Welding leaves the triangles where they are: rays and distances share one tree.
  ray_tree_ = tree_;
  surface_ = soup;
  if (!is_closed(surface_)) surface_ = welded(soup);
  if (!is_closed(surface_)) {
    mended = ordered(soup, context);
    surface_ = mended.soup;
    ray_tree_ = surface_.triangles.empty() ? TriangleTree() : TriangleTree(surface_, context);
  }
  fans_ = std::make_shared<const TurnsTree>(closing_fans(mended, surface_.points_mm));
  closed_ = fans_->empty();
}

SignedDistance::Answer SignedDistance::at(Vec3 p, std::uint32_t hint) const {
  Answer answer;
  answer.closest = tree_.closest(p, hint);
  answer.signed_mm = inside(p) ? -answer.closest.distance_mm : answer.closest.distance_mm;
  return answer;
}

bool SignedDistance::inside(Vec3 p) const {
  if (surface_.triangles.empty()) return false;
  const TriangleTree::Data& d = ray_tree_.data();
  const Vec3 q = d.to_tree(p);
  int winding = 0;
  struct Entry {
    std::uint32_t group;
    int level;
  };
  std::array<Entry, 16 * 9> stack;
  std::size_t top = 0;
  stack[top++] = {0, d.view.levels - 1};
  const float margin = d.view.margin;
  while (top > 0) {
    const Entry e = stack[--top];
    const distance::BoxGroup& g = d.view.boxes[e.level][e.group];
    for (std::uint32_t i = 0; i < 16; ++i) {
      if (g.lo[0][i] - margin > q.x || g.lo[1][i] - margin > q.y || g.hi[1][i] + margin < q.y ||
          g.lo[2][i] - margin > q.z || g.hi[2][i] + margin < q.z)
        continue;
      const std::uint32_t item = e.group * 16 + i;
      if (e.level > 0) {
        stack[top++] = {item, e.level - 1};
        continue;
      }
      for (std::uint32_t t = item * 16; t < std::min(item * 16 + 16, d.view.triangles); ++t) {
        const auto& v = surface_.triangles[d.original[t]];
        winding += crossing_before(surface_.points_mm[v[0]], surface_.points_mm[v[1]], surface_.points_mm[v[2]], p);
      }
    }
  }
  if (closed_) return winding != 0;
  return fans_->beyond_half(winding + fans_->crossings_before(p), p);
}

}  // namespace osteo::inline geometry
