#include "bone_operations.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/core/base/parallel.h"

namespace osteo::inline imaging {
namespace {

void clear_runs(BitMask& bone, const Components& pieces, const std::function<bool(std::uint32_t)>& goes, bool value) {
  for (std::size_t i = 0; i < pieces.runs.size(); ++i) {
    const Run& r = pieces.runs[i];
    if (goes(pieces.component[i])) bone.set(r.row, static_cast<int>(r.begin), static_cast<int>(r.end), value);
  }
}

std::string run(const IslandEdit& o, const Image& ct, BitMask& bone, const Context& context) {
  std::array<int, 3> at{};
  if (!voxel_at(ct.frame, {o.at_mm[0], o.at_mm[1], o.at_mm[2]}, at) || !bone.at(at[0], at[1], at[2]))
    return "there is no bone at that point";
  context.progress(0.1, "finding components");
  const Components pieces = connected_components(bone.runs(true), bone.dims(), Connectivity::full);
  context.progress(0.8, "marking");
  const std::uint32_t row = static_cast<std::uint32_t>(at[2]) * static_cast<std::uint32_t>(bone.dims()[1]) +
                            static_cast<std::uint32_t>(at[1]);
  const auto x = static_cast<std::uint32_t>(at[0]);
  std::uint32_t chosen = 0;
  for (std::size_t i = 0; i < pieces.runs.size(); ++i) {
    const Run& r = pieces.runs[i];
    if (r.row == row && r.begin <= x && x < r.end) chosen = pieces.component[i];
  }
  clear_runs(
      bone, pieces, [&](std::uint32_t c) { return (c == chosen) == (o.choice == IslandChoice::remove); }, false);
  return {};
}

std::string run(const IslandSizeEdit& o, const Image& ct, BitMask& bone, const Context& context) {
  context.progress(0.1, "finding components");
  const Components pieces = connected_components(bone.runs(true), bone.dims(), Connectivity::full);
  context.progress(0.8, "marking");
  const std::vector<bool> drop =
      components_to_drop(pieces, o.min_volume_mm3 / ct.frame.voxel_volume_mm3(), o.keep_largest);
  clear_runs(
      bone, pieces, [&](std::uint32_t c) { return static_cast<bool>(drop[c]); }, false);
  const auto n = std::count(drop.begin(), drop.end(), true);
  return std::to_string(n) + (n == 1 ? " component" : " components") + " removed, " +
         std::to_string(drop.size() - static_cast<std::size_t>(n)) + " left";
}

// Of a row, the voxels whose centres lie within [lo, hi] along every axis: x as far as it is so. A range, since a box
// is convex.
std::pair<int, int> row_in_box(Vec3 first, Vec3 step, int n, Vec3 lo, Vec3 hi) {
  const auto inside = [&](int i) {
    const Vec3 p = first + step * i;
    return p.x >= lo.x && p.y >= lo.y && p.z >= lo.z && p.x <= hi.x && p.y <= hi.y && p.z <= hi.z;
  };
  double from = 0, to = n - 1;
  for (std::size_t a = 0; a < 3; ++a) {
    if (std::abs(step[a]) < 1e-12) {
      if (first[a] < lo[a] || first[a] > hi[a]) return {0, 0};
      continue;
    }
    const double s = (lo[a] - first[a]) / step[a], t = (hi[a] - first[a]) / step[a];
    from = std::max(from, std::min(s, t));
    to = std::min(to, std::max(s, t));
  }
  if (from > to + 1) return {0, 0};
  // The division may be off by a bit: the test itself decides at the ends.
  int begin = std::clamp(static_cast<int>(std::floor(from)) - 1, 0, n),
      end = std::clamp(static_cast<int>(std::ceil(to)) + 2, 0, n);
  while (begin < end && !inside(begin)) ++begin;
  while (end > begin && !inside(end - 1)) --end;
  return {begin, end};
}

std::string run(const BoxEdit& o, const Image& ct, BitMask& bone, const Context& context) {
  const Frame& f = ct.frame;
  const Vec3 lo{o.lo_mm[0], o.lo_mm[1], o.lo_mm[2]}, hi{o.hi_mm[0], o.hi_mm[1], o.hi_mm[2]};
  const Vec3 step = f.direction.column[0] * f.spacing_mm.x;
  parallel_for(bone.rows(), 256, context.threads, [&](std::size_t first, std::size_t last) {
    for (std::size_t r = first; r < last; ++r) {
      const auto j = static_cast<double>(r % static_cast<std::size_t>(f.dims[1])),
                 k = static_cast<double>(r / static_cast<std::size_t>(f.dims[1]));
      const auto [begin, end] = row_in_box(f.world_from_index({0, j, k}), step, f.dims[0], lo, hi);
      if (o.choice == BoxChoice::clear_inside) {
        bone.set(r, begin, end, false);
      } else {
        bone.set(r, 0, begin, false);
        bone.set(r, end, f.dims[0], false);
      }
    }
  });
  return {};
}

std::string run(const FillEdit& o, const Image& ct, BitMask& bone, const Context& context) {
  context.progress(0.1, "finding cavities");
  const Components spaces = connected_components(bone.runs(false), bone.dims(), Connectivity::face);
  context.progress(0.8, "filling");
  const auto ny = static_cast<std::uint32_t>(bone.dims()[1]), nz = static_cast<std::uint32_t>(bone.dims()[2]);
  std::vector<bool> open(spaces.voxels.size());
  for (std::size_t i = 0; i < spaces.runs.size(); ++i) {
    const Run& r = spaces.runs[i];
    const std::uint32_t j = r.row % ny, k = r.row / ny;
    if (r.begin == 0 || r.end == static_cast<std::uint32_t>(bone.dims()[0]) || j == 0 || j + 1 == ny || k == 0 ||
        k + 1 == nz)
      open[spaces.component[i]] = true;
  }
  const double most = o.max_volume_mm3 / ct.frame.voxel_volume_mm3();
  std::size_t filled = 0, larger = 0;
  std::vector<bool> fill(open.size());
  for (std::size_t c = 0; c < open.size(); ++c) {
    if (open[c]) continue;
    fill[c] = static_cast<double>(spaces.voxels[c]) <= most;
    ++(fill[c] ? filled : larger);
  }
  clear_runs(
      bone, spaces, [&](std::uint32_t c) { return static_cast<bool>(fill[c]); }, true);
  return std::to_string(filled) + (filled == 1 ? " cavity" : " cavities") + " filled, " + std::to_string(larger) +
         " larger left";
}

constexpr int kMaxReach = 5;  // the weights' product fits 32 bits

std::string run(const SmoothEdit& o, const Image& ct, BitMask& bone, const Context& context) {
  std::array<int, 3> reach{};
  for (std::size_t a = 0; a < 3; ++a)
    reach[a] = std::clamp(static_cast<int>(std::floor(o.radius_mm / ct.frame.spacing_mm[a] + 1e-9)), 0, kMaxReach);
  if (reach[0] + reach[1] + reach[2] == 0)
    throw Error(ExitCode::usage, "smoothing within less than a voxel does nothing",
                "take at least the distance of two voxels");
  // Binomial weights: 1 2 1, 1 4 6 4 1, ...
  std::array<std::array<std::uint32_t, 2 * kMaxReach + 1>, 3> weight{};
  std::uint32_t total = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    const int n = 2 * reach[a];
    std::uint32_t w = 1;
    for (int i = 0; i <= n; ++i) {
      weight[a][static_cast<std::size_t>(i)] = w;
      w = w * static_cast<std::uint32_t>(n - i) / static_cast<std::uint32_t>(i + 1);
    }
    total <<= n;
  }
  const BitMask before = bone;
  const int nx = bone.dims()[0], ny = bone.dims()[1], nz = bone.dims()[2];
  const std::size_t words = bone.words_per_row();
  parallel_for(bone.rows(), 512, context.threads, [&](std::size_t first, std::size_t last) {
    context.check_cancelled();
    std::array<std::uint32_t, 64 + 2 * kMaxReach> column{};
    for (std::size_t r = first; r < last; ++r) {
      const int j = static_cast<int>(r % static_cast<std::size_t>(ny)),
                k = static_cast<int>(r / static_cast<std::size_t>(ny));
      // Beyond the edge of the volume it is as at the edge.
      const auto row_at = [&](int dj, int dk) {
        return before.row(static_cast<std::size_t>(std::clamp(k + dk, 0, nz - 1)) * static_cast<std::size_t>(ny) +
                          static_cast<std::size_t>(std::clamp(j + dj, 0, ny - 1)));
      };
      for (std::size_t w = 0; w < words; ++w) {
        const int x0 = static_cast<int>(w) * 64, n = std::min(64, nx - x0);
        // Most words lie in air or deep in bone, where nothing changes.
        std::uint64_t any = 0, all = ~std::uint64_t{0};
        for (int dk = -reach[2]; dk <= reach[2]; ++dk) {
          for (int dj = -reach[1]; dj <= reach[1]; ++dj) {
            const std::span<const std::uint64_t> row = row_at(dj, dk);
            const std::uint64_t here = row[w], full = n == 64 ? here : here | ~((std::uint64_t{1} << n) - 1);
            const std::uint64_t left = w > 0 ? row[w - 1] >> 58 : 0, right = w + 1 < words ? row[w + 1] & 63 : 0;
            any |= here | left | right;
            all &= full & (w > 0 ? left | ~std::uint64_t{63} : ~std::uint64_t{0}) &
                   (w + 1 < words ? (row[w + 1] | ~bits_of_word(0, 0, std::min(nx - x0 - 64, kMaxReach)))
                                  : ~std::uint64_t{0});
          }
        }
        if (any == 0 || all == ~std::uint64_t{0}) continue;
        column.fill(0);
        for (int dk = -reach[2]; dk <= reach[2]; ++dk) {
          for (int dj = -reach[1]; dj <= reach[1]; ++dj) {
            const std::span<const std::uint64_t> row = row_at(dj, dk);
            const std::uint32_t v =
                weight[1][static_cast<std::size_t>(dj + reach[1])] * weight[2][static_cast<std::size_t>(dk + reach[2])];
            const auto bit = [&](int x) {
              const int c = std::clamp(x, 0, nx - 1);
              return static_cast<std::uint32_t>(row[static_cast<std::size_t>(c) / 64] >> (c % 64) & 1);
            };
            for (int x = -reach[0]; x < 0; ++x) column[static_cast<std::size_t>(x + kMaxReach)] += v * bit(x0 + x);
            const std::uint64_t here = row[w];
            for (int x = 0; x < n; ++x)
              column[static_cast<std::size_t>(x + kMaxReach)] += v * static_cast<std::uint32_t>(here >> x & 1);
            for (int x = n; x < n + reach[0]; ++x) column[static_cast<std::size_t>(x + kMaxReach)] += v * bit(x0 + x);
          }
        }
        std::uint64_t out = before.row(r)[w];
        for (int x = 0; x < n; ++x) {
          std::uint32_t sum = 0;
          for (int d = -reach[0]; d <= reach[0]; ++d)
            sum +=
                weight[0][static_cast<std::size_t>(d + reach[0])] * column[static_cast<std::size_t>(x + d + kMaxReach)];
          const std::uint64_t mask = std::uint64_t{1} << x;
          if (2 * static_cast<std::uint64_t>(sum) > total) out |= mask;
          if (2 * static_cast<std::uint64_t>(sum) < total) out &= ~mask;
        }
        bone.row(r)[w] = out;
      }
    }
  });
  std::string used;
  for (std::size_t a = 0; a < 3; ++a) used += (a > 0 ? " x " : "") + std::to_string(reach[a]);
  return "reach " + used + " voxels";
}

std::string run(const BrushEdit& o, const Image& ct, BitMask& bone, const Context&) {
  for (std::size_t i = 0; i < o.points_mm.size(); ++i) {
    rows_of_capsule(ct.frame, o.points_mm[i > 0 ? i - 1 : 0], o.points_mm[i], o.radius_mm,
                    [&](std::size_t row, int begin, int end) { bone.set(row, begin, end, !o.erase); });
  }
  return {};
}

struct Runner {
  const Image& ct;
  BitMask& bone;
  const Context& context;
  std::string operator()(const ThresholdEdit& o) const {
    bone = BitMask(ct, o.lower_hu, o.upper_hu, context.threads);
    return {};
  }
  std::string operator()(const IslandEdit& o) const { return run(o, ct, bone, context); }
  std::string operator()(const IslandSizeEdit& o) const { return run(o, ct, bone, context); }
  std::string operator()(const BoxEdit& o) const { return run(o, ct, bone, context); }
  std::string operator()(const FillEdit& o) const { return run(o, ct, bone, context); }
  std::string operator()(const SmoothEdit& o) const { return run(o, ct, bone, context); }
  std::string operator()(const BrushEdit& o) const { return run(o, ct, bone, context); }
  std::string operator()(const auto&) const { return {}; }
};

}  // namespace

std::string run_on_bone(const EditOperation& operation, const Image& ct, BitMask& bone, const Context& context) {
  return std::visit(Runner{ct, bone, context}, operation);
}

void rows_of_capsule(const Frame& frame, Vec3 a_mm, Vec3 b_mm, double radius_mm,
                     const std::function<void(std::size_t row, int begin, int end)>& visit) {
  // In millimetres along the grid's own axes, which are at right angles: distances are the same there.
  const Mat3 to_grid = inverse(frame.direction);
  const Vec3 a = to_grid * (a_mm - frame.origin_mm), b = to_grid * (b_mm - frame.origin_mm), ab = b - a;
  const double along2 = dot(ab, ab), r2 = radius_mm * radius_mm;
  std::array<int, 3> lo{}, hi{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double from = (std::min(a[axis], b[axis]) - radius_mm) / frame.spacing_mm[axis];
    const double to = (std::max(a[axis], b[axis]) + radius_mm) / frame.spacing_mm[axis];
    lo[axis] = static_cast<int>(std::clamp(std::floor(from), 0.0, static_cast<double>(frame.dims[axis])));
    hi[axis] = static_cast<int>(std::clamp(std::ceil(to) + 1, 0.0, static_cast<double>(frame.dims[axis])));
  }
  for (int k = lo[2]; k < hi[2]; ++k) {
    for (int j = lo[1]; j < hi[1]; ++j) {
      const auto inside = [&](int i) {
        const Vec3 p = Vec3{i * frame.spacing_mm.x, j * frame.spacing_mm.y, k * frame.spacing_mm.z} - a;
        const double t = along2 > 0 ? std::clamp(dot(p, ab) / along2, 0.0, 1.0) : 0.0;
        const Vec3 d = p - ab * t;
        return dot(d, d) <= r2;
      };
      // A capsule is convex: one range a row.
      int begin = lo[0], end = hi[0];
      while (begin < end && !inside(begin)) ++begin;
      while (end > begin && !inside(end - 1)) --end;
      if (begin < end)
        visit(static_cast<std::size_t>(k) * static_cast<std::size_t>(frame.dims[1]) + static_cast<std::size_t>(j),
              begin, end);
    }
  }
}

bool voxel_at(const Frame& frame, Vec3 world_mm, std::array<int, 3>& ijk) {
  const Vec3 x = frame.index_from_world(world_mm);
  for (std::size_t a = 0; a < 3; ++a) {
    const double v = std::floor(x[a] + 0.5);
    if (!(v >= 0 && v < frame.dims[a])) return false;
    ijk[a] = static_cast<int>(v);
  }
  return true;
}

}  // namespace osteo::inline imaging
