#include "section.h"

#include <algorithm>
#include <cmath>
#include <string_view>
#include <unordered_map>

#include "osteo/core/base/error.h"
#include "osteo/session/planning/detail/plan.h"

namespace osteo::inline session::planning {
namespace {

constexpr double kRowMm = 0.1, kMinOutlineMm2 = 4;

// Where the row at height y crosses the outline, in order.
void crossings(const Loop& loop, double y, std::vector<double>& out) {
  out.clear();
  for (std::size_t n = 0; n < loop.size(); ++n) {
    const Point2 &a = loop[n], &b = loop[(n + 1) % loop.size()];
    if ((a[1] < y) == (b[1] < y)) continue;
    out.push_back(a[0] + (b[0] - a[0]) * ((y - a[1]) / (b[1] - a[1])));
  }
  std::sort(out.begin(), out.end());
}

}  // namespace

void require_size_mm(const BoxMm& box, const std::string& name, double shortest_mm) {
  constexpr double kLongestMm = 2500, kLongestInMetresMm = 2;
  const Vec3 size = box.hi - box.lo;
  const double longest = std::max({size.x, size.y, size.z});
  if (!(longest >= 0) || (longest >= shortest_mm && longest <= kLongestMm)) return;  // of nothing others say it
  struct Unit {
    std::string_view name, times;
  };
  const Unit unit = longest > kLongestMm           ? Unit{"micrometres", "0.001"}
                    : longest < kLongestInMetresMm ? Unit{"metres", "1000"}
                                                   : Unit{"centimetres or inches", "10 or 25.4"};
  const auto mm = [](double x) { return rounded(x, x < 1 ? 4 : 1); };
  throw Error(ExitCode::usage,
              "the " + name + " is " + mm(size.x) + " x " + mm(size.y) + " x " + mm(size.z) +
                  " mm large: its lengths look like " + std::string(unit.name),
              "lengths are taken as millimetres; save it with lengths times " + std::string(unit.times));
}

Sheet::Sheet(Vec3 at, Vec3 normal) : at_mm(at) {
  const Vec3 x = any_perpendicular(normal);
  axes = {{x, cross(normal, x), normal}};
}

std::vector<Loop> section(const TriangleSoup& bone, const Sheet& sheet) {
  std::vector<double> height(bone.points_mm.size());
  for (std::size_t n = 0; n < height.size(); ++n)
    height[n] = dot(bone.points_mm[n] - sheet.at_mm, sheet.axes.column[2]);
  // On an oriented surface each crossed edge is left once and entered once.
  const auto key = [](std::uint32_t a, std::uint32_t b) {
    return static_cast<std::uint64_t>(std::min(a, b)) << 32U | std::max(a, b);
  };
  std::unordered_map<std::uint64_t, std::uint64_t> next;
  std::vector<std::uint64_t> order;
  for (const auto& t : bone.triangles) {
    std::uint64_t from = 0, to = 0;
    int crossed = 0;
    for (std::size_t e = 0; e < 3; ++e) {
      const std::uint32_t a = t[e], b = t[(e + 1) % 3];
      const bool above_a = height[a] >= 0, above_b = height[b] >= 0;
      if (above_a == above_b) continue;
      (above_b ? from : to) = key(a, b);
      ++crossed;
    }
    if (crossed == 2 && next.emplace(from, to).second) order.push_back(from);
  }
  std::vector<Loop> loops;
  for (const std::uint64_t first : order) {
    Loop loop;
    std::uint64_t at = first;
    for (auto it = next.find(at); it != next.end(); it = next.find(at)) {
      const auto a = static_cast<std::uint32_t>(at >> 32U), b = static_cast<std::uint32_t>(at);
      const double s = height[a] / (height[a] - height[b]);
      loop.push_back(sheet.local(bone.points_mm[a] * (1 - s) + bone.points_mm[b] * s));
      at = it->second;
      next.erase(it);
    }
    if (at == first && loop.size() >= 3) loops.push_back(std::move(loop));
  }
  return loops;
}

std::optional<Loop> outline_near(const TriangleSoup& bone, const Sheet& sheet, Vec3 place, double within_mm) {
  std::optional<Loop> best;
  double best_mm = within_mm;
  for (Loop& loop : section(bone, sheet)) {
    const Moments m = moments(loop);
    const double mm = length(sheet.world(m.centroid) - place);
    if (m.area < kMinOutlineMm2 || mm > best_mm) continue;
    best_mm = mm;
    best = std::move(loop);
  }
  return best;
}

Moments moments(const Loop& loop) {
  Moments m;
  double xx = 0, xy = 0, yy = 0, cx = 0, cy = 0, area = 0;
  for (std::size_t n = 0; n < loop.size(); ++n) {
    const Point2 &a = loop[n], &b = loop[(n + 1) % loop.size()];
    const double w = a[0] * b[1] - b[0] * a[1];
    area += w / 2;
    cx += w * (a[0] + b[0]) / 6;
    cy += w * (a[1] + b[1]) / 6;
    xx += w * (a[0] * a[0] + a[0] * b[0] + b[0] * b[0]) / 12;
    yy += w * (a[1] * a[1] + a[1] * b[1] + b[1] * b[1]) / 12;
    xy += w * (a[0] * b[1] + 2 * a[0] * a[1] + 2 * b[0] * b[1] + b[0] * a[1]) / 24;
  }
  if (area == 0) return m;
  m.area = std::abs(area);
  m.centroid = {cx / area, cy / area};
  m.xx = xx / area - m.centroid[0] * m.centroid[0];
  m.yy = yy / area - m.centroid[1] * m.centroid[1];
  m.xy = xy / area - m.centroid[0] * m.centroid[1];
  return m;
}

Loop clipped(const Loop& loop, Point2 direction, double offset) {
  Loop out;
  const auto above = [&](const Point2& p) { return direction[0] * p[0] + direction[1] * p[1] - offset; };
  for (std::size_t n = 0; n < loop.size(); ++n) {
    const Point2 &a = loop[n], &b = loop[(n + 1) % loop.size()];
    const double ha = above(a), hb = above(b);
    if (ha >= 0) out.push_back(a);
    if ((ha >= 0) != (hb >= 0)) {
      const double s = ha / (ha - hb);
      out.push_back({a[0] + (b[0] - a[0]) * s, a[1] + (b[1] - a[1]) * s});
    }
  }
  return out;
}

double common_area(const Loop& a, const Loop& b) {
  const auto ends = [](const Loop& l) {
    double lo = l[0][1], hi = lo;
    for (const Point2& p : l) {
      lo = std::min(lo, p[1]);
      hi = std::max(hi, p[1]);
    }
    return std::pair{lo, hi};
  };
  if (a.empty() || b.empty()) return 0;
  const auto [alo, ahi] = ends(a);
  const auto [blo, bhi] = ends(b);
  const double lo = std::max(alo, blo), hi = std::min(ahi, bhi);
  if (hi <= lo) return 0;
  const int rows = static_cast<int>(std::ceil((hi - lo) / kRowMm));
  const double row = (hi - lo) / rows;
  double sum = 0;
  std::vector<double> xa, xb;
  for (int r = 0; r < rows; ++r) {
    const double y = lo + (r + 0.5) * row;
    crossings(a, y, xa);
    crossings(b, y, xb);
    for (std::size_t i = 0; i + 1 < xa.size(); i += 2) {
      for (std::size_t k = 0; k + 1 < xb.size(); k += 2)
        sum += std::max(0.0, std::min(xa[i + 1], xb[k + 1]) - std::max(xa[i], xb[k])) * row;
    }
  }
  return sum;
}

}  // namespace osteo::inline session::planning
