#include "osteo/imaging/image/components.h"

#include <algorithm>
#include <numeric>

#include "osteo/core/base/union_find.h"

namespace osteo::inline imaging {

Components connected_components(std::span<const std::uint8_t> mask, std::array<int, 3> dims, std::uint8_t value,
                                Connectivity connectivity) {
  const auto nx = static_cast<std::uint32_t>(dims[0]);
  const auto rows = static_cast<std::uint32_t>(dims[1]) * static_cast<std::uint32_t>(dims[2]);
  std::vector<Run> runs;
  for (std::uint32_t row = 0; row < rows; ++row) {
    const std::uint8_t* const p = mask.data() + static_cast<std::size_t>(row) * nx;
    for (std::uint32_t x = 0; x < nx;) {
      while (x < nx && p[x] != value) ++x;
      if (x == nx) break;
      const std::uint32_t begin = x;
      while (x < nx && p[x] == value) ++x;
      runs.push_back({begin, x, row});
    }
  }
  return connected_components(std::move(runs), dims, connectivity);
}

Components connected_components(std::vector<Run> runs, std::array<int, 3> dims, Connectivity connectivity) {
  const auto ny = static_cast<std::uint32_t>(dims[1]);
  const auto rows = ny * static_cast<std::uint32_t>(dims[2]);
  Components result;
  result.runs = std::move(runs);
  std::vector<std::uint32_t> first(rows + 1);
  std::uint32_t at = 0;
  for (std::uint32_t row = 0; row <= rows; ++row) {
    while (at < result.runs.size() && result.runs[at].row < row) ++at;
    first[row] = at;
  }

  std::vector<std::uint32_t> parent(result.runs.size());
  std::iota(parent.begin(), parent.end(), 0U);
  // Runs of two rows touch when they overlap; with 26 neighbours also when they meet corner to corner.
  const std::uint32_t reach = connectivity == Connectivity::full ? 1 : 0;
  const auto join_rows = [&](std::uint32_t a, std::uint32_t b) {
    std::uint32_t i = first[a], j = first[b];
    while (i < first[a + 1] && j < first[b + 1]) {
      const Run &r = result.runs[i], &s = result.runs[j];
      if (r.begin < s.end + reach && s.begin < r.end + reach) join_sets(parent, i, j);
      if (r.end < s.end) {
        ++i;
      } else {
        ++j;
      }
    }
  };
  for (std::uint32_t row = 0; row < rows; ++row) {
    const std::uint32_t y = row % ny, z = row / ny;
    if (y > 0) join_rows(row, row - 1);
    if (z == 0) continue;
    join_rows(row, row - ny);
    if (reach == 0) continue;
    if (y > 0) join_rows(row, row - ny - 1);
    if (y + 1 < ny) join_rows(row, row - ny + 1);
  }

  result.component.resize(result.runs.size());
  for (std::uint32_t i = 0; i < result.runs.size(); ++i) {
    const std::uint32_t r = root_of(parent, i);
    if (r == i) {
      result.component[i] = static_cast<std::uint32_t>(result.voxels.size());
      result.voxels.push_back(0);
    } else {
      result.component[i] = result.component[r];  // r < i: a root is the smallest index of its set
    }
    result.voxels[result.component[i]] += result.runs[i].end - result.runs[i].begin;
  }
  return result;
}

std::vector<bool> components_to_drop(const Components& components, double min_voxels, int keep_largest) {
  std::vector<std::uint32_t> order(components.voxels.size());
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(),
                   [&](auto a, auto b) { return components.voxels[a] > components.voxels[b]; });
  std::vector<bool> drop(order.size(), true);
  for (std::size_t rank = 0; rank < order.size(); ++rank) {
    const bool counted = keep_largest == 0 || rank < static_cast<std::size_t>(keep_largest);
    drop[order[rank]] = !counted || static_cast<double>(components.voxels[order[rank]]) < min_voxels;
  }
  return drop;
}

}  // namespace osteo::inline imaging
