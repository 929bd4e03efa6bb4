#include "osteo/simulation/bone/depth_map.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/error.h"

namespace osteo::inline simulation {

DepthMap::DepthMap(const BrickGrid& bone) : frame_(bone.frame()) {
  int lo[3] = {0, 0, 0}, hi[3] = {-1, -1, -1};
  for (std::uint32_t brick = 0; brick < bone.brick_count(); ++brick) {
    const Ijk o = bone.brick_coordinate(brick);
    const int at[3] = {o.i, o.j, o.k};
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = brick == 0 ? at[a] : std::min(lo[a], at[a]);
      hi[a] = std::max(hi[a], at[a]);
    }
  }
  for (std::size_t a = 0; a < 3; ++a) {
    first_[a] = lo[a] * 2 - 1;
    dims_[a] = (hi[a] - lo[a] + 1) * 2 + 2;
  }
  const std::size_t n =
      static_cast<std::size_t>(dims_[0]) * static_cast<std::size_t>(dims_[1]) * static_cast<std::size_t>(dims_[2]);
  if (dims_[0] > 1024 || dims_[1] > 1024 || dims_[2] > 1024)
    throw Error(ExitCode::failed, "the bone is too large for the fail-safe's distance map",
                "set \"fail_safe\" to false, or crop the case");
  nearest_.resize(n);
  std::size_t number = 0;
  for (int k = 0; k < dims_[2]; ++k)
    for (int j = 0; j < dims_[1]; ++j)
      for (int i = 0; i < dims_[0]; ++i) nearest_[number++] = packed(i, j, k);
  queued_.resize(n);
  for (std::uint32_t brick = 0; brick < bone.brick_count(); ++brick) {
    const Ijk o = bone.brick_coordinate(brick);
    for (int c = 0; c < 8; ++c) {
      const int i = o.i * 2 + (c & 1) - first_[0], j = o.j * 2 + (c >> 1 & 1) - first_[1],
                k = o.k * 2 + (c >> 2) - first_[2];
      if (is_bone(bone, brick, c)) nearest_[(static_cast<std::size_t>(k) * dims_[1] + j) * dims_[0] + i] = kNowhere;
    }
  }
  // From every empty block beside bone inwards. The queue holds each block at most once, so it never overflows.
  queue_.resize(n + 1);
  const int row = dims_[0], layer = dims_[0] * dims_[1];
  for (int k = 1; k + 1 < dims_[2]; ++k) {
    for (int j = 1; j + 1 < dims_[1]; ++j) {
      for (int i = 1; i + 1 < dims_[0]; ++i) {
        const int b = k * layer + j * row + i;
        if (nearest_[static_cast<std::size_t>(b)] != kNowhere) continue;
        for (const int step : {-1, 1, -row, row, -layer, layer}) {
          const int n0 = b + step;
          const std::uint32_t own = packed(n0 % row, n0 % layer / row, n0 / layer);
          if (nearest_[static_cast<std::size_t>(n0)] == own) push(n0);
        }
      }
    }
  }
  while (waiting_ > 0) relax(queue_[head_]);
}

bool DepthMap::is_bone(const BrickGrid& bone, std::uint32_t brick, int octant) noexcept {
  const float* const v = bone.values_of_brick(brick) + (octant & 1) * 4 + (octant >> 1 & 1) * 32 + (octant >> 2) * 256;
  float sum = 0;
  for (int k = 0; k < 4; ++k) {
    for (int j = 0; j < 4; ++j) {
      const float* const row = v + j * 8 + k * 64;
      sum += (row[0] + row[1]) + (row[2] + row[3]);
    }
  }
  return sum >= 32;
}

void DepthMap::push(std::int32_t block) noexcept {
  auto& queued = queued_[static_cast<std::size_t>(block)];
  if (queued != 0) return;
  queued = 1;
  queue_[(head_ + waiting_++) % queue_.size()] = block;
}

void DepthMap::relax(std::int32_t block) noexcept {
  head_ = (head_ + 1) % queue_.size();
  --waiting_;
  queued_[static_cast<std::size_t>(block)] = 0;
  const int row = dims_[0], layer = dims_[0] * dims_[1];
  const std::uint32_t news = nearest_[static_cast<std::size_t>(block)];
  const int i = block % row, j = block % layer / row, k = block / layer;
  for (int dk = k > 0 ? -1 : 0; dk <= (k + 1 < dims_[2] ? 1 : 0); ++dk) {
    for (int dj = j > 0 ? -1 : 0; dj <= (j + 1 < dims_[1] ? 1 : 0); ++dj) {
      for (int di = i > 0 ? -1 : 0; di <= (i + 1 < dims_[0] ? 1 : 0); ++di) {
        const std::int32_t b = block + dk * layer + dj * row + di;
        const std::uint32_t own = packed(i + di, j + dj, k + dk);
        std::uint32_t& known = nearest_[static_cast<std::size_t>(b)];
        if (known == own) continue;  // empty itself
        if (known != kNowhere && distance2(own, known) <= distance2(own, news)) continue;
        known = news;
        push(b);
      }
    }
  }
}

void DepthMap::update(const BrickGrid& bone, std::span<const VoxelKey> changed, int budget) noexcept {
  std::int32_t last = -1;
  const int row = dims_[0], layer = dims_[0] * dims_[1];
  for (const VoxelKey v : changed) {
    const Ijk c = bone.coordinate(v);
    const int i = c.i / kBlock - first_[0], j = c.j / kBlock - first_[1], k = c.k / kBlock - first_[2];
    const std::int32_t b = k * layer + j * row + i;
    const std::uint32_t own = packed(i, j, k);
    if (b == last || nearest_[static_cast<std::size_t>(b)] == own) continue;
    last = b;
    if (is_bone(bone, v / BrickGrid::kVoxels, (c.i >> 2 & 1) | (c.j >> 2 & 1) << 1 | (c.k >> 2 & 1) << 2)) continue;
    nearest_[static_cast<std::size_t>(b)] = own;
    push(b);
  }
  for (int n = 0; n < budget && waiting_ > 0; ++n) relax(queue_[head_]);
}

DepthMap::Answer DepthMap::at(Vec3 world_mm) const noexcept {
  const Vec3 x = frame_.index_from_world(world_mm);
  int at[3];
  for (std::size_t a = 0; a < 3; ++a) {
    const double block = (x[a] + 0.5) / kBlock - first_[a];
    if (!(block >= 0 && block < dims_[a])) return {};
    at[a] = static_cast<int>(block);
  }
  const std::uint32_t out = nearest_[static_cast<std::size_t>((at[2] * dims_[1] + at[1]) * dims_[0] + at[0])];
  if (out == packed(at[0], at[1], at[2]) || out == kNowhere) return {};
  const auto middle = [&](std::size_t a) {
    return (static_cast<int>(out >> (10 * a) & 1023) + first_[a]) * kBlock + 0.5 * (kBlock - 1);
  };
  const Vec3 goal{middle(0), middle(1), middle(2)};
  const Vec3 way = frame_.direction * ((goal - x) * frame_.spacing_mm.x);
  const double distance = length(way);
  if (!(distance > 0)) return {};
  return {std::max(0.0, distance - 0.5 * kBlock * frame_.spacing_mm.x), way / distance};
}

}  // namespace osteo::inline simulation
