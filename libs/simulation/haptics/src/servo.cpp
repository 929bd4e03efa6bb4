#include "osteo/simulation/haptics/servo.h"

#include <algorithm>

#include "osteo/core/base/error.h"
#include "osteo/core/rt/loop.h"

namespace osteo::inline simulation {

Servo::Servo(HapticRenderer& renderer, std::span<Device* const> devices, Stream& stream, double rate_hz)
    : renderer_(renderer),
      devices_(devices.begin(), devices.end()),
      stream_(stream),
      dt_s_(1 / rate_hz),
      pause_ticks_(static_cast<std::uint64_t>(std::max(1.0, std::round(kStrokePauseS * rate_hz)))) {
  if (devices_.size() != renderer.hands())
    throw Error(ExitCode::usage,
                std::to_string(devices_.size()) + " devices for " + std::to_string(renderer.hands()) + " hands",
                "give the traits of each device in the setup: device, more_devices");
}

Servo::Servo(HapticRenderer& renderer, Device& device, Stream& stream, double rate_hz)
    : Servo(renderer, std::array<Device*, 1>{&device}, stream, rate_hz) {}

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
  if (h->settings != nullptr) renderer_.set(*h->settings);
  renderer_.hold(h->held);
  if (action.is(ActionKind::soft_push)) renderer_.push(action);
  if (action.is(ActionKind::guide)) renderer_.guide(action);
  stream_.publish(action);
  inbox_.store(nullptr, std::memory_order_release);
}

// At the beginning of a tick that is the first after the pause.
void Servo::report_stroke(std::uint64_t tick, bool removes) noexcept {
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

bool Servo::active() const noexcept {
  return std::any_of(devices_.begin(), devices_.end(), [tick = ticks()](const Device* d) { return d->active(tick); });
}

bool Servo::step(std::int64_t lateness_ns) noexcept {
  if (!active()) return false;
  const std::uint64_t tick = ticks();
  const std::int64_t begin = monotonic_ns();
  take_up(tick);
  std::array<DeviceSample, kMaxHands> samples;
  const std::size_t hands = devices_.size();
  for (std::size_t h = 0; h < hands; ++h) samples[h] = devices_[h]->read(tick, dt_s_, force_n_[h]);
  const auto [records, changes] = renderer_.step({samples.data(), hands});
  double removed_mm3 = 0;
  for (std::size_t h = 0; h < hands; ++h) {
    TickRecord& r = records[h];
    r.tick = tick;
    force_n_[h] = from_floats(r.force_n);
    devices_[h]->feel(force_n_[h], renderer_.contact(h).normal, renderer_.stiffness_n_per_mm(h));
    r.lateness_us = static_cast<float>(lateness_ns) / 1000;
    r.work_us = static_cast<float>(monotonic_ns() - begin) / 1000;
    removed_mm3 += static_cast<double>(r.removed_mm3);
  }
  removed_mm3_.store(removed_mm3_.load(std::memory_order_relaxed) + removed_mm3, std::memory_order_relaxed);
  report_stroke(tick, !changes.empty());
  stream_.publish(records, changes);
  ticks_.store(tick + 1, std::memory_order_relaxed);
  return true;
}

}  // namespace osteo::inline simulation
