#include "osteo/geometry/mesh/curve.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "curve_kernel.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/simd.h"

namespace osteo::inline geometry {

Curve::Curve(std::span<const Vec3> points) : points_(points.begin(), points.end()), loops_(&Loops::chosen()) {
  if (points_.size() < 2)
    throw Error(ExitCode::corrupt, "a curve needs at least two points; this has " + std::to_string(points_.size()));
  Vec3 lo = points_[0], hi = points_[0];
  arcs_.reserve(points_.size());
  double arc = 0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Vec3 p = points_[i];
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z)) {
      throw Error(ExitCode::corrupt,
                  "point " + std::to_string(i) + " of the curve has a coordinate that is no finite number");
    }
    if (i > 0) arc += length(p - points_[i - 1]);
    arcs_.push_back(arc);
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::min(lo[a], p[a]);
      hi[a] = std::max(hi[a], p[a]);
    }
  }
  centre_ = (lo + hi) * 0.5;
  rounding_ = length(hi - lo) * 4e-7;
  arc_rounding_ = arc * 2e-7;
  leaves_.resize((points_.size() - 1 + 15) / 16);
  for (std::size_t s = 0; s < leaves_.size() * 16; ++s) {
    Leaf& leaf = leaves_[s / 16];
    const std::size_t i = s % 16, from = std::min(s, points_.size() - 2);
    const double l = arcs_[from + 1] - arcs_[from];
    for (std::size_t a = 0; a < 3; ++a) {
      leaf.at[a][i] = s == from ? static_cast<float>(points_[from][a] - centre_[a]) : 1e15F;
      leaf.direction[a][i] = l > 0 ? static_cast<float>((points_[from + 1][a] - points_[from][a]) / l) : 0.0F;
    }
    leaf.length[i] = static_cast<float>(l);
    leaf.arc[i] = static_cast<float>(arcs_[from]);
  }
  const float below = -std::numeric_limits<float>::infinity(), above = std::numeric_limits<float>::infinity();
  std::size_t items = (points_.size() - 1 + 15) / 16;
  for (int level = 0;; ++level) {
    const std::size_t groups = (items + 15) / 16;
    std::vector<Group> boxes(groups);
    for (std::size_t g = 0; g < groups; ++g) {
      for (std::size_t s = 0; s < 16; ++s) {
        const std::size_t item = g * 16 + s;
        Group& group = boxes[g];
        for (std::size_t a = 0; a < 3; ++a) group.lo[a][s] = group.hi[a][s] = 1e30F;  // far away: never nearest
        group.arc_lo[s] = group.arc_hi[s] = 0;
        if (item >= items) continue;
        float low[3] = {above, above, above}, high[3] = {below, below, below};
        if (level == 0) {
          const std::size_t first = item * 16, last = std::min(points_.size() - 1, first + 16);
          for (std::size_t i = first; i <= last; ++i) {
            for (std::size_t a = 0; a < 3; ++a) {
              const auto v = static_cast<float>(points_[i][a] - centre_[a]);
              low[a] = std::min(low[a], std::nextafterf(v, below));
              high[a] = std::max(high[a], std::nextafterf(v, above));
            }
          }
          group.arc_lo[s] = std::nextafterf(static_cast<float>(arcs_[first]), below);
          group.arc_hi[s] = std::nextafterf(static_cast<float>(arcs_[last]), above);
        } else {
          const Group& from = levels_.back()[item];
          const std::size_t below_items =
              level == 1 ? (points_.size() - 1 + 15) / 16 : levels_[levels_.size() - 2].size();
          const std::size_t n = std::min<std::size_t>(16, below_items - item * 16);
          for (std::size_t i = 0; i < n; ++i) {
            for (std::size_t a = 0; a < 3; ++a) {
              low[a] = std::min(low[a], from.lo[a][i]);
              high[a] = std::max(high[a], from.hi[a][i]);
            }
          }
          group.arc_lo[s] = from.arc_lo[0];
          group.arc_hi[s] = from.arc_hi[n - 1];
        }
        for (std::size_t a = 0; a < 3; ++a) {
          group.lo[a][s] = low[a];
          group.hi[a][s] = high[a];
        }
      }
    }
    levels_.push_back(std::move(boxes));
    items = groups;
    if (groups == 1) break;
  }
}

const Curve::Loops& Curve::Loops::chosen() {
#if defined(__x86_64__)
  if (simd() == Simd::avx512) return avx512;
  if (simd() == Simd::avx2) return avx2;
#endif
  return scalar;
}

CurvePoint Curve::on_segment(std::uint32_t segment, Vec3 p, double arc, double penalty) const {
  const Vec3 a = points_[segment], b = points_[segment + 1];
  const double l = arcs_[segment + 1] - arcs_[segment];
  CurvePoint r;
  r.segment = segment;
  if (!(l > 0)) {
    r.point_mm = a;
    r.arc_mm = arcs_[segment];
    r.distance_mm = length(p - a);
    r.score_mm = r.distance_mm + penalty * std::abs(r.arc_mm - arc);
    return r;
  }
  const Vec3 direction = (b - a) / l;
  const double foot = dot(p - a, direction);
  const double height = length((p - a) - direction * foot);
  const auto score = [&](double s) {
    return std::sqrt(height * height + (s - foot) * (s - foot)) + penalty * std::abs(arcs_[segment] + s - arc);
  };
  // The score is convex along the segment: its minimum is where distance grows as fast as the penalty falls, on either
  // side of where the constraint was, or there itself.
  double best = std::clamp(foot, 0.0, l);
  if (penalty > 0) {
    const double here = std::clamp(arc - arcs_[segment], 0.0, l);
    best = here;
    double low = score(here);
    if (penalty < 1) {
      const double shift = penalty * height / std::sqrt(1 - penalty * penalty);
      const double ahead = std::clamp(foot - shift, here, l);  // the part beyond `here` pays for going on
      const double back = std::clamp(foot + shift, 0.0, here);
      if (score(ahead) < low) low = score(ahead), best = ahead;
      if (score(back) < low) best = back;
    }
  }
  r.t = best / l;
  r.point_mm = r.t >= 1 ? b : a + (b - a) * r.t;
  r.arc_mm = arcs_[segment] + best;
  r.distance_mm = length(p - r.point_mm);
  r.score_mm = r.distance_mm + penalty * std::abs(r.arc_mm - arc);
  return r;
}

CurvePoint Curve::minimum(Vec3 p, double arc, double penalty, std::uint32_t hint) const {
  struct Entry {
    float bound;
    std::uint32_t item;
    int level;
  };
  Entry stack[16 * 8];
  int top = 0;
  const auto last_segment = static_cast<std::uint32_t>(points_.size() - 2);
  CurvePoint best = on_segment(std::min(hint, last_segment), p, arc, penalty);
  const Vec3 q = p - centre_;
  const float pf[3] = {static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z)};
  const double rounding = rounding_ + (std::abs(q.x) + std::abs(q.y) + std::abs(q.z)) * 4e-7 +
                          penalty * (arc_rounding_ + std::abs(arc) * 2e-7);
  float reach = 0;
  const auto set_reach = [&] { reach = static_cast<float>(best.score_mm * (1 + 4e-7) + rounding); };
  set_reach();
  stack[top++] = {0, 0, static_cast<int>(levels_.size())};
  while (top > 0) {
    const Entry e = stack[--top];
    if (e.bound > reach) continue;
    if (e.level == 0) {
      float bound[16];
      loops_->leaf_bounds(leaves_[e.item], pf, static_cast<float>(arc), static_cast<float>(penalty), bound);
      // The nearest first: it brings the reach down for the others.
      int first = 0;
      for (int i = 1; i < 16; ++i) first = bound[i] < bound[first] ? i : first;
      for (int n = 0; n < 17; ++n) {
        const int i = n == 0 ? first : n - 1;
        if (!(bound[i] <= reach) || (n > 0 && i == first)) continue;
        const std::uint32_t s = e.item * 16 + static_cast<std::uint32_t>(i);
        if (s > last_segment) continue;
        const CurvePoint c = on_segment(s, p, arc, penalty);
        if (c.score_mm < best.score_mm || (c.score_mm == best.score_mm && c.segment < best.segment)) {
          best = c;
          set_reach();
        }
      }
      continue;
    }
    float bound[16];
    loops_->bounds(levels_[static_cast<std::size_t>(e.level - 1)][e.item], pf, static_cast<float>(arc),
                   static_cast<float>(penalty), bound);
    const int begin = top;
    for (std::uint32_t i = 0; i < 16; ++i) {
      if (!(bound[i] <= reach)) continue;
      int at = top++;
      while (at > begin && stack[at - 1].bound < bound[i]) {
        stack[at] = stack[at - 1];
        --at;
      }
      stack[at] = {bound[i], e.item * 16 + i, e.level - 1};
    }
  }
  return best;
}

CurvePoint Curve::at_arc(double arc) const {
  const double a = std::clamp(arc, 0.0, arcs_.back());
  auto it = std::upper_bound(arcs_.begin(), arcs_.end(), a);
  const auto segment = static_cast<std::uint32_t>(
      std::clamp<std::ptrdiff_t>(it - arcs_.begin() - 1, 0, static_cast<std::ptrdiff_t>(points_.size()) - 2));
  CurvePoint r;
  r.segment = segment;
  const double l = arcs_[segment + 1] - arcs_[segment];
  r.t = l > 0 ? (a - arcs_[segment]) / l : 0;
  r.arc_mm = a;
  r.point_mm = points_[segment] + (points_[segment + 1] - points_[segment]) * r.t;
  return r;
}

}  // namespace osteo::inline geometry
