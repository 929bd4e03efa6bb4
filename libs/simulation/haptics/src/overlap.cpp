#include "osteo/simulation/haptics/detail/overlap.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/simd.h"
#include "osteo/simulation/haptics/detail/grains.h"
#include "overlap_kernel.h"

namespace osteo::inline simulation {
namespace overlap {

BrickFunction brick_function() {
#if defined(__x86_64__)
  if (simd() == Simd::avx512) return &brick_avx512;
  if (simd() == Simd::avx2) return &brick_avx2;
#endif
  return &brick_base;
}

const GrainFunctions& grain_functions() {
  const BrickFunction chosen = brick_function();
#if defined(__x86_64__)
  if (chosen == &brick_avx512) return kGrainsAvx512;
  if (chosen == &brick_avx2) return kGrainsAvx2;
#endif
  return kGrainsBase;
}

}  // namespace overlap

namespace {

// Sums of floats tell no smaller share of what was summed.
constexpr double kRounding = 1e-6;

// Where density grows, by central differences. Neighbours mostly lie in the same brick, where they are a step away.
Vec3 density_slope(const BrickGrid& bone, VoxelKey voxel) noexcept {
  const std::uint32_t place = voxel % BrickGrid::kVoxels;
  const Ijk c = bone.coordinate(voxel);
  Vec3 slope;
  constexpr std::uint32_t kStep[3] = {1, 8, 64};
  for (std::size_t a = 0; a < 3; ++a) {
    const std::uint32_t at = place / kStep[a] % 8;
    const int di = a == 0 ? 1 : 0, dj = a == 1 ? 1 : 0, dk = a == 2 ? 1 : 0;
    const float below = at > 0 ? bone.value(voxel - kStep[a]) : bone.at(c.i - di, c.j - dj, c.k - dk);
    const float above = at < 7 ? bone.value(voxel + kStep[a]) : bone.at(c.i + di, c.j + dj, c.k + dk);
    slope[a] = static_cast<double>(above - below);
  }
  return slope;
}

}  // namespace

struct Overlap::PartialBuffer {
  std::vector<overlap::Partial> items;
  overlap::BrickFunction brick = overlap::brick_function();  // here: an unknown OSTEO_SIMD is told now, not in a tick
};

Overlap::Overlap(std::size_t most_hits) : hits_(most_hits + 512), partial_(std::make_unique<PartialBuffer>()) {
  partial_->items.resize(4096);
}
Overlap::~Overlap() = default;

OverlapResult Overlap::measure(const BrickGrid& bone, const RoundCone& shape, Vec3 start_mm, Vec3 axis,
                               const Grains* known, bool want_hits, double falloff_per_rad, std::uint32_t stride,
                               std::uint32_t phase) noexcept {
  OverlapResult result;
  count_ = 0;
  const Frame& frame = bone.frame();
  const double h = frame.spacing_mm.x;
  const Vec3 first_mm = start_mm + axis * shape.start_mm;
  if (!std::isfinite(dot(first_mm, first_mm)) || bone.brick_count() == 0) return result;
  const Vec3 start = frame.index_from_world(first_mm), along = transposed(frame.direction) * axis;
  const double length = shape.length_mm / h, radius = shape.largest_radius_mm() / h, b = shape.slope();

  overlap::Shape s{};
  for (std::size_t a = 0; a < 3; ++a) s.axis[a] = static_cast<float>(along[a]);
  s.length = static_cast<float>(length);
  s.start_radius = static_cast<float>(shape.start_radius_mm / h);
  s.slope = static_cast<float>(b);
  s.slope_run = static_cast<float>(b / std::sqrt(1 - b * b));
  s.falloff = static_cast<float>(falloff_per_rad);
  s.ball = shape.length_mm == 0;
  overlap::Sums sums;
  overlap::PartialList partial{partial_->items.data(), 0, partial_->items.size(),
                               known != nullptr ? known->begun() : nullptr};
  overlap::HitList list;
  list.hits = want_hits ? hits_.data() : nullptr;
  list.capacity = hits_.size() - 512;
  list.stride = std::max(stride, 1U);
  list.phase = phase;

  // Along the axis in pieces, so that an oblique shaft does not visit the whole box around it. A brick belongs to the
  // piece its middle projects onto; the first and the last reach beyond the ends.
  constexpr double kHalf = 3.5, kCorner = 6.95;  // of a brick: to its middle, and to a voxel's far corner
  const overlap::BrickFunction brick = partial_->brick;
  const int pieces = std::max(1, static_cast<int>(std::ceil(length / 24)));
  for (int piece = 0; piece < pieces; ++piece) {
    const double t0 = length * piece / pieces, t1 = length * (piece + 1) / pieces;
    int lo[3], hi[3];
    bool empty = false;
    for (std::size_t a = 0; a < 3; ++a) {
      const double p0 = start[a] + along[a] * t0, p1 = start[a] + along[a] * t1,
                   reach = radius + 1 + (pieces > 1 ? kCorner : 0);
      const double low = std::floor((std::min(p0, p1) - reach) / 8), high = std::floor((std::max(p0, p1) + reach) / 8);
      const double last = (frame.dims[a] - 1) / 8;
      empty = empty || low > last || high < 0;
      lo[a] = static_cast<int>(std::max(low, 0.0));
      hi[a] = static_cast<int>(std::min(high, last));
    }
    if (empty) continue;
    for (int bk = lo[2]; bk <= hi[2]; ++bk) {
      for (int bj = lo[1]; bj <= hi[1]; ++bj) {
        for (int bi = lo[0]; bi <= hi[0]; ++bi) {
          const std::uint32_t number = bone.find_brick(bi, bj, bk);
          if (number == BrickGrid::kNone) continue;
          const Vec3 q{bi * 8 + kHalf - start.x, bj * 8 + kHalf - start.y, bk * 8 + kHalf - start.z};
          const double t = dot(q, along);
          if (pieces > 1 && ((piece > 0 && t < t0) || (piece + 1 < pieces && t >= t1))) continue;
          const double foot = std::clamp(t, 0.0, length);
          if (dot(q, q) - 2 * foot * t + foot * foot > (radius + kCorner) * (radius + kCorner)) continue;
          const float first[3] = {static_cast<float>(q.x - kHalf), static_cast<float>(q.y - kHalf),
                                  static_cast<float>(q.z - kHalf)};
          brick(s, bone.values_of_brick(number), first, number * BrickGrid::kVoxels, sums, list, partial);
        }
      }
    }
  }
  count_ = list.count;
  // The product of density and share is right when bone and shape are spread through a voxel without regard to each
  // other. Where both end in it by a plane each, how the planes face decides: facing each other they share what is too
  // much for the voxel, facing alike they share the lesser part. Those bounds (M. Frechet 1951) are mixed by the cosine
  // between the normals. Where a burr has covered a voxel in part, it is known where its bone lies.
  double sharper = 0, moved = 0;
  for (std::size_t i = 0; i < partial.count; ++i) {
    const overlap::Partial& p = partial.items[i];
    if (known != nullptr && known->begun(p.voxel)) {
      const Grains::Felt felt = known->felt(p.voxel, p.density, p.share, p.normal);
      const double density = static_cast<double>(p.density);
      moved += static_cast<double>(felt.bone) - density * static_cast<double>(p.share);
      const double pressed = (std::min(1.0, static_cast<double>(felt.slope)) - density) * static_cast<double>(p.area);
      sums.surface += pressed;
      for (std::size_t a = 0; a < 3; ++a) {
        const double along_axis = pressed * static_cast<double>(p.normal[a]);
        sums.area[a] += along_axis;
        if (!s.ball) sums.area_foot[a] += along_axis * static_cast<double>(p.foot);
      }
      continue;
    }
    const Vec3 inwards = density_slope(bone, p.voxel);
    const double n = std::sqrt(dot(inwards, inwards));
    if (!(n > 1e-3)) continue;
    // The bone's outward normal is -inwards: they face each other when the shape's normal points the way of `inwards`.
    const double facing = dot(inwards, {static_cast<double>(p.normal[0]), static_cast<double>(p.normal[1]),
                                        static_cast<double>(p.normal[2])}) /
                          n;
    const double density = static_cast<double>(p.density), share = static_cast<double>(p.share),
                 product = density * share;
    const double bound = facing > 0 ? std::max(0.0, density + share - 1) : std::min(density, share);
    sharper += std::abs(facing) * (bound - product);
  }
  const double area = h * h, volume = area * h;
  // Where all that is under the shape was covered and taken, what is left of the sums is rounding.
  const double left = sums.volume + moved;
  result.spread_mm3 = sums.volume * volume;
  if (!(left > kRounding * sums.volume)) return result;
  result.bone_mm3 = left * volume;
  result.sharp_mm3 = std::max(0.0, (left + sharper) * volume);
  result.surface_mm2 = std::max(0.0, sums.surface) * area;
  result.area_mm2 = frame.direction * Vec3{sums.area[0], sums.area[1], sums.area[2]} * area;
  result.area_foot_mm3 = frame.direction * Vec3{sums.area_foot[0], sums.area_foot[1], sums.area_foot[2]} * volume +
                         result.area_mm2 * shape.start_mm;
  return result;
}

}  // namespace osteo::inline simulation
