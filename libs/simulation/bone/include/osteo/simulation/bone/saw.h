// A cut by a thin blade, and the guide that holds the blade in a plane.
#pragma once
#include <cmath>
#include <vector>

#include "osteo/core/data/vec.h"
#include "osteo/geometry/grid/brick_grid.h"

namespace osteo::inline simulation {

// -- A cut by a thin blade.

/// A box: the blade's thickness along `normal`, its size across. With a size of 0 the cut goes through everything in
/// that direction.
struct SawCut {
  Vec3 at_mm;            ///< middle of the blade
  Vec3 normal{1, 0, 0};  ///< across the blade; need not be unit
  Vec3 along{0, 0, 1};   ///< where its length lies; taken at right angles to the normal
  double kerf_mm = 0.6;  ///< thickness of what is removed
  double length_mm = 0;  ///< along `along`; 0: endless
  double depth_mm = 0;   ///< along normal x along; 0: endless
};

/// Takes the share of each voxel that the box covers (its faces as planes within a voxel; exact but near the box's
/// edges). Adds the changed voxels to `changed` and returns the volume removed. Bricks that it changes become the
/// grid's own (BrickGrid::own_brick). Cost: 2 us a brick that it meets, 10 ns one that it does not; a whole head 10 ms.
double apply_saw(BrickGrid& bone, const SawCut& cut, std::vector<VoxelKey>& changed);
/// The voxels that it would change; nothing is. Cost: the same.
[[nodiscard]] std::vector<VoxelKey> voxels_sawn(const BrickGrid& bone, const SawCut& cut);

// -- A cutting guide: a slot that holds a saw in a plane which was planned before.

/// A plane of the world, and the slot of a printed guide in it where that has play. Not fixed to a piece: it stays
/// where it is when bone is moved.
struct CuttingGuide {
  Vec3 at_mm, normal{0, 0, 1};  ///< normal: unit. With play: `at_mm` is the middle of the slot's faces
  double within_mm = 0;         ///< a saw this near slips in; 0: there is no guide
  double play_mm = 0;           ///< width of the slot beyond the blade's; 0: the plane holds the blade without play
  Vec3 up_mm{};                 ///< in the plane, as long as the slot is high: from the bone out; with play alone
  double length_mm = 0;         ///< of the slot, across `up_mm`; with play alone

  /// Half of how far the slot's faces reach along a direction (unit) of the plane.
  [[nodiscard]] double reach_mm(Vec3 along) const {
    return (std::abs(dot(along, up_mm)) + std::abs(dot(along, normalized(cross(normal, up_mm)))) * length_mm) / 2;
  }

  [[nodiscard]] bool on() const { return within_mm > 0; }
  /// Of what lies in the plane 0; signed.
  [[nodiscard]] double offset_mm(Vec3 at) const { return dot(at - at_mm, normal); }
  /// A direction (unit) without its part across the plane; unit.
  [[nodiscard]] Vec3 along(Vec3 axis) const { return normalized(axis - normal * dot(axis, normal)); }
  friend bool operator==(const CuttingGuide&, const CuttingGuide&) = default;
};

}  // namespace osteo::inline simulation
