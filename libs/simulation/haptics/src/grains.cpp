#include "osteo/simulation/haptics/detail/grains.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "overlap_kernel.h"

namespace osteo::inline simulation {
namespace {

// Half a voxel's diagonal: a voxel whose middle is deeper inside a shape than this is inside.
constexpr float kHalfDiagonal = 0.8661F;
// Grains lie 0.05 to 0.07 mm apart: 64 of them in voxels below the first edge, 512 below the second, 4096 above.
constexpr double kFineMm = 0.28, kCoarseMm = 0.56;
// Counted in grains, a sweep is known to a percent at worst: the burr counts as a little smaller, so that it errs on
// the side of bone.
constexpr double kSpareMm = 0.0015;
// Between two looks at a voxel the burr moves no farther than this if that can be had by looking each tick: what a ball
// leaves between two places is an eighth of the square of their distance over its radius. But every fourth tick at
// least.
constexpr double kTurnMm = 0.1;
constexpr std::uint32_t kMaxTurns = 4;
// Cosine between two normals up to which they are of the same side of a voxel.
constexpr float kAlike = 0.5F;

// Share of a unit cube on the inner side of a plane; `alpha` from its inmost corner, in units of the sum of the
// normal's parts `m`, which sum to 1 and are none of them 0. R. Scardovelli, S. Zaleski, J. Comput. Phys. 164 (2000),
// equation 3, as a sum over corners.
double share_below(double alpha, const double (&m)[3]) {
  const auto cube = [](double x) { return x > 0 ? x * x * x : 0; };
  return (cube(alpha) - cube(alpha - m[0]) - cube(alpha - m[1]) - cube(alpha - m[2]) + cube(alpha - m[0] - m[1]) +
          cube(alpha - m[0] - m[2]) + cube(alpha - m[1] - m[2])) /
         (6 * m[0] * m[1] * m[2]);
}

}  // namespace

Grains::Grains(const BrickGrid& bone) {
  const std::size_t voxels = bone.brick_count() * BrickGrid::kVoxels;
  const double h = bone.frame().spacing_mm.x;
  parts_ = h < kFineMm ? 1 : h < kCoarseMm ? 2 : 4;
  words_ = parts_ * parts_ * parts_;
  before_.resize(voxels);
  for (std::uint32_t brick = 0; brick < bone.brick_count(); ++brick) {
    const float* const is = bone.values_of_brick(brick);
    std::uint8_t* const before = &before_[std::size_t{brick} * BrickGrid::kVoxels];
    for (std::size_t n = 0; n < BrickGrid::kVoxels; ++n)
      before[n] = static_cast<std::uint8_t>(static_cast<int>(std::min(std::max(is[n], 0.0F), 1.0F) * 255 + 0.5F));
  }
  covered_.resize((voxels + 63) / 64);
  begun_.resize((voxels + 7) / 8);
  // Twice as much as the burr's traces over 80 cm2 of bone need, or as a small piece has voxels.
  slots_.resize(std::clamp(std::bit_ceil(voxels), std::size_t{1024},
                           (std::size_t{1} << 21) >> (parts_ == 1   ? 1
                                                      : parts_ == 2 ? 3
                                                                    : 6)));
  grains_.resize(slots_.size() * words_);
}

void Grains::inherit(const BrickGrid& bone, const BrickGrid& from, const Grains& known) {
  const Frame &a = bone.frame(), &b = from.frame();
  if (a.spacing_mm != b.spacing_mm || a.origin_mm != b.origin_mm || a.direction != b.direction) return;
  // In order of their voxels, which is that of both bones: they come in the same order whatever their places in the
  // table.
  std::vector<std::uint32_t> begun;
  begun.reserve(known.used_);
  for (std::uint32_t s = 0; s < known.slots_.size(); ++s) {
    if (known.slots_[s].voxel != BrickGrid::kNone) begun.push_back(s);
  }
  std::sort(begun.begin(), begun.end(),
            [&](std::uint32_t x, std::uint32_t y) { return known.slots_[x].voxel < known.slots_[y].voxel; });
  auto next = begun.begin();
  // What a saw takes it takes alike of all that is in the voxel.
  const auto kept = [](float is, float was) { return was > 0 ? is / was : 1.0F; };
  for (std::uint32_t brick = 0; brick < bone.brick_count(); ++brick) {
    const Ijk at = bone.brick_coordinate(brick);
    const std::uint32_t there = from.find_brick(at.i, at.j, at.k);
    if (there == BrickGrid::kNone) continue;
    const float *const is = bone.values_of_brick(brick), *const was = from.values_of_brick(there);
    const VoxelKey first = brick * BrickGrid::kVoxels, old = there * BrickGrid::kVoxels;
    std::uint8_t* const before = &before_[first];
    const std::uint8_t* const known_before = &known.before_[old];
    if (is == was) {
      for (std::size_t n = 0; n < BrickGrid::kVoxels; ++n) before[n] = std::max(before[n], known_before[n]);
    } else {
      for (std::size_t n = 0; n < BrickGrid::kVoxels; ++n) {
        if (is[n] > was[n]) continue;
        before[n] = std::max(
            before[n], static_cast<std::uint8_t>(static_cast<float>(known_before[n]) * kept(is[n], was[n]) + 0.5F));
      }
    }
    for (std::uint32_t word = 0; word < BrickGrid::kVoxels / 64; ++word) {
      for (std::uint64_t bits = known.covered_[old / 64 + word]; bits != 0; bits &= bits - 1) {
        const std::uint32_t n = word * 64 + static_cast<std::uint32_t>(std::countr_zero(bits));
        if (is[n] > was[n] || is[n] <= 0) continue;
        covered_[first / 64 + word] |= bits & (~bits + 1);
      }
    }
    while (next != begun.end() && known.slots_[*next].voxel < old) ++next;
    for (; next != begun.end() && known.slots_[*next].voxel - old < BrickGrid::kVoxels; ++next) {
      const Slot& s = known.slots_[*next];
      const std::uint32_t n = s.voxel - old;
      if (is[n] > was[n] || is[n] <= 0 || used_ >= room()) continue;
      const VoxelKey voxel = first + n;
      const std::size_t slot = find(voxel);
      if (slots_[slot].voxel == voxel) continue;
      slots_[slot] = {voxel, s.grain * kept(is[n], was[n]), s.left, s.seen, s.towards};
      begun_[voxel / 8] |= static_cast<std::uint8_t>(1U << (voxel % 8));
      std::copy_n(&known.grains_[std::size_t{*next} * words_], words_, &grains_[slot * words_]);
      ++used_;
    }
  }
}

std::size_t Grains::memory_bytes() const {
  return before_.size() + covered_.size() * sizeof covered_[0] + begun_.size() + slots_.size() * sizeof slots_[0] +
         grains_.size() * sizeof grains_[0];
}

// Rows of voxels stay together.
std::size_t Grains::home(VoxelKey voxel) const noexcept {
  const std::uint32_t rows = static_cast<std::uint32_t>(slots_.size() / 8);
  return (((voxel >> 3) * 2654435761U) >> (32 - std::bit_width(rows - 1))) * 8 + (voxel & 7);
}

std::size_t Grains::find(VoxelKey voxel) const noexcept {
  std::size_t s = home(voxel);
  while (slots_[s].voxel != BrickGrid::kNone && slots_[s].voxel != voxel) s = (s + 1) & (slots_.size() - 1);
  return s;
}

// What follows moves up, so that every slot is found from its home without a gap.
void Grains::erase(std::size_t slot) noexcept {
  const VoxelKey voxel = slots_[slot].voxel;
  begun_[voxel / 8] &= static_cast<std::uint8_t>(~(1U << (voxel % 8)));
  const std::size_t last = slots_.size() - 1;
  for (std::size_t next = (slot + 1) & last; slots_[next].voxel != BrickGrid::kNone; next = (next + 1) & last) {
    const std::size_t wanted = home(slots_[next].voxel);
    if (((next - wanted) & last) < ((next - slot) & last)) continue;
    slots_[slot] = slots_[next];
    std::copy_n(&grains_[next * words_], words_, &grains_[slot * words_]);
    slot = next;
  }
  slots_[slot] = {};
  --used_;
}

void Grains::place(const BrickGrid& bone, const RoundCone& head, Vec3 start_mm, Vec3 axis, bool every,
                   std::size_t hand) noexcept {
  const Frame& frame = bone.frame();
  const double h = frame.spacing_mm.x, b = head.slope();
  const Vec3 start = frame.index_from_world(start_mm + axis * head.start_mm);
  Place& last = places_[hand];
  const double moved_mm = length(start - last.start) * h + length(axis - last.axis) * head.length_mm;
  last.start = start_ = start;
  last.axis = axis;
  turns_ = every ? 1 : moved_mm * kMaxTurns < kTurnMm ? kMaxTurns : moved_mm * 2 < kTurnMm ? 2 : 1;
  turn_ = ++last.turn;
  const Vec3 along = transposed(frame.direction) * axis;
  for (std::size_t a = 0; a < 3; ++a) head_.axis[a] = static_cast<float>(along[a]);
  head_.length = static_cast<float>(head.length_mm / h);
  head_.start_radius = static_cast<float>((head.start_radius_mm - kSpareMm) / h);
  head_.slope = static_cast<float>(b);
  head_.slope_run = static_cast<float>(b / std::sqrt(1 - b * b));
  head_.ball = head.length_mm == 0;
}

// All grains that the voxel's bone has.
void Grains::fill(const BrickGrid& bone, VoxelKey voxel, std::size_t slot) noexcept {
  std::uint64_t* const left = &grains_[slot * words_];
  const auto density = static_cast<double>(bone.value(voxel));
  std::fill_n(left, words_, ~std::uint64_t{0});
  const auto all = static_cast<std::uint32_t>(64 * words_);
  slots_[slot] = {voxel, static_cast<float>(density / all), all, 0, {}};
  begun_[voxel / 8] |= static_cast<std::uint8_t>(1U << (voxel % 8));
  if (density >= 1) return;
  // The slope of density by what the 26 neighbours were.
  int slope[3] = {};
  const Ijk c = bone.coordinate(voxel);
  const std::uint32_t place = voxel % BrickGrid::kVoxels;
  const bool inner = (place & 7) - 1 < 6U && (place >> 3 & 7) - 1 < 6U && (place >> 6) - 1 < 6U;
  for (int n = 0; n < 27; ++n) {
    const int d[3] = {n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
    const VoxelKey neighbour = inner ? voxel + static_cast<VoxelKey>(d[0] + 8 * d[1] + 64 * d[2])
                                     : bone.find(c.i + d[0], c.j + d[1], c.k + d[2]);
    const int value = neighbour == BrickGrid::kNone ? 0 : before_[neighbour];
    for (int a = 0; a < 3; ++a) slope[a] += d[a] * value * (2 >> (d[(a + 1) % 3] & 1)) * (2 >> (d[(a + 2) % 3] & 1));
  }
  double size[3], sum = 0;
  for (int a = 0; a < 3; ++a) {
    size[a] = std::max(std::abs(static_cast<double>(slope[a])), 1e-3);
    sum += size[a];
  }
  if (sum < 160) return;  // no plane to speak of: bone all through the voxel
  for (double& m : size) m /= sum;
  double lo = 0, hi = 1;
  for (int i = 0; i < 16; ++i) {
    const double alpha = 0.5 * (lo + hi);
    (share_below(alpha, size) < density ? lo : hi) = alpha;
  }
  const float inwards[3] = {static_cast<float>(slope[0]), static_cast<float>(slope[1]), static_cast<float>(slope[2])};
  const std::uint32_t count =
      overlap::grain_functions().plane(inwards, static_cast<float>((0.5 - lo) * sum), parts_, left);
  if (count == 0) {
    std::fill_n(left, words_, ~std::uint64_t{0});
  } else {
    slots_[slot].grain = static_cast<float>(density / count);
    slots_[slot].left = count;
  }
}

Grains::Felt Grains::felt(VoxelKey voxel, float density, float share, const float* normal) const noexcept {
  const Slot& s = slots_[find(voxel)];
  const Felt spread{density * share, density};
  const float cosine = (normal[0] * s.towards[0] + normal[1] * s.towards[1] + normal[2] * s.towards[2]) * (1.0F / 127);
  const float alike = std::clamp(cosine * (1 / kAlike), 0.0F, 1.0F);
  if (!(alike > 0)) return spread;
  const float kept = std::min(density, static_cast<float>(s.left) * s.grain), may_go = density - kept;
  Felt nested;
  if (share >= s.seen) {
    nested.slope = s.seen < 1 ? kept / (1 - s.seen) : density;
    nested.bone = may_go + (share - s.seen) * nested.slope;
  } else if (may_go > s.seen) {
    nested.slope = may_go / s.seen;
    nested.bone = share * nested.slope;
  } else if (share > s.seen - may_go) {
    nested.slope = 1;
    nested.bone = share - (s.seen - may_go);
  }
  return {alike * nested.bone + (1 - alike) * spread.bone, alike * nested.slope + (1 - alike) * spread.slope};
}

float Grains::reach(const BrickGrid& bone, VoxelKey voxel, float share) noexcept {
  std::uint64_t& bits = covered_[voxel / 64];
  const std::uint64_t bit = std::uint64_t{1} << (voxel % 64);
  if ((bits & bit) != 0) return 0;
  const Ijk c = bone.coordinate(voxel);
  const float at[3] = {static_cast<float>(c.i - start_.x), static_cast<float>(c.j - start_.y),
                       static_cast<float>(c.k - start_.z)};
  const float along = at[0] * head_.axis[0] + at[1] * head_.axis[1] + at[2] * head_.axis[2];
  const float q2 = at[0] * at[0] + at[1] * at[1] + at[2] * at[2];
  const float off = head_.slope_run == 0 ? 0 : std::sqrt(std::max(q2 - along * along, 0.0F));
  const float t = std::clamp(along - off * head_.slope_run, 0.0F, head_.length);
  const float distance = std::sqrt(std::max(q2 - 2 * t * along + t * t, 0.0F)) - (head_.start_radius - head_.slope * t);
  const std::size_t slot = find(voxel);
  const bool known = slots_[slot].voxel == voxel;
  if (distance > -kHalfDiagonal) {
    const bool waits = distance > kHalfDiagonal || (voxel / 8 + turn_) % turns_ != 0;
    if (!known) {
      if (waits) return bone.value(voxel);
      if (used_ >= room()) {
        overflowed_ = true;
        return bone.value(voxel);
      }
      fill(bone, voxel, slot);
      ++used_;
    }
    Slot& s = slots_[slot];
    if (!waits) {
      const overlap::Shape shape{{head_.axis[0], head_.axis[1], head_.axis[2]},
                                 head_.length,
                                 head_.start_radius,
                                 head_.slope,
                                 head_.slope_run,
                                 0,
                                 head_.ball};
      s.left = overlap::grain_functions().take(shape, at, parts_, &grains_[slot * words_]);
      float n[3], n2 = 1e-12F, cosine = 0;
      for (std::size_t a = 0; a < 3; ++a) {
        n[a] = at[a] - t * head_.axis[a];
        n2 += n[a] * n[a];
      }
      const float scale = 127 / std::sqrt(n2);
      for (std::size_t a = 0; a < 3; ++a) cosine += n[a] * scale * s.towards[a] * (1.0F / (127 * 127));
      if (share > s.seen || cosine < kAlike) {
        s.seen = share;
        for (std::size_t a = 0; a < 3; ++a) s.towards[a] = static_cast<std::int8_t>(n[a] * scale);
      }
    }
    if (s.left > 0) return static_cast<float>(s.left) * s.grain;
    erase(slot);
  } else if (known) {
    erase(slot);
  }
  bits |= bit;
  return 0;
}

}  // namespace osteo::inline simulation
