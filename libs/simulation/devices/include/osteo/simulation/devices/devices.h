// Hardware in front of the servo.
#pragma once
#include <atomic>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "osteo/core/rt/seqlock.h"
#include "osteo/simulation/devices/detail/hid_link.h"
#include "osteo/simulation/devices/detail/woodenhaptics.h"
#include "osteo/simulation/haptics/device.h"

namespace osteo::inline simulation {

/// From the device's workspace to the scene: scene = place + rotation * scale * (device - anchor). Holding the clutch
/// moves the device alone.
class WorkspaceMap {
 public:
  /// `rotation`: columns are the device's axes in the scene. `scale` > 0: scene mm a device mm.
  WorkspaceMap(Vec3 place_mm, const Mat3& rotation, double scale)
      : place_mm_(place_mm), rotation_(rotation), scale_(scale) {}
  /// From the next tick on, which begins where the tool is. `share` > 0: of the scale it was made with.
  void rescale(double share) noexcept {
    if (share == share_) return;
    share_ = share;
    rescaled_ = true;
  }
  /// One tick; no allocation.
  Vec3 update(Vec3 device_mm, bool clutch) noexcept {
    if (!started_ || clutch || rescaled_) {
      if (started_) place_mm_ = last_scene_mm_;
      anchor_mm_ = device_mm;
      started_ = true;
      rescaled_ = false;
    }
    return last_scene_mm_ = place_mm_ + rotation_ * ((device_mm - anchor_mm_) * scale());
  }
  [[nodiscard]] Vec3 last_mm() const { return started_ ? last_scene_mm_ : place_mm_; }
  [[nodiscard]] Vec3 direction(Vec3 device) const { return rotation_ * device; }
  /// A force of the scene, for the device's motors.
  [[nodiscard]] Vec3 to_device(Vec3 scene_n) const { return transposed(rotation_) * scene_n; }
  [[nodiscard]] double scale() const { return scale_ * share_; }

 private:
  Vec3 place_mm_, anchor_mm_, last_scene_mm_;
  Mat3 rotation_;
  double scale_, share_ = 1;
  bool started_ = false, rescaled_ = false;
};

/// A force that goes on by itself for a while: what the servo last said, with the plane of contact beside it, so that a
/// late servo is bridged.
struct ForcePlane {
  Vec3 force_n, position_mm, normal;  ///< in the device's frame; of the servo's tick
  double stiffness_n_per_mm = 0;
  std::int64_t time_ns = 0;
};
/// Up to `hold_ms` after the tick the contact is the plane, so that the force follows the hand; then it fades to
/// nothing within `fade_ms`. Never more than twice the last force plus half a newton.
[[nodiscard]] Vec3 extrapolate(const ForcePlane& plane, Vec3 position_mm, std::int64_t now_ns, double hold_ms = 5,
                               double fade_ms = 20) noexcept;

/// A pedal's state, read by its own thread.
class FootPedal final : HidHandler {
 public:
  explicit FootPedal(DeviceModel model, HidLink::Open open) : model_(model), link_(std::move(open), *this, 100) {}
  /// Which of its switches are down, and count.
  [[nodiscard]] std::uint32_t pressed() const noexcept {
    const std::uint64_t s = state_;
    return static_cast<std::uint32_t>(s) & ~static_cast<std::uint32_t>(s >> 32);
  }
  /// While it is on no switch counts; after that those that were down count once they have come up. From any one
  /// thread.
  void hold_back(bool on) noexcept {
    if (on == held_back_) return;
    held_back_ = on;
    change([on](std::uint32_t down, std::uint32_t) { return std::pair(down, on ? ~0U : down); });
  }
  /// Those that are down now or were since this was last asked: who looks seldom misses no short press. From any one
  /// thread.
  [[nodiscard]] std::uint32_t pressed_since() noexcept { return pressed() | since_.exchange(0); }
  [[nodiscard]] bool connected() const noexcept { return link_.connected(); }
  [[nodiscard]] std::string trouble() const { return link_.trouble(); }

 private:
  void report(HidPort&, std::span<const std::byte> report) override {
    std::uint32_t pressed = 0;
    if (decode_pedal(model_, report, pressed)) set(pressed);
  }
  void gone() override { set(0); }  // an unplugged pedal is not pressed
  void set(std::uint32_t pressed) noexcept {
    change([&](std::uint32_t, std::uint32_t back) { return std::pair(pressed, back == ~0U ? back : back & pressed); });
    since_ |= this->pressed();
  }
  template <class F>
  void change(F&& f) noexcept {
    std::uint64_t s = state_;
    for (;;) {
      const auto [down, back] = f(static_cast<std::uint32_t>(s), static_cast<std::uint32_t>(s >> 32));
      if (state_.compare_exchange_weak(s, static_cast<std::uint64_t>(back) << 32 | down)) return;
    }
  }
  DeviceModel model_;
  bool held_back_ = false;
  std::atomic<std::uint64_t> state_{0};  // what is down, and above it what does not count
  std::atomic<std::uint32_t> since_{0};
  HidLink link_;
};

/// Of the device, or of the pedal beside it (may be null).
[[nodiscard]] inline std::string trouble_of(const HidLink& link, const FootPedal* pedal) {
  std::string text = link.trouble();
  return text.empty() && pedal != nullptr ? pedal->trouble() : text;
}

/// Which of a pedal's switches press a device's own: the left one hand 0, the right one hand 1.
[[nodiscard]] constexpr std::uint32_t pedal_bit(std::size_t hand) {
  return hand == 0 ? 1U : 4U;
}

/// How a device's own hand is, in its own right, up and towards the user.
struct DeviceMotion {
  std::optional<Vec3> hand_mm, axis;  ///< of an arm that has been heard of: place; handle, unit
  std::optional<Vec3> push;           ///< of a cap: deflection, 0 to 1
  Vec3 turn;                          ///< its twist, right-handed
};

/// A device whose hand can be lent to the camera: meanwhile its samples rest where they are, the pedal up, and motors
/// rest. From any thread.
class LendsHand {
 public:
  virtual ~LendsHand() = default;
  void lend(bool on) noexcept { lent_ = on; }
  [[nodiscard]] virtual DeviceMotion motion() const noexcept = 0;

 protected:
  std::atomic<bool> lent_{false};
};

/// A device whose hand works on its tool as the person wants it: scale, clutch, what drills.
class TunedHand {
 public:
  explicit TunedHand(std::size_t hand) { own_.drill_switches = pedal_bit(hand); }
  /// From any one thread.
  void tune(const HandTuning& tuning) noexcept { given_.store({tuning, true}); }

 protected:
  ~TunedHand() = default;
  /// As it is now; the servo's.
  const HandTuning& tuning() noexcept {
    if (Given now; given_.try_load(now) && now.any) own_ = now.tuning;
    return own_;
  }
  /// What its own button and a pedal's switches press, with the window's keys.
  [[nodiscard]] static std::uint8_t pedal_of(const HandTuning& t, std::uint32_t buttons,
                                             std::uint32_t switches) noexcept {
    const bool own = (buttons & t.drill_buttons) != 0 || (switches & t.drill_switches) != 0;
    return own ? std::max(t.full, t.pedal) : t.pedal;
  }

 private:
  struct Given {
    HandTuning tuning;
    bool any = false;
  };
  Seqlock<Given> given_;
  HandTuning own_;
};

/// A SpaceMouse that is not the drill: of its own thread.
class CameraPuck final : HidHandler {
 public:
  explicit CameraPuck(HidLink::Open open) : link_(std::move(open), *this, 100) {}
  [[nodiscard]] DeviceMotion motion() const noexcept;

 private:
  void report(HidPort&, std::span<const std::byte> report) override {
    if (decode_space_mouse(report, own_)) shared_.store(own_);
  }
  void gone() override { shared_.store(own_ = {}); }
  SpaceMouseState own_;
  Seqlock<SpaceMouseState> shared_;
  HidLink link_;
};

/// Isometric: the cap's deflection is a velocity, of the goal of a spring hand. Button 1 presses the pedal; so does a
/// real one, by its switch pedal_bit(); unless tuned otherwise.
class SpaceMouseDevice final : public Device, public LendsHand, public TunedHand, HidHandler {
 public:
  /// `rotation`: columns are the desk's right, away and up in the scene. Full deflection moves 60 mm/s and turns 1.5
  /// rad/s.
  SpaceMouseDevice(HidLink::Open open, const HandGoal& start, const Mat3& rotation, const FootPedal* pedal,
                   std::size_t hand = 0);
  DeviceSample read(std::uint64_t tick, double dt_s, Vec3 force_n) noexcept override;
  void set_tool(std::uint8_t tool) noexcept override { tool_ = tool; }
  bool lead(const HandWay& way) noexcept override {
    hand_.lead(way);
    return true;
  }
  Led led() noexcept override { return hand_.led(); }
  [[nodiscard]] DeviceTraits traits() const override { return SpringHand::traits(); }
  [[nodiscard]] DeviceMotion motion() const noexcept override;
  [[nodiscard]] bool connected() const noexcept { return link_.connected(); }
  [[nodiscard]] std::string trouble() const override { return trouble_of(link_, pedal_); }

 private:
  void report(HidPort& port, std::span<const std::byte> report) override;
  void gone() override;
  struct Shared {
    SpaceMouseState state;
    std::int64_t time_ns = 0;
  };
  Seqlock<Shared> shared_;
  Shared own_, last_;
  HandGoal goal_;
  std::atomic<std::uint8_t> tool_;
  GuidedHand hand_;
  Mat3 rotation_;
  const FootPedal* pedal_;
  HidLink link_;
};

/// Pose and force by a WoodenHaptics or Polhem. The link's thread answers each report with motor currents for the
/// latest force, bridged by its plane of contact when the servo is late; the servo reads the latest pose. Motors rest
/// until the servo speaks, and when it falls silent. Its button or pedal_bit() of a pedal is the pedal, bit 1 the
/// clutch of every arm; unless tuned otherwise.
class WoodenHapticsDevice final : public Device, public LendsHand, public TunedHand, HidHandler {
 public:
  WoodenHapticsDevice(HidLink::Open open, const WoodenHapticsGeometry& geometry, const WorkspaceMap& map, int tool,
                      const FootPedal* pedal, std::size_t hand = 0);
  DeviceSample read(std::uint64_t tick, double dt_s, Vec3 force_n) noexcept override;
  void set_tool(std::uint8_t tool) noexcept override { tool_ = tool; }
  void feel(Vec3 force_n, Vec3 normal, double stiffness_n_per_mm) noexcept override;
  [[nodiscard]] DeviceTraits traits() const override;
  [[nodiscard]] bool has_motors() const override { return true; }
  [[nodiscard]] DeviceMotion motion() const noexcept override;
  [[nodiscard]] bool connected() const noexcept { return link_.connected(); }
  [[nodiscard]] std::string trouble() const override { return trouble_of(link_, pedal_); }
  /// Reports too short to be one; they are passed over.
  [[nodiscard]] std::uint64_t garbled() const noexcept { return garbled_; }

 private:
  void opened(HidPort& port) override;
  void report(HidPort& port, std::span<const std::byte> report) override;
  void idle(HidPort& port) override;
  void gone() override;
  [[nodiscard]] bool newest_only() const override { return true; }
  bool send(HidPort& port, std::array<double, 3> current_ma);

  struct Pose {
    Vec3 position_mm, axis;
    bool button = false;
    std::int64_t time_ns = 0;
  };
  WoodenHapticsGeometry geometry_;
  WoodenHapticsKinematics kinematics_;
  WorkspaceMap map_;
  std::atomic<std::uint8_t> tool_;
  const FootPedal* pedal_;
  Seqlock<Pose> pose_;
  Seqlock<ForcePlane> force_;
  Pose last_pose_;      // of the servo
  bool silent_ = true;  // the next pose takes hold where the tool is
  Pose newest_;         // of the link
  Vec3 newest_angles_rad_;
  std::int64_t last_write_ns_ = 0;
  std::atomic<std::uint64_t> garbled_{0};
  HidLink link_;  // last: its thread uses all the others
};

/// What is plugged in, for people and for --json.
struct FoundDevice {
  HidInfo info;
  DeviceModel model = DeviceModel::unknown;
  bool readable = false;
  std::string why;  ///< when it is not
};
/// Devices known here, each opened for a moment.
[[nodiscard]] std::vector<FoundDevice> find_devices();

}  // namespace osteo::inline simulation
