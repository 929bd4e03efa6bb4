// The servo: the only writer of the live bone. One step a tick, the same for a device, a script and a replay.
#pragma once
#include "osteo/haptics/device.h"
#include "osteo/haptics/renderer.h"
#include "osteo/haptics/stream.h"

namespace osteo {

class Servo {
 public:
  /// All must outlive the servo. `rate_hz` fixes the time step, whatever the clock does.
  Servo(BrickGrid& bone, HapticRenderer& renderer, Device& device, Stream& stream, double rate_hz)
      : bone_(bone), renderer_(renderer), device_(device), stream_(stream), dt_s_(1 / rate_hz) {}

  /// Read the device, compute the force, remove bone, tell the readers. False when the device has ended.
  bool step(std::int64_t lateness_ns) noexcept;
  [[nodiscard]] std::uint64_t ticks() const { return tick_; }

 private:
  BrickGrid& bone_;
  HapticRenderer& renderer_;
  Device& device_;
  Stream& stream_;
  double dt_s_;
  std::uint64_t tick_ = 0;
  Vec3 force_n_;
};

}  // namespace osteo
