// Haptic rendering: all that happens to poses between the devices and the hands, but for the devices.
#pragma once
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "osteo/simulation/haptics/curve_constraint.h"
#include "osteo/simulation/haptics/guard.h"
#include "osteo/simulation/haptics/haptic_scene.h"
#include "osteo/simulation/haptics/vibration.h"

namespace osteo::inline simulation {

/// What the hands' instruments did near one structure.
struct StructureEvents {
  double least_clearance_mm = 0;
  std::uint64_t ticks_touched = 0, ticks_injured = 0;
};

class HandRenderer;

/// Poses to forces and removal, for 1 to kMaxHands hands. Owns all buffers but those of the scene. step() neither
/// allocates nor locks nor throws, and the same sequence of samples, settings and scenes gives the same bits. In a tick
/// all hands feel the bone as it was at its beginning, each by itself; then burrs take bone away in the order of the
/// hands. The tool is where its shaft can be (HeldShaft). The force: contact of the head by the chosen method, pull of
/// the shaft, both elastic and watched by the observer; drag of the teeth, along normal x axis (D. Morris 2006,
/// section 3.2.3.7: summed over a ball it is that cross product) and vibration, both motor-driven and in proportion to
/// the burr's speed (drag no more than at Burr::kNominalRpm); a curve's pull. With a plate in the hand, its contact
/// alone. Then the limits of Guard. The burr's speed follows speed_rpm * pedal / 255 as a first-order lag, spin_up_s
/// upwards and spin_down_s downwards, and is there within 60 rpm. It removes, drags and shakes as long as it turns.
/// Another instrument taken up stands still. A saw in a cutting guide (HapticScene::guides) touches, cuts and injures
/// where the guide has it, which shown_offset_mm tells (SawSlot). Several bodies: what the burr overlaps in each is
/// added up before the law of force is applied, so that a cut through bone that nobody has opened cannot be felt (other
/// methods than overlap: forces are added). At most kMaxTouched bodies in a tick, the first in order.
///
/// All that is noexcept here runs at 1 kHz in the servo thread and may not allocate, lock, throw, log or block; the
/// test robust.no-alloc counts allocations and locks. Only the constructors and structure_events() may allocate.
class HapticRenderer {
 public:
  static constexpr std::size_t kMaxTouched = 4;

  /// What the scene knows of the patient besides bone may be null. Errors: usage, when the vibration's text is not
  /// valid or there are too many hands.
  HapticRenderer(const HapticSetup& setup, const Anatomy& anatomy, double dt_s);
  /// For one bone that stays where it is, and that must outlive this.
  HapticRenderer(const HapticSetup& setup, BrickGrid& bone, const Anatomy& anatomy, double dt_s);
  ~HapticRenderer();

  /// From the next step on. The scene belongs to the caller and must live until another is shown; it was made with the
  /// setup in force, or with what set() is given. No allocation.
  void show(HapticScene* scene) noexcept;
  /// What soft tissue pushes a hand's tool with from now on (ActionKind::soft_push): a plane near the tool, made by
  /// whoever moves the tissue, felt at full rate. Of a hand that is not there: nothing.
  void push(const SceneAction& soft_push) noexcept;
  /// A hand is led by another from now on (ActionKind::guide), by GuideLaw; of the leader's force what it was in the
  /// tick before. The hand that leads says in its samples how much (LeadBits). Of hands that are not there: nothing.
  /// Nobody led costs a comparison a tick.
  void guide(const SceneAction& action) noexcept;
  /// Nothing is removed while held.
  void hold(bool on) noexcept;
  /// Other settings from the next step on, made safe as at the start. No allocation.
  void set(const HapticsParams& params) noexcept;

  struct Step {
    std::span<TickRecord> hands;  ///< in their order; all but tick number and machine times; valid until the next step
    std::span<const VoxelChange> changes;  ///< in the same order; valid until the next step
  };
  /// One sample for each hand.
  Step step(std::span<const DeviceSample> samples) noexcept;
  struct HandStep {
    TickRecord record;
    std::span<const VoxelChange> changes;
  };
  /// For one hand.
  HandStep step(const DeviceSample& sample) noexcept;

  [[nodiscard]] std::size_t hands() const { return hands_.size(); }
  /// Of the last step, before limits.
  [[nodiscard]] const ContactResult& contact(std::size_t hand = 0) const;
  /// By value in the label map: of every structure that ever was within reach, whichever was the nearest. What a record
  /// tells is the nearest alone. A tick in which two hands touch counts once. Follows from samples and scenes, so a
  /// replay gets the same. Not while another thread steps.
  [[nodiscard]] std::map<std::uint32_t, StructureEvents> structure_events() const;
  /// What a hand really gets: the asked one, or less for the sake of stability.
  [[nodiscard]] double stiffness_n_per_mm(std::size_t hand = 0) const;
  /// As it was asked for at the start; scenes are made with it.
  [[nodiscard]] const HapticSetup& setup() const { return setup_; }

 private:
  struct Common;
  void watch(HandRenderer& hand) noexcept;
  void lead(std::span<const DeviceSample> samples) noexcept;

  const HapticSetup setup_;
  Anatomy anatomy_;
  HapticScene own_;  // where it was made for one bone
  std::unique_ptr<Common> common_;
  std::optional<Curve> curve_;
  std::vector<std::unique_ptr<HandRenderer>> hands_;
  std::vector<TickRecord> records_;
  std::vector<double> clearances_;       // in the order of the structures' values
  std::vector<std::uint8_t> met_;        // of each structure in this tick: 1 touched, 2 injured
  std::vector<StructureEvents> events_;  // the same
  bool any_led_ = false;
  friend class HandRenderer;
};

}  // namespace osteo::inline simulation
