// Bone in pieces: each with a place of its own.
#pragma once
#include <vector>

#include "osteo/bone/live_components.h"
#include "osteo/grid/brick_grid.h"

namespace osteo {

/// world = rotation * piece + shift.
struct RigidTransform {
  Mat3 rotation{};
  Vec3 shift_mm{};
  [[nodiscard]] Vec3 operator()(Vec3 p) const { return rotation * p + shift_mm; }
  /// First `b`, then `a`.
  friend RigidTransform operator*(const RigidTransform& a, const RigidTransform& b) {
    RigidTransform r;
    for (std::size_t c = 0; c < 3; ++c) r.rotation.column[c] = a.rotation * b.rotation.column[c];
    r.shift_mm = a(b.shift_mm);
    return r;
  }
  [[nodiscard]] RigidTransform inverse() const {
    const Mat3 back = transposed(rotation);
    return {back, back * shift_mm * -1};
  }
};
/// About an axis (unit) through a point.
[[nodiscard]] RigidTransform rotation_about(Vec3 point_mm, Vec3 axis, double angle_rad);

/// A piece of bone in the frame it was cut in, and where it is now.
struct Piece {
  BrickGrid bone;
  RigidTransform world_from_piece;
  LiveComponents::Component solid;  ///< voxels, mass (sum of densities), centre, inertia, in the piece's own frame
  double volume_mm3 = 0;            ///< of all its density
};

struct Split {
  std::vector<Piece> pieces;  ///< largest first
  double crumbs_mm3 = 0;      ///< density of what hung together with nothing, or with too little: dust
  std::uint64_t crumbs = 0;   ///< parts that were too small
};
/// Takes bone apart along its components. A voxel of density below a half belongs to the part that most of its 26 neighbours belong to (the
/// first of equals); one without solid neighbours is dust. No density is lost: pieces and crumbs sum to the whole. O(bricks).
[[nodiscard]] Split split_bone(const BrickGrid& bone, double least_mm3, Connectivity connectivity = Connectivity::face);

}  // namespace osteo
