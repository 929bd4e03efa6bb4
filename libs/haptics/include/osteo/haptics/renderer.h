// Haptic rendering: all that happens to a pose between the device and the hand, but for the device.
#pragma once
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "osteo/haptics/curve_constraint.h"
#include "osteo/haptics/guard.h"
#include "osteo/haptics/haptic_scene.h"
#include "osteo/haptics/vibration.h"

namespace osteo {

/// What the burr's head did near one structure at risk.
struct StructureEvents {
  double least_clearance_mm = 0;
  std::uint64_t ticks_touched = 0, ticks_injured = 0;
};

/// Pose to force and removal. Owns all buffers but those of the scene. step() neither allocates nor locks nor throws, and the same sequence
/// of samples and scenes gives the same bits.
/// The force: contact of the head by the chosen method, contact of the shaft (exact overlap), both elastic and watched by the passivity
/// observer; drag of the teeth, along normal x axis (D. Morris 2006, section 3.2.3.7: summed over a ball it is that cross product) and
/// vibration, both motor-driven; a curve's pull. With a plate in the hand, its contact alone. Then the limits of Guard.
/// Several bodies: what the burr overlaps in each is added up before the law of force is applied, so that a cut through bone that nobody
/// has opened cannot be felt (other methods than overlap: forces are added). At most kMostTouched bodies in a tick, the first in order.
class HapticRenderer {
 public:
  static constexpr std::size_t kMostTouched = 4;

  /// What the scene knows of the patient besides bone may be null. Errors: usage, when the vibration's text is not valid.
  HapticRenderer(const HapticSetup& setup, const Anatomy& anatomy, double dt_s);
  /// For one bone that stays where it is, and that must outlive this.
  HapticRenderer(const HapticSetup& setup, BrickGrid& bone, const Anatomy& anatomy, double dt_s);
  ~HapticRenderer();

  /// From the next step on. The scene belongs to the caller and must live until another is shown. No allocation.
  void show(HapticScene* scene) noexcept { scene_ = scene; }
  /// What soft tissue pushes with from now on (ActionKind::soft_push): a plane near the tool, made by whoever moves the tissue, felt at
  /// full rate.
  void feel(const SceneAction& push) noexcept;
  /// Nothing is removed while held.
  void hold(bool on) noexcept { held_ = on; }

  struct Step {
    TickRecord record;                     ///< all but tick number and machine times
    std::span<const VoxelChange> changes;  ///< valid until the next step
  };
  Step step(const DeviceSample& sample) noexcept;

  /// Of the last step, before limits.
  [[nodiscard]] const ContactResult& contact() const { return contact_; }
  /// By value in the label map: of every structure that ever was within reach, whichever was the nearest. What a record tells is the
  /// nearest alone. Follows from samples and scenes, so a replay gets the same. Not while another thread steps.
  [[nodiscard]] std::map<std::uint32_t, StructureEvents> structure_events() const;
  /// What is really used: the asked one, or less for the sake of stability.
  [[nodiscard]] double stiffness_n_per_mm() const { return setup_.params.contact.stiffness_n_per_mm; }
  /// The setup with what stability allows; bodies are made with it.
  [[nodiscard]] const HapticSetup& setup() const { return setup_; }

 private:
  struct Touch {
    HapticScene::Item* item = nullptr;
    ContactResult contact;  // in the world
  };
  void touch(const DeviceSample& pose) noexcept;
  void combine(Vec3 axis) noexcept;
  void escape(Vec3 at_mm, double radius_mm, double full_mm3) noexcept;
  void shaft(Vec3 at_mm, Vec3 axis, Vec3& elastic, Vec3& torque) noexcept;
  std::span<const VoxelChange> remove(double& removed_mm3) noexcept;
  [[nodiscard]] double thickness(Vec3 at_mm, Vec3 axis) const noexcept;
  void watch(const RoundCone& head, Vec3 at_mm, Vec3 axis, bool cuts, TickRecord& record) noexcept;

  HapticSetup setup_;
  Anatomy anatomy_;
  double dt_s_;
  HapticScene own_;  // where it was made for one bone
  HapticScene* scene_ = nullptr;
  bool held_ = false;
  struct {
    Vec3 at_mm, normal;
    double force_n = 0, stiffness_n_per_mm = 0;
  } soft_;
  std::array<Touch, kMostTouched> touched_;
  std::size_t touched_count_ = 0;
  const HapticScene::Item* loaded_ = nullptr;  // that the tool presses on most
  Vibration vibration_;
  std::optional<Curve> curve_;
  std::optional<CurveConstraint> constraint_;
  Guard guard_;
  ContactResult contact_;
  DeviceSample last_good_;
  bool has_last_ = false;
  std::uint32_t flags_ = 0;
  std::vector<double> clearances_;       // in the order of the structures' values
  std::vector<StructureEvents> events_;  // the same
};

}  // namespace osteo
