// What the servo touches: bodies of bone where they are, and perhaps a plate in the hand.
#pragma once
#include <array>
#include <memory>
#include <span>
#include <vector>

#include "osteo/bone/depth_map.h"
#include "osteo/bone/plates.h"
#include "osteo/bone/rigid_transform.h"
#include "osteo/bone/world.h"
#include "osteo/haptics/haptic_setup.h"

namespace osteo {

/// What the servo keeps about one body of bone. Made outside the servo, written by it.
class TouchedBone {
 public:
  /// `setup` as the renderer has made it safe. The bone must outlive this; keeps `body` where there is one.
  TouchedBone(const HapticSetup& setup, BrickGrid& bone, std::shared_ptr<const Hardness> hardness);
  TouchedBone(const HapticSetup& setup, std::shared_ptr<Body> body);
  ~TouchedBone();

  /// Where the burr has been in a bone that this one came out of. Nothing is removed from that meanwhile.
  void inherit(const TouchedBone& before);
  [[nodiscard]] BrickGrid& bone() const { return bone_; }
  [[nodiscard]] const Body* body() const { return body_.get(); }
  [[nodiscard]] const Grains& grains() const { return removal_.grains(); }
  /// Whether anything within `radius_mm` of a point (in the bone's own frame) may be bone.
  [[nodiscard]] bool near(Vec3 own_mm, double radius_mm) const noexcept;

 private:
  friend class HapticRenderer;
  std::shared_ptr<Body> body_;
  BrickGrid& bone_;
  std::shared_ptr<const Hardness> hardness_;
  Vec3 middle_index_, half_index_;                                                             // of the box around its bricks
  std::array<std::unique_ptr<ContactModel>, EnumNames<ContactMethod>::values.size()> models_;  // those that some tool uses
  std::vector<ContactMethod> method_of_tool_;
  ContactModel* model_ = nullptr;  // of the tool in the hand
  Removal removal_;
  Overlap shaft_{0};
  std::unique_ptr<DepthMap> depth_map_;
  std::vector<VoxelKey> changed_;
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
    RigidTransform world_from_body, body_from_world;
  };
  std::vector<Item> items;
  std::shared_ptr<const PlateInHand> plate;
  RigidTransform grip;
  std::vector<VoxelChange> changes;  ///< room for those of a tick: make_room() after the last item
  void make_room();

  /// Of a world. Bodies that `before` has already keep what the servo knows of them; new ones know where the burr has been in the old.
  static HapticScene of(const World& world, const HapticSetup& setup, const HapticScene* before = nullptr);
};

/// Each sample that lies in bone is traced along its normal back out of the bone; the mean of the ways, weighted by area, is the depth and
/// direction of the push (D. Morris 2006, section 3.2.5, after the ray tracing of section 3.2.3.4). About 30 ns a sample outside bone, 0.2
/// us inside.
[[nodiscard]] ContactResult plate_contact(const PlateInHand& plate, const RigidTransform& world_from_plate,
                                          std::span<const HapticScene::Item> items, const ContactParams& params) noexcept;

/// Where a plate is for a device's position and axis.
[[nodiscard]] inline RigidTransform plate_pose(Vec3 position_mm, Vec3 axis, const RigidTransform& grip) {
  return RigidTransform{frame_of_axis(axis), position_mm} * grip;
}

}  // namespace osteo
