#include "osteo/haptics/servo.h"

#include "osteo/rt/loop.h"

namespace osteo {

bool Servo::step(std::int64_t lateness_ns) noexcept {
  if (!device_.active(tick_)) return false;
  const std::int64_t begin = monotonic_ns();
  auto [record, changes] = renderer_.step(bone_, device_.read(tick_, dt_s_, force_n_));
  record.tick = tick_;
  force_n_ = from_floats(record.force_n);
  device_.feel(force_n_, renderer_.contact().normal, renderer_.stiffness_n_per_mm());
  record.lateness_us = static_cast<float>(lateness_ns) / 1000;
  record.work_us = static_cast<float>(monotonic_ns() - begin) / 1000;
  stream_.publish(record, changes);
  ++tick_;
  return true;
}

}  // namespace osteo
