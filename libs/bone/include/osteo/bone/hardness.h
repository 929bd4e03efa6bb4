// How much each voxel of bone resists the burr.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "osteo/data/sparse_grid.h"
#include "osteo/grid/brick_grid.h"

namespace osteo {

/// Work to remove a volume relative to dense cortical bone (1500 HU), in proportion to mineral density, which is linear in HU (doi
/// 10.12989/aba.2013.1.1.015: to 1750 mg/cm3). That the work is in proportion to mineral density is a guess; the thesis has none.
/// Kept in steps of 1/64, between 1/8 and 3; one byte a voxel.
class Hardness {
 public:
  static constexpr double kCorticalHu = 1500;
  /// From the HU of the case, sampled at the voxels of the bone. Voxels without HU count as cortical.
  Hardness(const BrickGrid& bone, const SparseGrid& hu);
  /// Of a piece: its bricks are these of the whole.
  Hardness(const Hardness& whole, std::span<const std::uint32_t> bricks);
  [[nodiscard]] float at(VoxelKey voxel) const { return static_cast<float>(steps_[voxel]) / 64.0F; }
  [[nodiscard]] std::size_t memory_bytes() const { return steps_.size(); }

 private:
  std::vector<std::uint8_t> steps_;
};

}  // namespace osteo
