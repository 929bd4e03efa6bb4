#include "osteo/bone/depth_map.h"

#include <algorithm>
#include <cmath>

namespace osteo {

DepthMap::DepthMap(const BrickGrid& bone) : frame_(bone.frame()) {
  for (std::size_t a = 0; a < 3; ++a) dims_[a] = (frame_.dims[a] + kBlock - 1) / kBlock + 2;
  const std::size_t n = static_cast<std::size_t>(dims_[0]) * static_cast<std::size_t>(dims_[1]) * static_cast<std::size_t>(dims_[2]);
  nearest_.resize(n);
  for (std::size_t b = 0; b < n; ++b) nearest_[b] = static_cast<std::int32_t>(b);
  queued_.resize(n);
  for (std::uint32_t brick = 0; brick < bone.brick_count(); ++brick) {
    const Ijk o = bone.brick_coordinate(brick);
    for (int c = 0; c < 8; ++c) {
      const int i = o.i * 2 + (c & 1) + 1, j = o.j * 2 + (c >> 1 & 1) + 1, k = o.k * 2 + (c >> 2) + 1;
      if (i >= dims_[0] - 1 || j >= dims_[1] - 1 || k >= dims_[2] - 1 || !is_bone(bone, i, j, k)) continue;
      nearest_[(static_cast<std::size_t>(k) * dims_[1] + j) * dims_[0] + i] = kNowhere;
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
          if (nearest_[static_cast<std::size_t>(b + step)] == b + step) push(b + step);
        }
      }
    }
  }
  while (waiting_ > 0) relax(queue_[head_]);
}

bool DepthMap::is_bone(const BrickGrid& bone, int i, int j, int k) const noexcept {
  // A block lies within one brick.
  const int x = (i - 1) * kBlock, y = (j - 1) * kBlock, z = (k - 1) * kBlock;
  const VoxelKey first = bone.find(x, y, z);
  if (first == BrickGrid::kNone) return false;
  float sum = 0;
  for (unsigned c = 0; c < 64; ++c) sum += bone.value(first + (c & 3) + (c >> 2 & 3) * 8 + (c >> 4) * 64);
  return sum >= 32;
}

std::int64_t DepthMap::distance2(std::int32_t a, std::int32_t b) const noexcept {
  const int row = dims_[0], layer = dims_[0] * dims_[1];
  const std::int64_t dz = a / layer - b / layer, dy = a % layer / row - b % layer / row, dx = a % row - b % row;
  return dx * dx + dy * dy + dz * dz;
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
  const std::int32_t news = nearest_[static_cast<std::size_t>(block)];
  for (int dk = -1; dk <= 1; ++dk) {
    for (int dj = -1; dj <= 1; ++dj) {
      for (int di = -1; di <= 1; ++di) {
        const std::int32_t b = block + dk * layer + dj * row + di;
        if (b < 0 || b >= static_cast<std::int32_t>(nearest_.size())) continue;
        std::int32_t& known = nearest_[static_cast<std::size_t>(b)];
        if (known == b) continue;  // empty itself
        if (known != kNowhere && distance2(b, known) <= distance2(b, news)) continue;
        known = news;
        push(b);
      }
    }
  }
}

void DepthMap::update(const BrickGrid& bone, std::span<const VoxelKey> changed, int budget) noexcept {
  std::int32_t last = kNowhere;
  const int row = dims_[0], layer = dims_[0] * dims_[1];
  for (const VoxelKey v : changed) {
    const Ijk c = bone.coordinate(v);
    const int i = c.i / kBlock + 1, j = c.j / kBlock + 1, k = c.k / kBlock + 1;
    const std::int32_t b = k * layer + j * row + i;
    if (b == last || nearest_[static_cast<std::size_t>(b)] == b) continue;
    last = b;
    if (is_bone(bone, i, j, k)) continue;
    nearest_[static_cast<std::size_t>(b)] = b;
    push(b);
  }
  for (int n = 0; n < budget && waiting_ > 0; ++n) relax(queue_[head_]);
}

DepthMap::Answer DepthMap::at(Vec3 world_mm) const noexcept {
  const Vec3 x = frame_.index_from_world(world_mm);
  int at[3];
  for (std::size_t a = 0; a < 3; ++a) {
    if (!(x[a] >= -0.5 && x[a] <= frame_.dims[a] - 0.5)) return {};
    at[a] = static_cast<int>((x[a] + 0.5) / kBlock) + 1;
  }
  const std::int32_t b = (at[2] * dims_[1] + at[1]) * dims_[0] + at[0], out = nearest_[static_cast<std::size_t>(b)];
  if (out == b || out == kNowhere) return {};
  const int row = dims_[0], layer = dims_[0] * dims_[1];
  const auto middle = [](int block) { return (block - 1) * kBlock + 0.5 * (kBlock - 1); };
  const Vec3 goal{middle(out % row), middle(out % layer / row), middle(out / layer)};
  const Vec3 way = frame_.direction * ((goal - x) * frame_.spacing_mm.x);
  const double distance = length(way);
  if (!(distance > 0)) return {};
  return {std::max(0.0, distance - 0.5 * kBlock * frame_.spacing_mm.x), way / distance};
}

}  // namespace osteo
