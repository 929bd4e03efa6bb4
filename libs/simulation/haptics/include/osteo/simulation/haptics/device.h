// Devices: where the hand is, and what it feels.
#pragma once
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "osteo/core/rt/seqlock.h"
#include "osteo/simulation/haptics/guard.h"
#include "osteo/simulation/haptics/stream.h"

namespace osteo::inline simulation {

/// A way that a hand takes by itself, the pedal up: straight from point to point, from wherever it is. PathPlanner
/// finds them.
struct HandWay {
  static constexpr std::size_t kMax = 96;
  struct Point {
    Vec3 at_mm;
    std::array<float, 3> axis{0, 0, 1};
    bool near_bone = false;  ///< on the way here bone is near: slowly, and with hardly any pull
  };
  std::array<Point, kMax> points;
  std::uint32_t count = 0;  ///< 0: it only lets go, until bone has pushed it out
  bool put = false;         ///< no free way leads to the first point: the tool is taken away and put there
};

/// How far a way has got.
enum class Led { no, on_the_way, arrived, blocked };

/// Called by the servo only; no allocation, no exception, no wait.
class Device {
 public:
  virtual ~Device() = default;
  /// The pose for this tick. `force_n` is the force of the tick before.
  virtual DeviceSample read(std::uint64_t tick, double dt_s, Vec3 force_n) noexcept = 0;
  /// Another tool is taken up; from any thread. Devices whose samples name their tool themselves ignore it.
  virtual void set_tool(std::uint8_t) noexcept {}
  /// The hand is to go a way by itself; false where it cannot, since a person holds it. From the one thread that also
  /// asks led().
  virtual bool lead(const HandWay&) noexcept { return false; }
  /// Of the last way; `no` where there was none.
  virtual Led led() noexcept { return Led::no; }
  /// The force of this tick and the plane of contact it stems from (normal zero without), for devices that hold it
  /// longer than a tick.
  virtual void feel(Vec3 /*force_n*/, Vec3 /*normal*/, double /*stiffness_n_per_mm*/) noexcept {}
  /// The device that a person holds, where this one only stands before it (LedDevice); else itself.
  [[nodiscard]] virtual Device& held() noexcept { return *this; }
  /// What the guard needs to know of it.
  [[nodiscard]] virtual DeviceTraits traits() const { return {}; }
  /// It pushes the hand, so its loop can be measured (measure_device). Only then.
  [[nodiscard]] virtual bool has_motors() const { return false; }
  /// What went wrong in threads of its own, in words; empty: nothing. From any thread.
  [[nodiscard]] virtual std::string trouble() const { return {}; }
  /// False when the device has no more to say (end of a script).
  [[nodiscard]] virtual bool active(std::uint64_t) const noexcept { return true; }
};

/// Where the hand wants the tip of its instrument to be.
struct HandGoal {
  Vec3 position_mm{};
  std::array<float, 3> axis{0, 0, 1};
  std::uint8_t pedal = 0;  ///< as DeviceSample::pedal
  std::uint8_t tool = 0;
};

/// A hand that holds the drill on a damped spring to its goal, so that a mouse or a script rests on bone instead of
/// passing through it: mass 0.15 kg, 0.8 N/mm, critically damped, at most 6 N. Semi-implicit Euler.
class SpringHand {
 public:
  static DeviceTraits traits() { return {.damping_n_s_per_m = 21, .delay_s = 0, .encoder_mm = 0, .max_force_n = 100}; }
  /// Moves on by dt; the first call starts at the goal.
  DeviceSample step(const HandGoal& goal, double dt_s, Vec3 force_n) noexcept;
  [[nodiscard]] Vec3 position_mm() const { return position_mm_; }
  /// At rest, there, from the next step on.
  void put(Vec3 at_mm) noexcept;
  /// The same, unless it has started.
  void start(Vec3 at_mm) noexcept {
    if (!started_) put(at_mm);
  }

 private:
  bool started_ = false;
  Vec3 position_mm_, velocity_mm_s_;
};

/// A spring hand that can be led along a way: its goal goes ahead by no more than pulls gently, and waits where the
/// hand cannot follow. Near bone 30 mm/s and 0.8 mm ahead (0.64 N), else 200 mm/s. Without headway for a second the way
/// is given up, where the hand is.
class GuidedHand {
 public:
  /// From one other thread, which also asks led().
  void lead(const HandWay& way) noexcept;
  [[nodiscard]] Led led() const noexcept;
  /// The servo's: moves on by dt, along the way or to the goal. While it is led `goal` becomes the way's, and stays so
  /// at its end.
  DeviceSample step(HandGoal& goal, double dt_s, Vec3 force_n) noexcept;
  /// How many ways have come to an end.
  [[nodiscard]] std::uint32_t ended() const noexcept { return ended_.load(std::memory_order_acquire) >> 1; }
  [[nodiscard]] bool leading() const noexcept { return leading_; }  ///< the servo's

 private:
  void begin(const HandGoal& goal) noexcept;
  void end(bool blocked) noexcept;
  struct Numbered {
    HandWay way;
    std::uint32_t number = 0;
  };
  Seqlock<Numbered> given_way_;
  std::atomic<std::uint32_t> given_{0}, ended_{0};  // number of ways; ended: shifted by one, the last bit says blocked
  Numbered now_;
  bool leading_ = false;
  std::uint32_t leg_ = 0;
  double share_ = 0, waited_s_ = 0, quiet_s_ = 0;
  Vec3 from_mm_, from_axis_;
  SpringHand hand_;
};

/// The goal is set by another thread (the window), as seldom as it likes: the hand follows on its spring and turns the
/// axis to the goal's at 4 rad/s.
class MouseDevice final : public Device {
 public:
  /// The first tick is there.
  explicit MouseDevice(const HandGoal& start) : last_{start, 0}, held_(start) { goal_.store(last_); }
  /// While a way is under way it is not heard, nor after that until led() has told of its end.
  void set_goal(const HandGoal& goal) noexcept { goal_.store({goal, seen_}); }
  DeviceSample read(std::uint64_t tick, double dt_s, Vec3 force_n) noexcept override;
  bool lead(const HandWay& way) noexcept override;
  Led led() noexcept override;
  [[nodiscard]] DeviceTraits traits() const override { return SpringHand::traits(); }

 private:
  struct Sent {
    HandGoal goal;
    std::uint32_t ways = 0;  // of whose end its sender knew
  };
  Seqlock<Sent> goal_;
  Sent last_;
  HandGoal held_;
  GuidedHand hand_;
  std::uint32_t seen_ = 0;  // the window's
};

/// What a scripted hand does: straight moves between points in time.
struct Strokes {
  struct Waypoint {
    double t_s = 0;
    Vec3 at_mm;
    bool drill_on = false;
    double pedal = 1;  ///< how far down while it is on, 0 to 1
  };
  int tool = 3;  ///< index in instrument_library()
  Vec3 axis{0, 0, 1};
  std::vector<Waypoint> waypoints;  ///< at least one, times rising
};

/// Follows strokes by tick number, not by wall clock: the same ticks on every run. Behind the last waypoint the hand
/// rests there, the pedal up; it is active until then, and until `end_tick` where that is later.
class ScriptedDevice final : public Device {
 public:
  ScriptedDevice(Strokes strokes, double rate_hz, std::uint64_t end_tick = 0)
      : strokes_(std::move(strokes)), rate_hz_(rate_hz), end_tick_(end_tick) {}
  DeviceSample read(std::uint64_t tick, double dt_s, Vec3 force_n) noexcept override;
  [[nodiscard]] DeviceTraits traits() const override { return SpringHand::traits(); }
  [[nodiscard]] bool active(std::uint64_t tick) const noexcept override {
    return static_cast<double>(tick) / rate_hz_ < strokes_.waypoints.back().t_s || tick < end_tick_;
  }

 private:
  Strokes strokes_;
  double rate_hz_;
  std::uint64_t end_tick_;
  std::size_t leg_ = 0;
  SpringHand hand_;
};

/// Repeats recorded samples.
class ReplayDevice final : public Device {
 public:
  explicit ReplayDevice(std::vector<DeviceSample> samples) : samples_(std::move(samples)) {}
  DeviceSample read(std::uint64_t tick, double, Vec3) noexcept override { return samples_[tick]; }
  [[nodiscard]] bool active(std::uint64_t tick) const noexcept override { return tick < samples_.size(); }

 private:
  std::vector<DeviceSample> samples_;
};

/// How a device's hand works on its tool, as the person wants it now. For a device that moves by itself; what it says
/// goes into the stream as the device's samples, so a replay knows nothing of this.
struct HandTuning {
  double scale = 1;                   ///< mm of the tool for a mm of the hand; 0 < scale <= 1
  bool clutch = false;                ///< the hand moves without its tool
  std::uint8_t pedal = 0;             ///< what keys and buttons of the window press, 0 to 255
  std::uint8_t full = 255;            ///< what a switch of its own presses: the burr's speed
  std::uint32_t drill_buttons = 1;    ///< of the device: which of them press
  std::uint32_t drill_switches = 1;   ///< of the foot pedal beside it
  std::uint32_t clutch_switches = 2;  ///< and which of them are the clutch
};

}  // namespace osteo::inline simulation
