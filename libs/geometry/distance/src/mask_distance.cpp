#include "osteo/geometry/distance/distance_methods.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"
#include "osteo/geometry/distance/binary_distance.h"
#include "osteo/geometry/grid/brick_places.h"

namespace osteo::inline geometry {

MaskDistance mask_distance(const Labels& labels, std::span<const std::uint8_t> wanted,
                           const DistanceMapOptions& options, bool name_nearest, const Context& context) {
  const Frame& f = labels.frame;
  std::array<std::uint8_t, 256> is{};
  for (const std::uint8_t v : wanted) is[v] = 1;
  std::vector<std::uint8_t> mask(f.voxel_count());
  bool any = false;
  for (std::size_t i = 0; i < mask.size(); ++i) {
    mask[i] = is[labels.voxels[i]];
    any |= mask[i] != 0;
  }
  if (!any) throw Error(ExitCode::failed, "no voxel of the labels belongs to the structure");
  const bool band = options.region == DistanceRegion::band;
  const auto bricks_along = [&](std::size_t a) { return static_cast<std::size_t>((f.dims[a] + 7) / 8); };
  const std::size_t count = bricks_along(0) * bricks_along(1) * bricks_along(2);
  std::vector<std::uint64_t> stored(count * 8, 0);
  std::vector<std::vector<float>> values(count);
  // One side after the other, so that only one dense volume is there at a time.
  const auto take = [&](std::uint8_t to, float sign, double reach, const Context& part) {
    const std::vector<float> d2 = squared_distance_mm2(mask, f, to, part);
    const auto most = band ? static_cast<float>(reach * reach * (1 + 1e-6)) : std::numeric_limits<float>::infinity();
    parallel_for(count, 16, context.threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t b = begin; b < end; ++b) {
        const auto bi = static_cast<int>(b % bricks_along(0)) * 8,
                   bj = static_cast<int>(b / bricks_along(0) % bricks_along(1)) * 8,
                   bk = static_cast<int>(b / bricks_along(0) / bricks_along(1)) * 8;
        for (int z = 0; z < std::min(8, f.dims[2] - bk); ++z) {
          for (int y = 0; y < std::min(8, f.dims[1] - bj); ++y) {
            const std::size_t row = labels.offset(bi, bj + y, bk + z);
            for (int x = 0; x < std::min(8, f.dims[0] - bi); ++x) {
              const std::size_t at = row + static_cast<std::size_t>(x);
              if (mask[at] == to || !(d2[at] <= most) || d2[at] == std::numeric_limits<float>::infinity()) continue;
              if (values[b].empty()) values[b].assign(512, 0.0F);
              values[b][static_cast<std::size_t>(x + 8 * y + 64 * z)] = sign * std::sqrt(d2[at]);
              stored[b * 8 + static_cast<std::size_t>(z)] |= 1ULL << (x + 8 * y);
            }
          }
        }
      }
    });
  };
  if (options.region != DistanceRegion::interior) take(1, 1.0F, options.band_outside_mm, context.sub(0, 0.5));
  take(0, -1.0F, options.band_inside_mm, context.sub(0.5, 0.9));
  std::vector<std::vector<float>> names(name_nearest ? count : 0), best(names.size());
  if (name_nearest) {
    std::array<std::uint8_t, 256> present{};
    for (const std::uint8_t v : labels.span()) present[v] = is[v];
    for (int value = 1; value < 256; ++value) {
      if (present[static_cast<std::size_t>(value)] == 0) continue;
      const std::vector<float> d2 =
          squared_distance_mm2(labels.span(), f, static_cast<std::uint8_t>(value), context.sub(0.9, 0.9));
      parallel_for(count, 16, context.threads, [&](std::size_t begin, std::size_t end) {
        for (std::size_t b = begin; b < end; ++b) {
          if (values[b].empty()) continue;
          if (names[b].empty()) {
            names[b].assign(512, 0.0F);
            best[b].assign(512, std::numeric_limits<float>::infinity());
          }
          const auto bi = static_cast<int>(b % bricks_along(0)) * 8,
                     bj = static_cast<int>(b / bricks_along(0) % bricks_along(1)) * 8,
                     bk = static_cast<int>(b / bricks_along(0) / bricks_along(1)) * 8;
          for (std::size_t v = 0; v < 512; ++v) {
            if ((stored[b * 8 + (v >> 6)] >> (v & 63) & 1U) == 0) continue;
            const float d = d2[labels.offset(bi + static_cast<int>(v & 7), bj + static_cast<int>(v >> 3 & 7),
                                             bk + static_cast<int>(v >> 6))];
            if (d >= best[b][v]) continue;
            best[b][v] = d;
            names[b][v] = static_cast<float>(value);
          }
        }
      });
    }
  }
  std::vector<float> packed_names;
  std::vector<Ijk> bricks;
  std::vector<std::uint64_t> packed_bits;
  std::vector<float> packed;
  float farthest = 0;
  for (std::size_t b = 0; b < count; ++b) {
    if (values[b].empty()) continue;
    bricks.push_back({static_cast<int>(b % bricks_along(0)), static_cast<int>(b / bricks_along(0) % bricks_along(1)),
                      static_cast<int>(b / bricks_along(0) / bricks_along(1))});
    packed_bits.insert(packed_bits.end(), stored.begin() + static_cast<std::ptrdiff_t>(b * 8),
                       stored.begin() + static_cast<std::ptrdiff_t>(b * 8 + 8));
    packed.insert(packed.end(), values[b].begin(), values[b].end());
    farthest = std::max(farthest, *std::max_element(values[b].begin(), values[b].end()));
    if (name_nearest) packed_names.insert(packed_names.end(), names[b].begin(), names[b].end());
    values[b] = {};
  }
  context.progress(1.0);
  MaskDistance result{to_sparse(f, "distance_mm", bricks, packed_bits, packed, farthest), {}};
  if (name_nearest) result.nearest = to_sparse(f, "nearest_structure", bricks, packed_bits, packed_names, 0);
  return result;
}

}  // namespace osteo::inline geometry
