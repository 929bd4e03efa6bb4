#include "label_line.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <utility>

#include "line.h"
#include "osteo/geometry/distance/binary_distance.h"
#include "osteo/imaging/image/components.h"

namespace osteo::inline imaging::segment {
namespace {

constexpr double kGapCost = 24;  // a way through the structure is taken where there is one
constexpr double kGapMm = 3;     // from either side of a gap

/// Cheapest ways from a voxel to all others.
struct Routes {
  std::vector<float> cost;
  std::vector<std::uint32_t> from;
};
Routes routes_from(const MaskBox& box, const std::vector<float>& price, std::size_t start) {
  Routes ways{std::vector<float>(price.size(), std::numeric_limits<float>::infinity()),
              std::vector<std::uint32_t>(price.size(), 0)};
  using Open = std::pair<float, std::uint32_t>;
  std::priority_queue<Open, std::vector<Open>, std::greater<>> open;
  ways.cost[start] = 0;
  ways.from[start] = static_cast<std::uint32_t>(start);
  open.push({0, static_cast<std::uint32_t>(start)});
  while (!open.empty()) {
    const auto [cost, v] = open.top();
    open.pop();
    if (cost > ways.cost[v]) continue;
    const Vec3 here = box.world(v);
    box.around(v, 1, [&](std::size_t n) {
      const float to = cost + static_cast<float>(length(box.world(n) - here)) * (price[n] + price[v]) / 2;
      if (n == v || to >= ways.cost[n]) return;
      ways.cost[n] = to;
      ways.from[n] = v;
      open.push({to, static_cast<std::uint32_t>(n)});
    });
  }
  return ways;
}

}  // namespace

std::vector<Vec3> middle_line(const MaskBox& given, const Context& context) {
  MaskBox mask = given;
  const Components pieces = connected_components(mask.in, mask.frame.dims, 1, Connectivity::full);
  if (pieces.voxels.empty()) return {};
  const std::uint64_t largest = *std::max_element(pieces.voxels.begin(), pieces.voxels.end());
  for (std::size_t r = 0; r < pieces.runs.size(); ++r) {
    if (10 * pieces.voxels[pieces.component[r]] >= largest) continue;
    const std::size_t row = static_cast<std::size_t>(pieces.runs[r].row) * static_cast<std::size_t>(mask.frame.dims[0]);
    std::fill(mask.in.begin() + static_cast<std::ptrdiff_t>(row + pieces.runs[r].begin),
              mask.in.begin() + static_cast<std::ptrdiff_t>(row + pieces.runs[r].end), std::uint8_t{0});
  }
  // Cheap in the middle, so that the way does not cut bends along the wall.
  const std::vector<float> away = squared_distance_within_mm2(mask.in, mask.frame, 1, kGapMm, context);
  std::vector<float> price = squared_distance_mm2(mask.in, mask.frame, 0, context);
  for (std::size_t v = 0; v < price.size(); ++v)
    price[v] = mask.in[v] != 0          ? 1 + 1 / (0.1F + price[v])
               : std::isfinite(away[v]) ? static_cast<float>(kGapCost)
                                        : std::numeric_limits<float>::infinity();
  const auto farthest = [&](const Routes& ways) {
    std::size_t best = 0;
    float most = -1;
    for (std::size_t v = 0; v < mask.in.size(); ++v) {
      if (mask.in[v] != 0 && std::isfinite(ways.cost[v]) && ways.cost[v] > most) {
        most = ways.cost[v];
        best = v;
      }
    }
    return best;
  };
  const auto of_largest =
      static_cast<std::uint32_t>(std::max_element(pieces.voxels.begin(), pieces.voxels.end()) - pieces.voxels.begin());
  const auto run = static_cast<std::size_t>(std::find(pieces.component.begin(), pieces.component.end(), of_largest) -
                                            pieces.component.begin());
  const std::size_t first =
      static_cast<std::size_t>(pieces.runs[run].row) * static_cast<std::size_t>(mask.frame.dims[0]) +
      pieces.runs[run].begin;
  const std::size_t a = farthest(routes_from(mask, price, first));
  const Routes ways = routes_from(mask, price, a);
  std::vector<Vec3> line;
  for (std::size_t v = farthest(ways);; v = ways.from[v]) {
    line.push_back(mask.world(v));
    if (v == a) break;
  }
  if (line.size() < 3) return line;
  constexpr double kStepMm = 0.25;
  line = evenly(line, kStepMm);
  line = smoothed_line(line, std::vector<double>(line.size(), 1), kStepMm, 1.5);
  return evenly(line, 1);
}

}  // namespace osteo::inline imaging::segment
