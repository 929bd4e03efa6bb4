// Bone in pieces: each with a place of its own.
#pragma once
#include <utility>
#include <vector>

#include "osteo/geometry/grid/brick_grid.h"
#include "osteo/simulation/bone/live_components.h"

namespace osteo::inline simulation {

/// A piece of bone in the frame it was cut in.
struct Piece {
  BrickGrid bone;  ///< the first piece keeps all bricks of the whole, and so its voxels their names; others only what
                   ///< they hold
  LiveComponents::Component solid;  ///< of the whole: voxels, mass (sum of densities), centre, inertia
  PieceOrigin origin;               ///< empty for the first
  [[nodiscard]] double volume_mm3() const {
    return bone.sum() * bone.frame().voxel_volume_mm3();
  }  ///< of all its density
};

struct Split {
  std::vector<Piece> pieces;                  ///< largest first
  double crumbs_mm3 = 0;                      ///< density of what hung together with nothing, or with too little: dust
  std::uint64_t crumbs = 0;                   ///< parts that were too small
  std::vector<std::uint32_t> changed_bricks;  ///< of the first piece: not as in the whole any more, ascending
  std::vector<std::pair<VoxelKey, float>> loose;  ///< of the whole: voxels with the density that crumbs had there
};
/// Takes bone apart along its components. A voxel of density below a half near more than one of them belongs to the
/// part that most of its 26 neighbours belong to (the first of equals); one without solid neighbours there is dust. No
/// density is lost: pieces and crumbs sum to the whole. Bricks that are of one piece alone are not copied but shared
/// with the whole (BrickGrid). `components` of this bone, up to date; nobody writes the bone meanwhile. O(bricks), and
/// 2 us for each where parts meet.
[[nodiscard]] Split split_bone(const BrickGrid& bone, const LiveComponents& components, double least_mm3);
[[nodiscard]] Split split_bone(const BrickGrid& bone, double least_mm3, Connectivity connectivity = Connectivity::face);

}  // namespace osteo::inline simulation
