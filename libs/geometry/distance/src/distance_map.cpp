#include "osteo/geometry/distance/distance_map.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <memory>

#include "block_mapper.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"
#include "osteo/geometry/grid/brick_places.h"

namespace osteo::inline geometry {
namespace {

constexpr std::uint32_t kNone = ClosestPoint::kNone;

struct BlockResult {
  std::vector<Ijk> bricks;
  std::vector<std::uint64_t> stored;
  std::vector<double> distance_mm;
  std::vector<std::uint32_t> triangle;
};

void require_usable(const Frame& frame) {
  for (std::size_t a = 0; a < 3; ++a) {  // any scale will do here, other than in scans of patients
    if (frame.dims[a] < 1 || !(frame.spacing_mm[a] > 0) || !std::isfinite(frame.spacing_mm[a])) {
      throw Error(ExitCode::usage, "the grid needs at least one voxel and a positive spacing along each axis");
    }
  }
}

TriangleTree tree_along(const Frame& frame, const TriangleSoup& soup, const Context& context) {
  require_usable(frame);
  return {soup, frame.direction, context};
}

}  // namespace

std::uint64_t DistanceMap::count() const {
  std::uint64_t sum = 0;
  for (const auto w : stored) sum += static_cast<std::uint64_t>(std::popcount(w));
  return sum;
}

std::int64_t DistanceMap::find(int i, int j, int k) const {
  const Ijk b{i >> 3, j >> 3, k >> 3};
  const auto before = [](const Ijk& x, const Ijk& y) {
    return x.k != y.k ? x.k < y.k : x.j != y.j ? x.j < y.j : x.i < y.i;
  };
  const auto it = std::lower_bound(bricks.begin(), bricks.end(), b, before);
  if (it == bricks.end() || !(*it == b)) return -1;
  const auto brick = static_cast<std::size_t>(it - bricks.begin());
  if ((stored[brick * 8 + static_cast<std::size_t>(k & 7)] >> ((i & 7) + 8 * (j & 7)) & 1U) == 0) return -1;
  return static_cast<std::int64_t>(brick * 512) + (i & 7) + 8 * (j & 7) + 64 * (k & 7);
}

DistanceMapper::DistanceMapper(const TriangleSoup& soup, const Frame& frame, const Context& context)
    : DistanceMapper(soup, tree_along(frame, soup, context.sub(0, 0.5)), frame, context.sub(0.5, 1)) {}

DistanceMapper::DistanceMapper(const TriangleSoup& soup, TriangleTree tree, const Frame& frame, const Context& context)
    : frame_(frame), tree_(std::move(tree)) {
  require_usable(frame);
  if (!(tree_.data().axes == frame.direction)) throw Error(ExitCode::usage, "the tree has other axes than the frame");
  inside_ = voxels_inside(soup, frame, context, &report_);
}

DistanceMap DistanceMapper::map(const DistanceMapOptions& options, const Context& context) const {
  constexpr double kEverything = std::numeric_limits<double>::infinity();
  switch (options.region) {
    case DistanceRegion::box:
      return run(nullptr, kEverything, kEverything, context);
    case DistanceRegion::interior:
      return run(&inside_, kEverything, kEverything, context);
    case DistanceRegion::band:
      break;
  }
  return run(nullptr, options.band_inside_mm, options.band_outside_mm, context);
}

DistanceMap DistanceMapper::map_of(const VoxelBits& wanted, double reach_mm, const Context& context) const {
  return run(&wanted, reach_mm, reach_mm, context);
}

DistanceMap DistanceMapper::run(const VoxelBits* wanted, double inside_mm, double outside_mm,
                                const Context& context) const {
  const TriangleTree::Data& tree = tree_.data();
  const auto& dims = frame_.dims;
  const auto blocks = [&](std::size_t a) { return static_cast<std::size_t>((dims[a] + kBlock - 1) / kBlock); };
  const std::size_t rows = blocks(1) * blocks(2);
  const int edge = start_edge(tree, frame_);
  std::vector<BlockResult> results(rows);
  std::atomic<std::size_t> done{0};
  parallel_for(rows, 1, context.threads, [&](std::size_t begin, std::size_t end) {
    thread_local std::unique_ptr<BlockScratch> scratch;
    if (scratch == nullptr) scratch = std::make_unique<BlockScratch>();
    BlockMapper mapper(tree, frame_, *scratch);
    for (std::size_t r = begin; r < end; ++r) {
      context.check_cancelled();
      BlockResult& out = results[r];
      std::uint32_t hint = 0;  // each row for itself: the result must not depend on who did what before
      for (std::size_t bx = 0; bx < blocks(0); ++bx) {
        const std::array<int, 3> lo{static_cast<int>(bx) * kBlock, static_cast<int>(r % blocks(1)) * kBlock,
                                    static_cast<int>(r / blocks(1)) * kBlock};
        // 16 divides 64: a block's bits lie in one word of each row.
        const auto read = [&](const VoxelBits& bits, int j, int k) {
          return static_cast<std::uint16_t>(bits.words[bits.row(j, k) + static_cast<std::size_t>(lo[0]) / 64] >>
                                            (lo[0] % 64));
        };
        const auto in_box = static_cast<std::uint16_t>(dims[0] - lo[0] >= 16 ? 0xffff : (1 << (dims[0] - lo[0])) - 1);
        std::array<std::uint16_t, 256> want{}, in{};
        unsigned any = 0, any_in = 0, any_out = 0;
        for (int z = 0; z < std::min(kBlock, dims[2] - lo[2]); ++z) {
          for (int y = 0; y < std::min(kBlock, dims[1] - lo[1]); ++y) {
            const auto at = static_cast<std::size_t>(16 * z + y);
            in[at] = read(inside_, lo[1] + y, lo[2] + z);
            want[at] = wanted != nullptr ? read(*wanted, lo[1] + y, lo[2] + z) : in_box;
            any |= want[at];
            any_in |= static_cast<unsigned>(want[at] & in[at]);
            any_out |= static_cast<unsigned>(want[at] & ~in[at]);
          }
        }
        if (any == 0) continue;
        const double reach = std::max(any_in != 0 ? inside_mm : 0.0, any_out != 0 ? outside_mm : 0.0) / tree.unit_mm;
        mapper.run(lo, want, reach, edge, hint);
        for (int b = 0; b < 8; ++b) {
          const int ox = (b & 1) * 8, oy = (b >> 1 & 1) * 8, oz = (b >> 2) * 8;
          std::array<std::uint64_t, 8> stored{};
          std::uint64_t some = 0;
          for (int z = 0; z < 8; ++z) {
            for (int y = 0; y < 8; ++y) {
              const auto at = static_cast<std::size_t>(16 * (oz + z) + oy + y);
              const unsigned w = want[at] >> ox & 0xffU;
              if (w == 0) continue;
              for (unsigned rest = w; rest != 0; rest &= rest - 1) {
                const int x = std::countr_zero(rest);
                const std::size_t v = at * 16 + static_cast<std::size_t>(ox + x);
                if (scratch->best_id[v] == kNone) continue;
                const double d = std::sqrt(scratch->best_d2[v]) * tree.unit_mm;
                if (d <= ((in[at] >> (ox + x) & 1U) != 0 ? inside_mm : outside_mm))
                  stored[static_cast<std::size_t>(z)] |= 1ULL << (x + 8 * y);
              }
            }
            some |= stored[static_cast<std::size_t>(z)];
          }
          if (some == 0) continue;
          out.bricks.push_back({(lo[0] + ox) / 8, (lo[1] + oy) / 8, (lo[2] + oz) / 8});
          out.stored.insert(out.stored.end(), stored.begin(), stored.end());
          const std::size_t base = out.distance_mm.size();
          out.distance_mm.resize(base + 512, std::numeric_limits<double>::quiet_NaN());
          out.triangle.resize(base + 512, kNone);
          for (int z = 0; z < 8; ++z) {
            for (std::uint64_t rest = stored[static_cast<std::size_t>(z)]; rest != 0; rest &= rest - 1) {
              const int xy = std::countr_zero(rest), x = xy & 7, y = xy >> 3;
              const auto at = static_cast<std::size_t>(16 * (oz + z) + oy + y);
              const std::size_t v = at * 16 + static_cast<std::size_t>(ox + x);
              const double d = std::sqrt(scratch->best_d2[v]) * tree.unit_mm;
              out.distance_mm[base + static_cast<std::size_t>(64 * z + xy)] = (in[at] >> (ox + x) & 1U) != 0 ? -d : d;
              out.triangle[base + static_cast<std::size_t>(64 * z + xy)] = tree.original[scratch->best_id[v]];
            }
          }
        }
      }
      context.progress(static_cast<double>(++done) / static_cast<double>(rows), "measuring distances");
    }
  });
  // Bricks in z, y, x order.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> order;
  for (std::uint32_t r = 0; r < results.size(); ++r) {
    for (std::uint32_t b = 0; b < results[r].bricks.size(); ++b) order.push_back({r, b});
  }
  std::sort(order.begin(), order.end(), [&](const auto& x, const auto& y) {
    const Ijk a = results[x.first].bricks[x.second], b = results[y.first].bricks[y.second];
    return a.k != b.k ? a.k < b.k : a.j != b.j ? a.j < b.j : a.i < b.i;
  });
  DistanceMap map;
  map.frame = frame_;
  map.bricks.resize(order.size());
  map.stored.resize(order.size() * 8);
  map.distance_mm.resize(order.size() * 512);
  map.triangle.resize(order.size() * 512);
  parallel_for(order.size(), 64, context.threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t o = begin; o < end; ++o) {
      const BlockResult& from = results[order[o].first];
      const std::size_t b = order[o].second;
      map.bricks[o] = from.bricks[b];
      std::copy_n(from.stored.begin() + static_cast<std::ptrdiff_t>(b * 8), 8,
                  map.stored.begin() + static_cast<std::ptrdiff_t>(o * 8));
      std::copy_n(from.distance_mm.begin() + static_cast<std::ptrdiff_t>(b * 512), 512,
                  map.distance_mm.begin() + static_cast<std::ptrdiff_t>(o * 512));
      std::copy_n(from.triangle.begin() + static_cast<std::ptrdiff_t>(b * 512), 512,
                  map.triangle.begin() + static_cast<std::ptrdiff_t>(o * 512));
    }
  });
  return map;
}

SparseGrid to_sparse(const DistanceMap& map) {
  std::vector<float> values(map.distance_mm.size());
  float farthest = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = static_cast<float>(map.distance_mm[i]);
    if (std::isfinite(values[i])) farthest = std::max(farthest, values[i]);
  }
  return to_sparse(map.frame, "distance_mm", map.bricks, map.stored, values, farthest);
}

}  // namespace osteo::inline geometry
