#include "ear_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <queue>

#include "osteo/core/base/parallel.h"
#include "osteo/geometry/distance/binary_distance.h"
#include "osteo/imaging/image/components.h"

namespace osteo::inline imaging::segment {

std::vector<float> distance_mm(const Field& f, const Mask& mask, const Context& context) {
  std::vector<float> d = squared_distance_mm2(mask, f.frame(), 1, context);
  parallel_for(d.size(), 1 << 16, context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) d[i] = std::sqrt(d[i]);
  });
  return d;
}

Pieces pieces_of(const Field& f, const Mask& mask, bool full) {
  const Components c = connected_components(mask, f.n, 1, full ? Connectivity::full : Connectivity::face);
  Pieces p;
  p.of.assign(f.size(), 0);
  p.size.assign(c.voxels.size() + 1, 0);
  for (std::size_t r = 0; r < c.runs.size(); ++r) {
    const std::uint32_t id = c.component[r] + 1;
    const std::size_t row = static_cast<std::size_t>(c.runs[r].row) * static_cast<std::size_t>(f.n[0]);
    for (std::size_t x = c.runs[r].begin; x < c.runs[r].end; ++x) p.of[row + x] = id;
    p.size[id] += c.runs[r].end - c.runs[r].begin;
  }
  return p;
}

double enclosure(const Field& f, Vec3 from, double reach_mm, const std::function<int(std::size_t)>& what) {
  static const std::vector<Vec3> directions = [] {
    std::vector<Vec3> d;
    constexpr int kCount = 96;
    for (int i = 0; i < kCount; ++i) {  // a spiral of equal areas
      const double z = 1 - 2 * (i + 0.5) / kCount, r = std::sqrt(1 - z * z), a = i * 2.399963229728653;
      d.push_back({r * std::cos(a), r * std::sin(a), z});
    }
    return d;
  }();
  int met = 0;
  for (const Vec3& d : directions) {
    for (double l = 1.5; l < reach_mm; l += 0.7) {
      const Vec3 x = (from + d * l - f.origin_mm) / f.h_mm;
      const int i = static_cast<int>(std::lround(x.x)), j = static_cast<int>(std::lround(x.y)),
                k = static_cast<int>(std::lround(x.z));
      if (!f.inside(i, j, k)) break;
      const int w = what(f.at(i, j, k));
      if (w == 0) continue;
      met += w > 0 ? 1 : 0;
      break;
    }
  }
  return static_cast<double>(met) / static_cast<double>(directions.size());
}

std::vector<float> climbed(const Field& f, const std::vector<float>& height, const std::vector<std::size_t>& seeds,
                           const std::function<bool(std::size_t)>& open) {
  constexpr float kNever = std::numeric_limits<float>::infinity();
  std::vector<float> best(f.size(), kNever);
  using Entry = std::pair<float, std::size_t>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  for (const std::size_t s : seeds) {
    best[s] = height[s];
    queue.emplace(best[s], s);
  }
  constexpr std::array<std::array<int, 3>, 6> kSides{
      {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}};
  while (!queue.empty()) {
    const auto [h, at] = queue.top();
    queue.pop();
    if (h > best[at]) continue;
    const auto p = f.place(at);
    for (const auto& d : kSides) {
      if (!f.inside(p[0] + d[0], p[1] + d[1], p[2] + d[2])) continue;
      const std::size_t to = f.at(p[0] + d[0], p[1] + d[1], p[2] + d[2]);
      const float c = std::max(h, height[to]);
      if (c < best[to] && open(to)) {
        best[to] = c;
        queue.emplace(c, to);
      }
    }
  }
  return best;
}

namespace {
std::map<float, double> volumes_behind(const Field& f, const std::vector<float>& height,
                                       const std::vector<float>& climbed, double least_drop) {
  std::map<float, double> behind;
  for (std::size_t i = 0; i < f.size(); ++i) {
    if (climbed[i] < std::numeric_limits<float>::infinity() && static_cast<double>(climbed[i] - height[i]) > least_drop)
      behind[climbed[i]] += f.h_mm * f.h_mm * f.h_mm;
  }
  return behind;
}
}  // namespace

Pass greatest_pass(const Field& f, const std::vector<float>& height, const std::vector<float>& climbed,
                   double least_drop) {
  Pass pass;
  for (const auto& [h, volume] : volumes_behind(f, height, climbed, least_drop))
    if (volume > pass.volume_mm3) pass = {static_cast<double>(h), volume};
  return pass;
}

Pass lowest_pass(const Field& f, const std::vector<float>& height, const std::vector<float>& climbed, double least_drop,
                 double least_mm3) {
  for (const auto& [h, volume] : volumes_behind(f, height, climbed, least_drop))
    if (volume >= least_mm3) return {static_cast<double>(h), volume};
  return {};
}

}  // namespace osteo::inline imaging::segment
