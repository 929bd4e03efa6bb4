// Where a rigid thing is.
#pragma once
#include "osteo/core/data/vec.h"

namespace osteo {

/// world = rotation * own + shift. Rotations are proper and orthonormal.
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

/// A frame with its z axis along `axis` (unit), turned from the world's by the shortest way; for -z about x. Continuous
/// but there.
[[nodiscard]] Mat3 frame_of_axis(Vec3 axis);

}  // namespace osteo
