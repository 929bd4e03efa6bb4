// A cutting guide: a slot that holds a saw in a plane which was planned before.
#pragma once
#include "osteo/core/data/vec.h"

namespace osteo::inline simulation {

/// A plane of the world, without extent. Not fixed to a piece: it stays where it is when bone is moved.
struct CuttingGuide {
  Vec3 at_mm, normal{0, 0, 1};  ///< normal: unit
  double within_mm = 0;         ///< a saw this near slips in; 0: there is no guide

  [[nodiscard]] bool on() const { return within_mm > 0; }
  /// Of what lies in the plane 0; signed.
  [[nodiscard]] double offset_mm(Vec3 at) const { return dot(at - at_mm, normal); }
  /// A direction (unit) without its part across the plane; unit.
  [[nodiscard]] Vec3 along(Vec3 axis) const { return normalized(axis - normal * dot(axis, normal)); }
  friend bool operator==(const CuttingGuide&, const CuttingGuide&) = default;
};

}  // namespace osteo::inline simulation
