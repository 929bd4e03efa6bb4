#include "osteo/geometry/distance/detail/live_distance.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "block_mapper.h"
#include "osteo/core/base/error.h"

namespace osteo::inline geometry {

LiveDistance::LiveDistance(const TriangleSoup& surface, const Frame& frame, double reach_mm, const InsideAt& inside,
                           const Context& context)
    : frame_(frame), reach_mm_(reach_mm) {
  require_sound(surface);
  std::size_t count = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    cells_[a] = (frame.dims[a] + 7) / 8;
    count *= static_cast<std::size_t>(cells_[a]);
  }
  in_cell_.resize(count);
  table_.assign(count, -1);
  std::vector<std::array<Vec3, 3>> added;
  added.reserve(surface.triangles.size());
  for (const auto& t : surface.triangles)
    added.push_back({surface.points_mm[t[0]], surface.points_mm[t[1]], surface.points_mm[t[2]]});
  context.check_cancelled();
  update({}, added, inside);
}

std::array<int, 3> LiveDistance::cell_of(const std::array<Vec3, 3>& t) const {
  const Vec3 index = frame_.index_from_world((t[0] + t[1] + t[2]) / 3);
  std::array<int, 3> c{};
  // What lies outside the grid belongs to its border cells.
  for (std::size_t a = 0; a < 3; ++a) c[a] = static_cast<int>(std::clamp(index[a] / 8, 0.0, cells_[a] - 1.0));
  return c;
}

LiveDistance::Brick& LiveDistance::brick_for(int bi, int bj, int bk) {
  std::int32_t& place = table_[cell(bi, bj, bk)];
  if (place < 0) {
    place = static_cast<std::int32_t>(bricks_.size());
    bricks_.emplace_back();
    bricks_.back().distance_mm.fill(0);
    bricks_.back().triangle.fill(ClosestPoint::kNone);
  }
  return bricks_[static_cast<std::size_t>(place)];
}

LiveDistance::Sample LiveDistance::at(int i, int j, int k) const {
  if (i < 0 || j < 0 || k < 0 || i >= frame_.dims[0] || j >= frame_.dims[1] || k >= frame_.dims[2]) return {};
  const std::int32_t place = table_[cell(i / 8, j / 8, k / 8)];
  if (place < 0) return {};
  const Brick& b = bricks_[static_cast<std::size_t>(place)];
  const auto v = static_cast<std::size_t>((i & 7) + 8 * (j & 7) + 64 * (k & 7));
  return {b.distance_mm[v], b.triangle[v]};
}

std::uint32_t LiveDistance::update(std::span<const std::uint32_t> removed, std::span<const std::array<Vec3, 3>> added,
                                   const InsideAt& inside) {
  touched_ = 0;
  const auto first_added = static_cast<std::uint32_t>(triangles_.size());
  // The box, in voxels, of everything that changes.
  Vec3 lo{1e300, 1e300, 1e300}, hi{-1e300, -1e300, -1e300};
  const auto include = [&](const std::array<Vec3, 3>& t, Vec3& low, Vec3& high) {
    for (const Vec3 p : t) {
      const Vec3 x = frame_.index_from_world(p);
      for (std::size_t a = 0; a < 3; ++a) {
        low[a] = std::min(low[a], x[a]);
        high[a] = std::max(high[a], x[a]);
      }
    }
  };
  const auto cell_list = [&](const std::array<Vec3, 3>& t) -> std::vector<std::uint32_t>& {
    const auto c = cell_of(t);
    return in_cell_[cell(c[0], c[1], c[2])];
  };
  for (const std::uint32_t id : removed) {
    if (id >= triangles_.size() || alive_[id] == 0)
      throw Error(ExitCode::usage, "there is no triangle " + std::to_string(id) + " to take away");
    alive_[id] = 0;
    auto& list = cell_list(triangles_[id]);
    list.erase(std::find(list.begin(), list.end(), id));
    include(triangles_[id], lo, hi);
  }
  Vec3 added_lo{1e300, 1e300, 1e300}, added_hi{-1e300, -1e300, -1e300};
  for (const auto& t : added) {
    const auto id = static_cast<std::uint32_t>(triangles_.size());
    triangles_.push_back(t);
    alive_.push_back(1);
    cell_list(t).push_back(id);
    const Vec3 c = (t[0] + t[1] + t[2]) / 3;
    for (const Vec3 p : t) largest_mm_ = std::max(largest_mm_, length(p - c));
    include(t, added_lo, added_hi);
  }
  for (std::size_t a = 0; a < 3; ++a) {
    lo[a] = std::min(lo[a], added_lo[a]);
    hi[a] = std::max(hi[a], added_hi[a]);
  }
  if (lo.x > hi.x) return first_added;
  // Voxels within reach of the changes, in whole blocks.
  std::array<int, 3> from{}, to{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double reach = reach_mm_ / frame_.spacing_mm[a];
    from[a] = static_cast<int>(std::clamp(std::floor(lo[a] - reach), 0.0, static_cast<double>(frame_.dims[a])));
    to[a] = static_cast<int>(std::clamp(std::ceil(hi[a] + reach) + 1, 0.0, static_cast<double>(frame_.dims[a])));
    if (from[a] >= to[a]) return first_added;
    from[a] = from[a] / kBlock * kBlock;
  }
  // Wanted: those whose nearest triangle went, and those to which an added one may be nearer than what they have.
  Frame local;
  local.dims = {to[0] - from[0], to[1] - from[1], to[2] - from[2]};
  VoxelBits wanted(local);
  bool any = false;
  for (int k = from[2]; k < to[2]; ++k) {
    for (int j = from[1]; j < to[1]; ++j) {
      std::uint64_t* const row = &wanted.words[wanted.row(j - from[1], k - from[2])];
      const double dy = std::max({added_lo.y - j, j - added_hi.y, 0.0}) * frame_.spacing_mm.y;
      const double dz = std::max({added_lo.z - k, k - added_hi.z, 0.0}) * frame_.spacing_mm.z;
      for (int i = from[0]; i < to[0]; ++i) {
        const Sample s = at(i, j, k);
        const double dx = std::max({added_lo.x - i, i - added_hi.x, 0.0}) * frame_.spacing_mm.x;
        const double has = s.stored() ? std::abs(s.distance_mm) : reach_mm_;
        const bool lost = s.stored() && alive_[s.triangle] == 0;
        if (!lost && dx * dx + dy * dy + dz * dz > has * has) continue;
        row[(i - from[0]) / 64] |= 1ULL << ((i - from[0]) % 64);
        any = true;
      }
    }
  }
  if (any) measure(from, to, wanted, inside);
  return first_added;
}

void LiveDistance::measure(std::array<int, 3> lo, std::array<int, 3> hi, const VoxelBits& wanted,
                           const InsideAt& inside) {
  // Triangles that can be within reach of a wanted voxel, by cells.
  std::array<int, 3> from = hi, to = lo;
  for (int k = lo[2]; k < hi[2]; ++k) {
    for (int j = lo[1]; j < hi[1]; ++j) {
      for (int i = lo[0]; i < hi[0]; ++i) {
        if (!wanted.at(i - lo[0], j - lo[1], k - lo[2])) continue;
        const int at[3] = {i, j, k};
        for (std::size_t a = 0; a < 3; ++a) {
          from[a] = std::min(from[a], at[a]);
          to[a] = std::max(to[a], at[a]);
        }
        ++touched_;
      }
    }
  }
  TriangleSoup near;
  std::vector<std::uint32_t> id_of;
  std::array<int, 3> first_cell{}, last_cell{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double margin = (reach_mm_ + largest_mm_) / frame_.spacing_mm[a];
    first_cell[a] = static_cast<int>(std::clamp((from[a] - margin) / 8, 0.0, cells_[a] - 1.0));
    last_cell[a] = static_cast<int>(std::clamp((to[a] + margin) / 8, 0.0, cells_[a] - 1.0));
  }
  for (int z = first_cell[2]; z <= last_cell[2]; ++z) {
    for (int y = first_cell[1]; y <= last_cell[1]; ++y) {
      for (int x = first_cell[0]; x <= last_cell[0]; ++x) {
        const auto& list = in_cell_[cell(x, y, z)];
        for (const std::uint32_t id : list) {
          const auto n = static_cast<std::uint32_t>(near.points_mm.size());
          for (const Vec3 p : triangles_[id]) near.points_mm.push_back(p);
          near.triangles.push_back({n, n + 1, n + 2});
          id_of.push_back(id);
        }
      }
    }
  }
  const auto store = [&](int i, int j, int k, double d, std::uint32_t id) {
    const bool there = at(i, j, k).stored();
    if (id == ClosestPoint::kNone && !there) return;
    Brick& b = brick_for(i / 8, j / 8, k / 8);
    const auto v = static_cast<std::size_t>((i & 7) + 8 * (j & 7) + 64 * (k & 7));
    b.triangle[v] = id;
    b.distance_mm[v] = id == ClosestPoint::kNone ? 0 : inside(i, j, k) ? -d : d;
  };
  if (near.triangles.empty()) {
    for (int k = lo[2]; k < hi[2]; ++k) {
      for (int j = lo[1]; j < hi[1]; ++j) {
        for (int i = lo[0]; i < hi[0]; ++i) {
          if (wanted.at(i - lo[0], j - lo[1], k - lo[2])) store(i, j, k, 0, ClosestPoint::kNone);
        }
      }
    }
    return;
  }
  Context here;
  here.threads = 1;
  const TriangleTree tree(near, frame_.direction, here);
  const TriangleTree::Data& data = tree.data();
  thread_local std::unique_ptr<BlockScratch> scratch;
  if (scratch == nullptr) scratch = std::make_unique<BlockScratch>();
  BlockMapper mapper(data, frame_, *scratch);
  const int edge = start_edge(data, frame_);
  std::uint32_t hint = 0;
  for (int z = lo[2]; z < hi[2]; z += kBlock) {
    for (int y = lo[1]; y < hi[1]; y += kBlock) {
      for (int x = lo[0]; x < hi[0]; x += kBlock) {
        std::array<std::uint16_t, 256> want{};
        unsigned any = 0;
        for (int k = 0; k < std::min(kBlock, hi[2] - z); ++k) {
          for (int j = 0; j < std::min(kBlock, hi[1] - y); ++j) {
            const std::size_t at = wanted.row(y + j - lo[1], z + k - lo[2]) + static_cast<std::size_t>(x - lo[0]) / 64;
            const auto bits = static_cast<std::uint16_t>(wanted.words[at] >> ((x - lo[0]) % 64));
            want[static_cast<std::size_t>(16 * k + j)] = bits;
            any |= bits;
          }
        }
        if (any == 0) continue;
        mapper.run({x, y, z}, want, reach_mm_ / data.unit_mm, edge, hint);
        for (std::size_t row = 0; row < 256; ++row) {
          for (unsigned rest = want[row]; rest != 0; rest &= rest - 1) {
            const int i = __builtin_ctz(rest);
            const std::size_t v = row * 16 + static_cast<std::size_t>(i);
            const std::uint32_t found = scratch->best_id[v];
            const double d = found == ClosestPoint::kNone ? 0 : std::sqrt(scratch->best_d2[v]) * data.unit_mm;
            const bool keep = found != ClosestPoint::kNone && d <= reach_mm_;
            store(x + i, y + static_cast<int>(row & 15), z + static_cast<int>(row >> 4), d,
                  keep ? id_of[data.original[found]] : ClosestPoint::kNone);
          }
        }
      }
    }
  }
}

}  // namespace osteo::inline geometry
