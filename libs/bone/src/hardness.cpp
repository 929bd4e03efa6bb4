#include "osteo/bone/hardness.h"

#include <algorithm>
#include <cmath>

#include "osteo/grid/sampler.h"

namespace osteo {

Hardness::Hardness(const BrickGrid& bone, const SparseGrid& hu) : steps_(bone.brick_count() * BrickGrid::kVoxels, 64) {
  const GridSampler sampler(hu);
  for (VoxelKey v = 0; v < steps_.size(); ++v) {
    if (bone.value(v) <= 0) continue;
    const Ijk c = bone.coordinate(v);
    const auto value = static_cast<double>(sampler.nearest(bone.frame().world_from_index({double(c.i), double(c.j), double(c.k)})));
    if (value == hu.background) continue;
    steps_[v] = static_cast<std::uint8_t>(std::lround(64 * std::clamp(value / kCorticalHu, 0.125, 3.0)));
  }
}

Hardness::Hardness(const Hardness& whole, std::span<const std::uint32_t> bricks) {
  steps_.reserve(bricks.size() * BrickGrid::kVoxels);
  for (const std::uint32_t b : bricks) {
    const auto first = whole.steps_.begin() + static_cast<std::ptrdiff_t>(b) * BrickGrid::kVoxels;
    steps_.insert(steps_.end(), first, first + BrickGrid::kVoxels);
  }
}

}  // namespace osteo
