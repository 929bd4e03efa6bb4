// A saw in a cutting guide.
#pragma once
#include "osteo/simulation/bone/saw.h"
#include "osteo/simulation/haptics/stream.h"

namespace osteo::inline simulation {

/// A saw slips in when its tip is within `within_mm` of the guide's plane and its blade within 30 degrees of it, and
/// out beyond four times that or 45 degrees; either takes kEaseS, so that nothing jumps. In the slot the blade is where
/// the hand and the plane agree: at the hand's place and in its direction, without what of them goes across the plane.
/// A spring pulls the hand after it, no harder than contact may push. The depth is the hand's own: nothing stops the
/// blade along the plane but bone. In a slot with play the blade lies as the hand has it as far as the faces let it:
/// within their reach along the blade it is off the plane by half of the play at most, and beyond them by what that
/// leaves of its slope. Turning about its own length is not limited: the blade is a rod. No allocation; the same input
/// gives the same bits.
class SawSlot {
 public:
  static constexpr double kEnterSine = 0.5, kLeaveSine = 0.70710678118654757;
  static constexpr double kLeaveTimes = 4, kEaseS = 0.15;

  /// Moves a saw's tip and its direction (unit) into the slot; false: they stay what they are. `saw`: one is in the
  /// hand.
  bool step(const CuttingGuide& guide, bool saw, Vec3& at_mm, Vec3& axis, double dt_s) noexcept;
  /// The normal of the plane that the saw is in, unit; after step() that said so.
  [[nodiscard]] Vec3 across() const noexcept { return held_.normal; }
  /// What the hand feels of it, after step(), by a spring and its limit.
  [[nodiscard]] Vec3 force_n(double stiffness_n_per_mm, double most_n) const noexcept;

 private:
  CuttingGuide held_;  // that the saw is in, or on its way out of
  bool in_ = false;
  double share_ = 0, offset_mm_ = 0;  // of the tip, to where the slot has it
};

/// Where an instrument points, unit: as the hand holds it, or as the guide does (kInSlot). Exact but for the kEaseS
/// after it has slipped in.
[[nodiscard]] inline Vec3 tool_axis(const TickRecord& tick, const CuttingGuide& guide) {
  const Vec3 axis = normalized(from_floats(tick.device.axis));
  return (tick.flags & kInSlot) != 0 && guide.on() ? guide.along(axis) : axis;
}

}  // namespace osteo::inline simulation
