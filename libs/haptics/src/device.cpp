#include "osteo/haptics/device.h"

#include <algorithm>
#include <cmath>

namespace osteo {
namespace {

constexpr double kMassKg = 0.15, kSpringNPerMm = 0.8, kMaxHandN = 6;

}  // namespace

DeviceSample SpringHand::step(const HandGoal& goal, double dt_s, Vec3 force_n) noexcept {
  if (!started_) {
    started_ = true;
    position_mm_ = goal.position_mm;
  }
  const double damping_n_s_per_mm = 2 * std::sqrt(kSpringNPerMm * 1000 * kMassKg) / 1000;
  Vec3 pull = (goal.position_mm - position_mm_) * kSpringNPerMm;
  if (const double n = length(pull); n > kMaxHandN) pull = pull * (kMaxHandN / n);
  Vec3 total = pull + force_n;
  if (!std::isfinite(dot(total, total))) total = {};  // a goal or force that is no number must not lose the hand for good
  total -= velocity_mm_s_ * damping_n_s_per_mm;
  velocity_mm_s_ += total * (1000 * dt_s / kMassKg);
  position_mm_ += velocity_mm_s_ * dt_s;
  DeviceSample sample;
  sample.position_mm = to_floats(position_mm_);
  sample.axis = goal.axis;
  sample.drill_on = goal.drill_on;
  sample.tool = goal.tool;
  return sample;
}

DeviceSample MouseDevice::read(std::uint64_t, double dt_s, Vec3 force_n) noexcept {
  static_cast<void>(goal_.try_load(last_));  // while it is being written, the last one will do
  return hand_.step(last_, dt_s, force_n);
}

DeviceSample ScriptedDevice::read(std::uint64_t tick, double dt_s, Vec3 force_n) noexcept {
  const double t = static_cast<double>(tick) / rate_hz_;
  const auto& w = script_.waypoints;
  while (leg_ + 1 < w.size() && w[leg_ + 1].t_s <= t) ++leg_;
  HandGoal goal;
  goal.tool = static_cast<std::uint8_t>(script_.tool);
  goal.axis = to_floats(script_.axis);
  goal.drill_on = w[leg_].drill_on && leg_ + 1 < w.size() ? 1 : 0;
  goal.position_mm = w[leg_].at_mm;
  if (leg_ + 1 < w.size()) {
    const double s = std::clamp((t - w[leg_].t_s) / (w[leg_ + 1].t_s - w[leg_].t_s), 0.0, 1.0);
    goal.position_mm += (w[leg_ + 1].at_mm - w[leg_].at_mm) * s;
  }
  return hand_.step(goal, dt_s, force_n);
}

}  // namespace osteo
