// What one hand feels and what its burr takes away.
#pragma once
#include "contact_models.h"
#include "osteo/simulation/haptics/detail/held_shaft.h"
#include "osteo/simulation/haptics/guide.h"
#include "osteo/simulation/haptics/renderer.h"
#include "osteo/simulation/haptics/saw_slot.h"
#include "osteo/simulation/haptics/texture.h"

namespace osteo::inline simulation {

/// What all hands go by.
struct HapticRenderer::Common {
  HapticsParams params;
  std::vector<ContactMethod> method_of_tool;
  double dt_s = 1e-3, up_share = 1, down_share = 1;  // of the way to the pedal's speed, in a tick
  HapticScene* scene = nullptr;
  bool held = false;
};

class HandRenderer {
 public:
  HandRenderer(const HapticRenderer::Common& common, const HapticSetup& setup, std::size_t number, const Curve* curve);

  /// The settings have changed.
  void set() noexcept;
  void push(const SceneAction& soft_push) noexcept;
  void guide(const HandGuide& guide) noexcept {
    guide_.set(guide, device_, common_.params.guard.contact_damping_n_s_per_m, common_.dt_s);
  }
  [[nodiscard]] const HandGuide& guided() const { return guide_.guide(); }
  /// Whether it leads another in the tick to come, and by whom it is led.
  void leads(bool on) noexcept { leads_ = on; }
  void led(const DeviceSample& leader, Vec3 force_n) noexcept {
    leader_ = leader;
    leader_force_n_ = force_n;
  }
  /// From a pose to a force, on the bone as it is.
  void feel(const DeviceSample& sample) noexcept;
  /// Writes behind the first `count` changes of the scene, and counts on.
  void remove(std::size_t& count) noexcept;
  /// After feel() and remove(): all but tick number and machine times.
  [[nodiscard]] const TickRecord& finish() noexcept;

  [[nodiscard]] const ContactResult& contact() const { return contact_; }
  [[nodiscard]] double stiffness_n_per_mm() const { return law_.stiffness_n_per_mm; }
  [[nodiscard]] bool cuts() const { return cuts_; }
  /// Its instrument's head can touch something: where it is shown.
  [[nodiscard]] bool has_head() const { return usable_ && !resting_ && !plate(); }
  [[nodiscard]] const RoundCone& head() const { return instrument_->head; }
  [[nodiscard]] Vec3 shown_mm() const { return at_ + contact_.shown_offset_mm; }
  [[nodiscard]] Vec3 axis() const { return axis_; }
  [[nodiscard]] TickRecord& record() { return record_; }
  void flag(std::uint32_t flags) { flags_ |= flags; }

 private:
  struct Touch {
    HapticScene::Item* item = nullptr;
    ContactModel* model = nullptr;
    ContactResult contact;  // in the world
  };
  [[nodiscard]] const PlateInHand* plate() const { return common_.scene->held[number_].plate.get(); }
  void rest(const DeviceSample& sample) noexcept;
  void place(const DeviceSample& sample, Guard::Input& in) noexcept;
  void spin(std::uint8_t pedal) noexcept;
  void meet() noexcept;
  void touch() noexcept;
  void combine() noexcept;
  void escape() noexcept;
  void hold_shaft(Vec3& elastic, Vec3& torque) noexcept;
  void press_shaft(Vec3& elastic, Vec3& torque) noexcept;
  [[nodiscard]] Vec3 effects() noexcept;
  [[nodiscard]] double thickness() const noexcept;

  const HapticRenderer::Common& common_;
  const std::size_t number_;
  const DeviceTraits device_;
  ContactParams law_;  // with the stiffness that its device bears
  Vibration vibration_;
  std::optional<SlidingTexture> texture_;
  std::optional<CurveConstraint> constraint_;
  Guard guard_;
  struct {
    Vec3 at_mm, normal;
    double force_n = 0, stiffness_n_per_mm = 0;
  } soft_;
  GuideLaw guide_;
  SawSlot slot_;
  HeldShaft shaft_;
  DeviceSample leader_;
  Vec3 leader_force_n_;
  bool leads_ = false, resting_ = false;
  // What it remembers of the tick before.
  DeviceSample last_good_;
  bool has_last_ = false;
  std::uint8_t last_tool_ = 0;
  double speed_rpm_ = 0;
  // Of this tick.
  DeviceSample pose_;
  const Instrument* instrument_ = nullptr;
  Vec3 hand_at_;    // where the hand has the tool
  Vec3 at_, axis_;  // where the tool is: elsewhere in a cutting guide, and where bone holds its shaft
  bool usable_ = false, cuts_ = false;
  std::uint32_t flags_ = 0;
  std::array<Touch, HapticRenderer::kMaxTouched> touched_;
  std::size_t touched_count_ = 0;
  const HapticScene::Item* loaded_ = nullptr;  // that the tool presses on most
  ContactResult contact_;
  Vec3 drag_n_;  // of the teeth, before limits
  TickRecord record_;
};

}  // namespace osteo::inline simulation
