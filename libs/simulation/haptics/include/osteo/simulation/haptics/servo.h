// The servo: the only writer of the live bone. One step a tick, the same for devices, scripts and replays.
#pragma once
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <span>
#include <vector>

#include "osteo/simulation/haptics/device.h"
#include "osteo/simulation/haptics/renderer.h"
#include "osteo/simulation/haptics/stream.h"

namespace osteo::inline simulation {

/// Something done to the scene, and the scene that follows from it.
struct Handover {
  SceneAction action;            ///< its tick is filled in when it happens
  HapticScene* scene = nullptr;  ///< null: as before. Belongs to whoever posts; lives until another was taken.
  bool held = false;             ///< from now on nothing is removed
  const HapticsParams* settings = nullptr;  ///< null: as before. Belongs to whoever posts, read while it is taken up
};

/// step() runs at 1 kHz in the servo thread and may not allocate, lock, throw, log or block; the same holds for all
/// that it calls. The test robust.no-alloc counts allocations and locks of whole ticks. Only the constructors may
/// allocate.
class Servo {
 public:
  /// All must outlive the servo. As many devices as the renderer has hands, in their order. `rate_hz` fixes the time
  /// step, whatever the clock does. Error(usage) when devices and hands are not as many.
  Servo(HapticRenderer& renderer, std::span<Device* const> devices, Stream& stream, double rate_hz);
  /// Of one hand.
  Servo(HapticRenderer& renderer, Device& device, Stream& stream, double rate_hz);

  /// A stroke of the burr ends when no hand has taken bone for so long: the drill is off, or away from bone.
  /// ActionKind::stroke tells of it.
  static constexpr double kStrokePauseS = 0.3;

  /// Take up what was posted, read the devices, compute the forces, remove bone, tell the readers. False when all
  /// devices have ended.
  bool step(std::int64_t lateness_ns) noexcept;
  [[nodiscard]] std::uint64_t ticks() const { return ticks_.load(std::memory_order_relaxed); }
  /// By burrs, in all ticks; whoever reads the stream may have lost some.
  [[nodiscard]] double removed_mm3() const { return removed_mm3_.load(std::memory_order_relaxed); }
  /// A tick is still to come: some device has more to say.
  [[nodiscard]] bool active() const noexcept;

  /// From one other thread: happens at the beginning of the next tick. False while one posted before waits still.
  bool post(const Handover* handover) noexcept;
  /// After the last step: what was posted and not taken happens at the tick that did not come, so that the stream tells
  /// of it.
  void finish() noexcept;
  /// Nothing posted waits. After a hold was posted: no density will change until something else is.
  [[nodiscard]] bool taken() const noexcept { return inbox_.load(std::memory_order_acquire) == nullptr; }

 private:
  void take_up(std::uint64_t tick) noexcept;

  HapticRenderer& renderer_;
  std::vector<Device*> devices_;
  Stream& stream_;
  double dt_s_;
  std::atomic<std::uint64_t> ticks_{0};
  std::atomic<double> removed_mm3_{0};
  std::atomic<const Handover*> inbox_{nullptr};
  void report_stroke(std::uint64_t tick, bool removes) noexcept;
  std::array<Vec3, kMaxHands> force_n_;
  std::uint64_t pause_ticks_, last_removal_ = 0;
  bool in_stroke_ = false;
};

}  // namespace osteo::inline simulation
