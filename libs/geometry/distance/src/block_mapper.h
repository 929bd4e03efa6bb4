// Nearest triangles of the voxels of a cube of 16^3. Private to libs/geometry/distance.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "osteo/core/base/portable_math.h"
#include "osteo/core/data/frame.h"
#include "tree_data.h"

namespace osteo::inline geometry {

inline constexpr int kBlock = 16;  // work is done in cubes of 16^3 voxels

// One thread's memory. Grows to what the largest block needs and stays.
struct BlockScratch {
  std::vector<float> floats;
  std::vector<std::uint32_t> packs, ids;
  struct Level {
    std::array<std::vector<std::uint32_t>, 8> lists;
  };
  std::array<Level, 4> levels;  // children of edge 8, 4, 2, 1
  // Single voxels with their few triangles, measured many at a time.
  std::vector<std::uint32_t> pair_id, pair_voxel;
  std::vector<double> d2;
  std::size_t pairs = 0;
  std::array<double, kBlock * kBlock * kBlock> best_d2;
  std::array<std::uint32_t, kBlock * kBlock * kBlock> best_id;
};

inline std::size_t padded(std::size_t n) {
  return (n + 15) / 16 * 16;
}

/// Hands lists of triangles down from cube to cube; see DistanceMapper.
class BlockMapper {
 public:
  BlockMapper(const TriangleTree::Data& tree, const Frame& frame, BlockScratch& scratch)
      : tree_(tree),
        kernel_(distance::kernel()),
        s_(scratch),
        origin_(tree.to_tree(frame.origin_mm)),
        step_(frame.spacing_mm / tree.unit_mm) {}

  // Nearest triangles of the wanted voxels of the block at `lo`: wanted[16 * z + y] has bit x. Leaves them in scratch.
  // Voxels farther than `reach` (tree units) from everything may be left without. The tree is asked once for each cube
  // of `edge` voxels.
  void run(std::array<int, 3> lo, const std::array<std::uint16_t, 256>& wanted, double reach, int edge,
           std::uint32_t& hint) {
    lo_ = lo;
    wanted_ = &wanted;
    reach_ = static_cast<float>(reach);
    s_.best_id.fill(ClosestPoint::kNone);
    s_.pairs = 0;
    for (int z = 0; z < kBlock; z += edge) {
      for (int y = 0; y < kBlock; y += edge) {
        for (int x = 0; x < kBlock; x += edge) {
          if (any_wanted({x, y, z}, edge)) start({x, y, z}, edge, hint);
        }
      }
    }
    measure_pairs();
  }

 private:
  void start(std::array<int, 3> at, int edge, std::uint32_t& hint) {
    const float half[3] = {half_of(edge, 0), half_of(edge, 1), half_of(edge, 2)};
    const Vec3 centre = centre_of(at, edge);
    const double c[3] = {centre.x, centre.y, centre.z};
    const double radius = std::sqrt(double(half[0]) * half[0] + double(half[1]) * half[1] + double(half[2]) * half[2]);
    // Single precision rounds more, the farther the block lies from the surface.
    margin_ = tree_.view.margin * static_cast<float>(std::max(
                                      1.0, std::max(std::abs(c[0]), std::max(std::abs(c[1]), std::abs(c[2]))) / 128));
    const double limit =
        std::isfinite(reach_) ? (static_cast<double>(reach_) + radius) * 1.00001 + static_cast<double>(margin_) : 1e150;
    const distance::Nearest nearest = kernel_.closest(tree_.view, c, hint, limit * limit);
    if (nearest.triangle == ClosestPoint::kNone) return;
    hint = nearest.triangle;
    const Vec3 place = distance::place_on(tree_.exact[nearest.triangle], centre).point;
    const Vec3 g = normalized(centre - place);
    const distance::Pivot pivot{static_cast<float>(std::sqrt(nearest.d2)),
                                {static_cast<float>(g.x), static_cast<float>(g.y), static_cast<float>(g.z)}};
    const float cf[3] = {static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2])};
    // The scratch outlives a map: another tree may have more packs.
    if (s_.packs.size() < tree_.view.triangles / 16 + 32) s_.packs.resize(tree_.view.triangles / 16 + 32);
    const int packs = kernel_.collect(tree_.view, cf, half, pivot, reach_, margin_, s_.packs.data());
    s_.ids.resize(static_cast<std::size_t>(packs) * 16);
    std::size_t count = 0;
    for (int p = 0; p < packs; ++p) {
      const std::uint32_t first = s_.packs[static_cast<std::size_t>(p)] * 16;
      for (std::uint32_t i = 0; i < 16; ++i) s_.ids[count++] = std::min(first + i, tree_.view.triangles - 1);
    }
    descend(at, edge, s_.ids.data(), count, 0);
  }

  [[nodiscard]] float half_of(int edge, std::size_t axis) const {
    return static_cast<float>((edge - 1) / 2.0 * step_[axis]) * 1.000001F;
  }
  [[nodiscard]] Vec3 centre_of(std::array<int, 3> at, int edge) const {
    const double h = (edge - 1) / 2.0;
    return {origin_.x + (lo_[0] + at[0] + h) * step_.x, origin_.y + (lo_[1] + at[1] + h) * step_.y,
            origin_.z + (lo_[2] + at[2] + h) * step_.z};
  }
  [[nodiscard]] bool any_wanted(std::array<int, 3> at, int edge) const {
    const auto mask = static_cast<std::uint16_t>(((1U << edge) - 1U) << at[0]);
    for (int z = at[2]; z < at[2] + edge; ++z) {
      for (int y = at[1]; y < at[1] + edge; ++y) {
        if (((*wanted_)[static_cast<std::size_t>(16 * z + y)] & mask) != 0) return true;
      }
    }
    return false;
  }

  // The cube of `edge` voxels at `at` with triangles that may be nearest to some of its voxels.
  void descend(std::array<int, 3> at, int edge, const std::uint32_t* ids, std::size_t count, std::size_t level) {
    // Short lists are measured at once: voxels side by side, triangle after triangle. The thresholds are where the two
    // ways cost the same.
    const std::size_t direct = edge == 2 ? 6 : edge == 4 ? 4 : edge == 8 ? 2 : 1;
    if (count <= direct) {
      measure_block(at, edge, ids, count);
      return;
    }
    const int child = edge / 2;
    distance::FilterTask task{};
    task.records = tree_.view.records;
    task.ids = ids;
    task.count = static_cast<int>(count);
    task.margin = margin_;
    task.reach = reach_;
    task.wanted = 0;
    const std::size_t room = padded(count);
    if (s_.floats.size() < 20 * room) s_.floats.resize(20 * room);
    task.scratch = s_.floats.data();
    std::array<std::array<int, 3>, 8> place;
    for (unsigned k = 0; k < 8; ++k) {
      place[k] = {at[0] + static_cast<int>(k & 1U) * child, at[1] + static_cast<int>(k >> 1 & 1U) * child,
                  at[2] + static_cast<int>(k >> 2) * child};
      if (!any_wanted(place[k], child)) continue;
      task.wanted |= 1U << k;
      const Vec3 c = centre_of(place[k], child);
      for (std::size_t a = 0; a < 3; ++a) task.centre[k][a] = static_cast<float>(c[a]);
      auto& list = s_.levels[level].lists[k];
      if (list.size() < room + 16) list.resize(room + 16);
      task.out[k] = list.data();
    }
    double radius = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      task.half[a] = child == 1 ? 0.0F : half_of(child, a);
      radius += double(task.half[a]) * task.half[a];
    }
    radius = std::sqrt(radius) * 1.00001;
    kernel_.filter(task);
    for (unsigned k = 0; k < 8; ++k) {
      if ((task.wanted >> k & 1U) == 0) continue;
      if (task.lowest[k] - static_cast<float>(radius) > reach_) continue;
      const auto n = static_cast<std::size_t>(task.out_count[k]);
      std::uint32_t* const list = task.out[k];
      if (child == 1) {
        if (s_.pair_id.size() < s_.pairs + n + 16) {
          s_.pair_id.resize(2 * s_.pairs + n + 4096);
          s_.pair_voxel.resize(s_.pair_id.size());
        }
        const std::uint32_t v = voxel_of(place[k]);
        for (std::size_t i = 0; i < n; ++i) {
          s_.pair_id[s_.pairs + i] = list[i];
          s_.pair_voxel[s_.pairs + i] = v;
        }
        s_.pairs += n;
      } else {
        for (std::size_t i = n; i < padded(n); ++i) list[i] = list[n - 1];
        descend(place[k], child, list, n, level + 1);
      }
    }
  }

  [[nodiscard]] static std::uint32_t voxel_of(std::array<int, 3> at) {
    return static_cast<std::uint32_t>((at[2] * 16 + at[1]) * 16 + at[0]);
  }

  void measure_block(std::array<int, 3> at, int edge, const std::uint32_t* ids, std::size_t count) {
    std::array<double, kBlock * kBlock> x, y, z, d2;
    std::array<std::uint32_t, kBlock * kBlock> id, voxel;
    const Vec3 o = centre_of({0, 0, 0}, 1);
    int n = 0;
    const auto flush = [&] {
      if (n == 0) return;
      const int full = (n + 7) / 8 * 8;
      for (int i = n; i < full; ++i) x[i] = x[n - 1], y[i] = y[n - 1], z[i] = z[n - 1];
      for (int i = 0; i < full; ++i) d2[i] = std::numeric_limits<double>::infinity(), id[i] = ClosestPoint::kNone;
      kernel_.measure_block(tree_.view.exact, ids, static_cast<int>(count), x.data(), y.data(), z.data(), full,
                            d2.data(), id.data());
      for (int i = 0; i < n; ++i) {
        s_.best_d2[voxel[i]] = d2[i];
        s_.best_id[voxel[i]] = id[i];
      }
      n = 0;
    };
    for (int c = at[2]; c < at[2] + edge; ++c) {
      for (int b = at[1]; b < at[1] + edge; ++b) {
        const unsigned row = (*wanted_)[static_cast<std::size_t>(16 * c + b)];
        for (int a = at[0]; a < at[0] + edge; ++a) {
          if ((row >> a & 1U) == 0) continue;
          x[n] = o.x + a * step_.x, y[n] = o.y + b * step_.y, z[n] = o.z + c * step_.z;
          voxel[n++] = voxel_of({a, b, c});
        }
        if (n > kBlock * kBlock - kBlock) flush();
      }
    }
    flush();
  }

  // A voxel's pairs lie together.
  void measure_pairs() {
    const std::size_t n = s_.pairs;
    if (n == 0) return;
    const std::size_t full = (n + 7) / 8 * 8;
    for (std::size_t i = n; i < full; ++i) {
      s_.pair_id[i] = s_.pair_id[n - 1];
      s_.pair_voxel[i] = s_.pair_voxel[n - 1];
    }
    if (s_.d2.size() < full) s_.d2.resize(s_.pair_id.size());
    const Vec3 o = centre_of({0, 0, 0}, 1);
    const double origin[3] = {o.x, o.y, o.z}, step[3] = {step_.x, step_.y, step_.z};
    kernel_.measure_voxels(tree_.view.exact, s_.pair_id.data(), s_.pair_voxel.data(), static_cast<int>(full), origin,
                           step, s_.d2.data());
    for (std::size_t i = 0; i < n;) {
      const std::uint32_t v = s_.pair_voxel[i];
      double best = s_.d2[i];
      std::uint32_t id = s_.pair_id[i];
      for (++i; i < n && s_.pair_voxel[i] == v; ++i) {
        const bool nearer = s_.d2[i] < best || (s_.d2[i] == best && s_.pair_id[i] < id);
        best = nearer ? s_.d2[i] : best;
        id = nearer ? s_.pair_id[i] : id;
      }
      s_.best_d2[v] = best;
      s_.best_id[v] = id;
    }
  }

  const TriangleTree::Data& tree_;
  const distance::Kernel& kernel_;
  BlockScratch& s_;
  Vec3 origin_, step_;
  std::array<int, 3> lo_{};
  const std::array<std::uint16_t, 256>* wanted_ = nullptr;
  float reach_ = 0, margin_ = 0;
};

// From which edge on it is cheapest to hand lists down, for surfaces with `density` triangles a voxel face. Nanoseconds
// a voxel, as measured: a question to the tree, and a triangle tried for a child.
inline int start_edge(double density) {
  constexpr double kAsk = 4000, kTry = 1.4;
  const auto list = [&](int edge, double slack) {
    const double r = 2.41 * (edge - 1) / 2.0 * std::sqrt(3.0) + 1 + slack;
    return 1.5 * density * 3.14 * r * r;
  };
  int best_edge = 16;
  double best = 1e300, below = 0;
  for (const int edge : {2, 4, 8, 16}) {
    const double first = list(edge, 0.7 * std::sqrt(16 / density));  // whole packs come from the tree
    const double total = (kAsk + first * (8 * kTry + 0.5)) / (edge * edge * edge) + below;
    if (total < best) best = total, best_edge = edge;
    below += list(edge, 0) * 8 * kTry / (edge * edge * edge);
  }
  return best_edge;
}
inline int start_edge(const TriangleTree::Data& tree, const Frame& frame) {
  const double face = portable::cbrt(frame.voxel_volume_mm3()) / tree.unit_mm;
  return start_edge(tree.area > 0 ? std::max(1e-6, tree.view.triangles / (tree.area / (face * face))) : 1.0);
}

}  // namespace osteo::inline geometry
