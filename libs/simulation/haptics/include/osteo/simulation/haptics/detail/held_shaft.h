// A tool's shaft as a rigid body on the side of bone where it is.
#pragma once
#include "osteo/simulation/haptics/detail/overlap.h"
#include "osteo/simulation/haptics/god_object.h"

namespace osteo::inline simulation {

/// God-object of a shaft, turned as the hand has it: it stops where it meets bone, at the rim of a hole, at a plate's
/// face or in a slot too narrow for it, however far the hand goes on or draws back, and slides along what stops it with
/// little friction. Of one hand and one body of bone, in the body's frame. A shaft that is in bone all around when it
/// is first asked for (or after forget()) is let be until it is free of it. No allocation after it was made; the same
/// input gives the same bits.
class HeldShaft {
 public:
  struct Answer {
    Vec3 offset_mm;  ///< from the hand's pose to where the shaft lets the tool be
    Vec3 torque_mm;  ///< about the tool's position, for a newton of push along the offset
    bool contact = false;
    int evaluations = 0;  ///< of the overlap of the shaft with bone
  };
  /// `shell_mm`: so much room it keeps beside bone that it lies flat on, less where it touches in a point; also the
  /// farthest that it goes between two looks, so half a voxel or less. `at_mm`, `axis` (unit) as of the instrument. A
  /// place that is not a number forgets. Cost: one overlap of the shaft away from bone, mostly 2 to 4 in contact, 16 at
  /// most.
  Answer follow(const BrickGrid& bone, const Grains* known, const RoundCone& shaft, double shell_mm, Vec3 at_mm,
                Vec3 axis) noexcept;
  void forget() noexcept {
    proxy_.forget();
    touched_ = false;
  }

 private:
  Overlap overlap_{0};
  GodObject proxy_;
  bool touched_ = false;  // when it was last asked for
};

}  // namespace osteo::inline simulation
