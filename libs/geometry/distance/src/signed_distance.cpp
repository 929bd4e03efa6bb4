#include <algorithm>
#include <array>
#include <cmath>

#include "osteo/core/base/parallel.h"
#include "osteo/geometry/distance/distance_map.h"
#include "tree_data.h"
#include "turns_tree.h"
#include "winding.h"

namespace osteo::inline geometry {

namespace {

// The points asked last, and on which side of a closed surface they are. The ball around a point that reaches to the
// surface holds none of it, so that all of the ball is on one side. Less a billionth of the size of all, which is far
// more than rounding could move the surface or a point.
class Neighbours {
 public:
  Neighbours(Vec3 centre_mm, double unit_mm) : centre_mm_(centre_mm), margin_mm_(128 * unit_mm * 1e-9) {}

  [[nodiscard]] const bool* on_the_side_of(Vec3 p, double distance_mm) const {
    const double margin = margin_mm_ + 1e-9 * length(p - centre_mm_);
    for (std::size_t n = 1; n <= std::min(count_, kKept); ++n) {
      const Known& k = known_[(count_ - n) % kKept];
      if (length(p - k.at) + margin < std::max(k.distance_mm, distance_mm)) return &k.inside;
    }
    return nullptr;
  }
  void add(Vec3 p, double distance_mm, bool inside) { known_[count_++ % kKept] = {p, distance_mm, inside}; }

 private:
  static constexpr std::size_t kKept = 8;
  struct Known {
    Vec3 at;
    double distance_mm = 0;
    bool inside = false;
  };
  Vec3 centre_mm_;
  double margin_mm_;
  std::array<Known, kKept> known_{};
  std::size_t count_ = 0;
};

}  // namespace

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

std::vector<SignedDistance::Answer> SignedDistance::at(std::span<const Vec3> points, const Context& context) const {
  // In pieces, so that their numbers fit and cancelling is heeded.
  constexpr std::size_t kPiece = std::size_t{1} << 24, kGrain = 1024;
  std::vector<Answer> answers(points.size());
  const TriangleTree::Data& d = tree_.data();
  std::vector<distance::Keyed> order;
  for (std::size_t piece = 0; piece < points.size(); piece += kPiece) {
    order.resize(std::min(kPiece, points.size() - piece));
    for (std::size_t i = 0; i < order.size(); ++i) {
      const Vec3 p = d.to_tree(points[piece + i]);
      // Where there is no place, there is no order either.
      order[i] = {std::isfinite(dot(p, p)) ? distance::curve_key(p) : 0, static_cast<std::uint32_t>(i)};
    }
    distance::radix_sort(order);
    parallel_for(order.size(), kGrain, context.threads, [&](std::size_t begin, std::size_t end) {
      context.check_cancelled();
      Neighbours neighbours(d.centre_mm, d.unit_mm);
      std::uint32_t hint = ClosestPoint::kNone;
      for (std::size_t k = begin; k < end; ++k) {
        const std::size_t i = piece + order[k].index;
        const Vec3 p = points[i];
        Answer& a = answers[i];
        a.closest = tree_.closest(p, hint);
        hint = a.closest.triangle;
        // Openings end nowhere: beside them the number passes one half in the middle of nothing.
        const bool* const known = closed_ ? neighbours.on_the_side_of(p, a.closest.distance_mm) : nullptr;
        const bool in = known != nullptr ? *known : inside(p);
        neighbours.add(p, a.closest.distance_mm, in);
        a.signed_mm = in ? -a.closest.distance_mm : a.closest.distance_mm;
      }
    });
  }
  return answers;
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
