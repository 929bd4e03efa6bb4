// What the servo touches: bodies of bone where they are, and perhaps plates in hands.
#pragma once
#include <array>
#include <memory>
#include <span>
#include <vector>

#include "osteo/core/data/rigid_transform.h"
#include "osteo/simulation/bone/depth_map.h"
#include "osteo/simulation/bone/plates.h"
#include "osteo/simulation/bone/world.h"
#include "osteo/simulation/haptics/detail/held_shaft.h"
#include "osteo/simulation/haptics/detail/overlap.h"
#include "osteo/simulation/haptics/haptic_setup.h"

namespace osteo::inline simulation {

/// What the servo keeps about one body of bone, whichever hand touches it. Made outside the servo, written by it.
class TouchedBone {
 public:
  /// The bone must outlive this; keeps `body` where there is one.
  TouchedBone(BrickGrid& bone, std::shared_ptr<const Hardness> hardness);
  explicit TouchedBone(std::shared_ptr<Body> body);

  /// Where burrs have been in a bone that this one came out of. Nothing is removed from that meanwhile.
  void inherit(const TouchedBone& before);
  [[nodiscard]] BrickGrid& bone() const { return bone_; }
  [[nodiscard]] const Body* body() const { return body_.get(); }
  [[nodiscard]] const Hardness* hardness() const { return hardness_.get(); }
  [[nodiscard]] const Grains& grains() const { return removal_.grains(); }
  [[nodiscard]] Removal& removal() { return removal_; }
  /// The voxels of changes, in the bone's own numbers; valid until the next call. No allocation.
  [[nodiscard]] std::span<const VoxelKey> voxels_of(std::span<const VoxelChange> changes) noexcept;
  /// Its voxels' names in the stream begin here.
  [[nodiscard]] VoxelKey first_name() const { return body_ ? body_->name_of(0) : 0; }
  /// Whether anything within `radius_mm` of a point (in the bone's own frame) may be bone.
  [[nodiscard]] bool near(Vec3 own_mm, double radius_mm) const noexcept;

 private:
  std::shared_ptr<Body> body_;
  BrickGrid& bone_;
  std::shared_ptr<const Hardness> hardness_;
  Vec3 middle_index_, half_index_;  // of the box around its bricks
  Removal removal_;
  std::vector<VoxelKey> voxels_;
};

/// What the servo keeps of one hand's contact with one body: a model for each method that some instrument uses.
struct HandContact {
  /// Takes over the models that `before` (may be null) has.
  HandContact(const HapticSetup& setup, double spacing_mm, const HandContact* before);
  /// Whether it has all models that the setup asks for.
  [[nodiscard]] bool serves(const HapticSetup& setup) const;

  std::array<std::shared_ptr<ContactModel>, EnumNames<ContactMethod>::values.size()> models;
  std::array<std::vector<std::size_t>, EnumNames<ContactMethod>::values.size()> tools;  ///< that each model is for
  ContactModel* in_use = nullptr;  ///< of the instrument in the hand
  Overlap pressed_shaft{0};        ///< of one that is not held
};

/// A plate as the hand feels it.
struct PlateInHand {
  std::vector<PlateSample> samples;
  double side_mm2 = 0;  ///< area of its underside
  double radius_mm = 0;
  /// About `count` samples; the moving part of a distractor too, closed.
  explicit PlateInHand(const PlateModel& plate, int count = 600);
};

/// Made outside the servo and handed to it whole.
struct HapticScene {
  struct Item {
    std::shared_ptr<TouchedBone> bone;
    std::shared_ptr<DepthMap> depth_map;              ///< null where the setup does not want it
    std::vector<std::shared_ptr<HandContact>> hands;  ///< in their order
    RigidTransform world_from_body, body_from_world;
  };
  struct Held {
    std::shared_ptr<const PlateInHand> plate;  ///< null: the hand's instrument
    RigidTransform grip;
  };
  std::vector<Item> items;
  std::array<Held, kMaxHands> held;
  std::array<CuttingGuide, kMaxHands> guides;  ///< of the hands' saws
  std::vector<VoxelChange> changes;            ///< room for those of a tick

  /// One more body there.
  void add(std::shared_ptr<TouchedBone> bone, const RigidTransform& world_from_body, const HapticSetup& setup);
  /// Of a world. Bodies that `before` has already keep what the servo knows of them; new ones know where burrs have
  /// been in the old. Depth maps that were not there before are made of the bone as it is: nothing may be removed
  /// meanwhile (needs_bone_held).
  static HapticScene of(const World& world, const HapticSetup& setup, const HapticScene* before = nullptr);
  /// Whether of() with this setup would measure bone that the servo is drilling in.
  [[nodiscard]] bool needs_bone_held(const HapticSetup& setup) const;
};

/// The method of contact by instrument, as the setup has it; a saw that nothing is said of goes by its proxy, since a
/// hand would push so thin a blade through the bone otherwise. Where shafts are held so does what cannot cut: its tip
/// has no business behind bone. `usual`: the method in force, which settings may change.
[[nodiscard]] ContactMethod method_of(const HapticSetup& setup, ContactMethod usual, std::size_t tool) noexcept;
[[nodiscard]] inline ContactMethod method_of(const HapticSetup& setup, std::size_t tool) noexcept {
  return method_of(setup, setup.params.contact.method, tool);
}

/// Each sample that lies in bone is traced along its normal back out of the bone; the mean of the ways, weighted by
/// area, is the depth and direction of the push (D. Morris 2006, section 3.2.5, after the ray tracing of
/// section 3.2.3.4). About 30 ns a sample outside bone, 0.2 us inside.
[[nodiscard]] ContactResult plate_contact(const PlateInHand& plate, const RigidTransform& world_from_plate,
                                          std::span<const HapticScene::Item> items,
                                          const ContactParams& params) noexcept;

/// Where a plate is for a device's position and axis.
[[nodiscard]] inline RigidTransform plate_pose(Vec3 position_mm, Vec3 axis, const RigidTransform& grip) {
  return RigidTransform{frame_of_axis(axis), position_mm} * grip;
}

}  // namespace osteo::inline simulation
