#include "osteo/haptics/servo.h"

#include "osteo/rt/loop.h"

namespace osteo {

bool Servo::step(std::int64_t lateness_ns) noexcept {
  if (!device_.active(tick_)) return false;
  const std::int64_t begin = monotonic_ns();
  TickRecord record;
  record.tick = tick_;
  record.device = device_.read(tick_, dt_s_, force_n_);
  const ContactResult contact = model_.contact(bone_, record.device);
  force_n_ = contact.force_n;
  record.force_n = {static_cast<float>(force_n_.x), static_cast<float>(force_n_.y), static_cast<float>(force_n_.z)};
  record.depth_mm = static_cast<float>(contact.depth_mm);
  record.immersed_samples = contact.immersed;
  double removed_mm3 = 0;
  std::span<const VoxelChange> changes;
  if (record.device.drill_on != 0) changes = model_.remove(bone_, dt_s_, removed_mm3);
  record.removed_mm3 = static_cast<float>(removed_mm3);
  record.voxels_changed = static_cast<std::uint32_t>(changes.size());
  record.lateness_us = static_cast<float>(lateness_ns) / 1000;
  record.work_us = static_cast<float>(monotonic_ns() - begin) / 1000;
  stream_.publish(record, changes);
  ++tick_;
  return true;
}

}  // namespace osteo
