// The servo: the only writer of the live bone. One step a tick, the same for a device, a script and a replay.
#pragma once
#include <algorithm>
#include <atomic>
#include <cmath>

#include "osteo/haptics/device.h"
#include "osteo/haptics/renderer.h"
#include "osteo/haptics/stream.h"

namespace osteo {

/// Something done to the scene, and the scene that follows from it.
struct Handover {
  SceneAction action;            ///< its tick is filled in when it happens
  HapticScene* scene = nullptr;  ///< null: as before. Belongs to whoever posts; lives until another was taken.
  bool held = false;             ///< from now on nothing is removed
};

class Servo {
 public:
  /// All must outlive the servo. `rate_hz` fixes the time step, whatever the clock does.
  Servo(HapticRenderer& renderer, Device& device, Stream& stream, double rate_hz)
      : renderer_(renderer),
        device_(device),
        stream_(stream),
        dt_s_(1 / rate_hz),
        pause_ticks_(static_cast<std::uint64_t>(std::max(1.0, std::round(kStrokePauseS * rate_hz)))) {}

  /// A stroke of the burr ends when it has taken no bone for so long: the drill is off, or away from bone. ActionKind::stroke tells of it.
  static constexpr double kStrokePauseS = 0.3;

  /// Take up what was posted, read the device, compute the force, remove bone, tell the readers. False when the device has ended.
  bool step(std::int64_t lateness_ns) noexcept;
  [[nodiscard]] std::uint64_t ticks() const { return ticks_.load(std::memory_order_relaxed); }
  /// By the burr, in all ticks; whoever reads the stream may have lost some.
  [[nodiscard]] double removed_mm3() const { return removed_mm3_.load(std::memory_order_relaxed); }

  /// From one other thread: happens at the beginning of the next tick. False while one posted before waits still.
  bool post(const Handover* handover) noexcept;
  /// After the last step: what was posted and not taken happens at the tick that did not come, so that the stream tells of it.
  void finish() noexcept;
  /// Nothing posted waits. After a hold was posted: no density will change until something else is.
  [[nodiscard]] bool taken() const noexcept { return inbox_.load(std::memory_order_acquire) == nullptr; }

 private:
  HapticRenderer& renderer_;
  Device& device_;
  Stream& stream_;
  double dt_s_;
  std::atomic<std::uint64_t> ticks_{0};
  std::atomic<double> removed_mm3_{0};
  std::atomic<const Handover*> inbox_{nullptr};
  void take_up(std::uint64_t tick) noexcept;
  void tell_stroke(std::uint64_t tick, bool removes) noexcept;
  Vec3 force_n_;
  std::uint64_t pause_ticks_, last_removal_ = 0;
  bool in_stroke_ = false;
};

}  // namespace osteo
