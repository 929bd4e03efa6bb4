#include "osteo/haptics/servo.h"

#include "osteo/rt/loop.h"

namespace osteo {

bool Servo::post(const Handover* handover) noexcept {
  const Handover* none = nullptr;
  return inbox_.compare_exchange_strong(none, handover, std::memory_order_acq_rel);
}

void Servo::take_up(std::uint64_t tick) noexcept {
  const Handover* const h = inbox_.load(std::memory_order_acquire);
  if (h == nullptr) return;
  SceneAction action = h->action;
  action.tick = tick;
  if (h->scene != nullptr) renderer_.show(h->scene);
  renderer_.hold(h->held);
  if (action.is(ActionKind::soft_push)) renderer_.feel(action);
  stream_.publish(action);
  inbox_.store(nullptr, std::memory_order_release);
}

// At the beginning of a tick that is the first after the pause.
void Servo::tell_stroke(std::uint64_t tick, bool removes) noexcept {
  if (in_stroke_ && tick - last_removal_ > pause_ticks_) {
    SceneAction ended = SceneAction::plain(ActionKind::stroke);
    ended.tick = tick;
    stream_.publish(ended);
    in_stroke_ = false;
  }
  if (!removes) return;
  in_stroke_ = true;
  last_removal_ = tick;
}

void Servo::finish() noexcept {
  take_up(ticks());
}

bool Servo::step(std::int64_t lateness_ns) noexcept {
  const std::uint64_t tick = ticks();
  if (!device_.active(tick)) return false;
  const std::int64_t begin = monotonic_ns();
  take_up(tick);
  auto [record, changes] = renderer_.step(device_.read(tick, dt_s_, force_n_));
  record.tick = tick;
  force_n_ = from_floats(record.force_n);
  device_.feel(force_n_, renderer_.contact().normal, renderer_.stiffness_n_per_mm());
  record.lateness_us = static_cast<float>(lateness_ns) / 1000;
  record.work_us = static_cast<float>(monotonic_ns() - begin) / 1000;
  removed_mm3_.store(removed_mm3() + static_cast<double>(record.removed_mm3), std::memory_order_relaxed);
  tell_stroke(tick, !changes.empty());
  stream_.publish(record, changes);
  ticks_.store(tick + 1, std::memory_order_relaxed);
  return true;
}

}  // namespace osteo
