// A tool's shaft as a rigid body on the side of bone where it is.
#pragma once
#include <array>
#include <span>

#include "osteo/core/data/rigid_transform.h"
#include "osteo/simulation/haptics/detail/overlap.h"
#include "osteo/simulation/haptics/god_object.h"

namespace osteo::inline simulation {

/// God-object of one hand's shaft, turned as the hand has it: it stops where it meets bone, at the rim of a hole, at a
/// plate's face or in a slot too narrow for it, however far the hand goes on or draws back, and slides along what stops
/// it with little friction. All bodies of bone hold it together: their overlaps are added before it is asked where it
/// may be. A shaft that is in bone all around when it is first asked for (or after forget()) is let be until it is free
/// of it. No allocation after it was made; the same input gives the same bits.
class HeldShaft {
 public:
  static constexpr std::size_t kMaxBodies = 8;
  /// From call to call the offset changes by no more than this and twice what the hand moved: who pulls by a law of the
  /// offset has a force that never jumps.
  static constexpr double kReturnMm = 0.1;

  struct Body {
    const BrickGrid* bone = nullptr;
    const Grains* known = nullptr;  ///< where burrs have been in it; may be null
    VoxelKey name = 0;              ///< of its own: by it a body is told from another
    RigidTransform world_from_body{}, body_from_world{};
  };
  struct Answer {
    Vec3 offset_mm;       ///< from the hand's pose to where the shaft lets the tool be; zero: nothing holds it
    Vec3 torque_mm;       ///< about the tool's position, for a newton of push along the offset
    int evaluations = 0;  ///< of the overlap of the shaft with bone
  };
  /// At most kMaxBodies bodies count, the first ones. `shell_mm`: so much room it keeps beside bone that it lies flat
  /// on, less where it touches in a point; also the farthest that it goes between two looks, so half a voxel or less.
  /// `at_mm`, `axis` (unit) as of the instrument, in the world. A place that is not a number forgets. Cost: next
  /// to nothing while no bone is within a millimetre and a half, else an overlap of the part of the shaft that is near
  /// bone, mostly 2 to 4 in contact, 16 at most. Bone that comes back beside the shaft may be noticed 200 calls later.
  /// `across` (unit; zero: none): a slot holds the tool there, so bone moves it in the slot's plane alone.
  Answer follow(std::span<const Body> bodies, const RoundCone& shaft, double shell_mm, Vec3 at_mm, Vec3 axis,
                Vec3 across = {}) noexcept;
  void forget() noexcept;
  [[nodiscard]] Vec3 offset_mm() const { return offset_mm_; }  ///< of the last call

 private:
  static constexpr int kMaxStretches = 16;
  // A stretch of the shaft beside a body: whether bone was within looked_mm of it, from where it was looked at.
  struct Stretch {
    Vec3 at_mm, axis;
    double looked_mm = -1;  // negative: not yet
    int ago = 0;            // in calls
    bool near = true;
  };
  OverlapResult measure(const RoundCone& shaft, double grown_mm, Vec3 at_mm, Vec3 axis) noexcept;
  void look(const RoundCone& shaft, Vec3 at_mm, Vec3 axis) noexcept;
  void take(std::span<const Body> bodies, const RoundCone& shaft) noexcept;
  [[nodiscard]] double moved_mm(const Stretch& since, Vec3 at_mm, Vec3 axis) const noexcept;

  Overlap overlap_{0};
  GodObject proxy_;
  Vec3 offset_mm_, torque_mm_;
  Vec3 last_at_mm_, last_axis_;
  std::array<Body, kMaxBodies> bodies_;
  std::array<std::array<Stretch, kMaxStretches>, kMaxBodies> stretches_;
  std::size_t count_ = 0, next_ = 0;  // of bodies; the stretch that is looked at next
  int stretch_count_ = 1;
  RoundCone shape_{0, 0, 0, 0};
};

}  // namespace osteo::inline simulation
