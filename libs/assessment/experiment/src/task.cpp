#include "osteo/assessment/experiment/task.h"

#include <algorithm>
#include <cmath>

namespace osteo::inline assessment::experiment {
namespace {
constexpr double kVelocityS = 0.002;  // over which velocities are smoothed
constexpr double kJumpMm = 20;        // in a tick: no hand moves so fast
}  // namespace

TaskGains safe_gains(const TaskGains& wanted, const DeviceTraits& device, double rate_hz) {
  TaskGains g = wanted;
  const double tick_s = 1 / rate_hz;
  // kg / s is N s / m.
  const double damping = 0.5 * g.moving_mass_kg / (tick_s + kVelocityS + device.delay_s) / 1000;
  g.path_n_s_per_mm = std::min(g.path_n_s_per_mm, damping);
  g.plane_n_s_per_mm = std::min(g.plane_n_s_per_mm, damping);
  g.path_n_per_mm = std::min(g.path_n_per_mm, safe_stiffness_n_per_mm(device, 1000 * g.path_n_s_per_mm, tick_s));
  g.plane_n_per_mm = std::min(g.plane_n_per_mm, safe_stiffness_n_per_mm(device, 1000 * g.plane_n_s_per_mm, tick_s));
  return g;
}

GuardParams task_guard(double limit_n) {
  GuardParams p;
  p.max_force_n = limit_n;
  p.passivity = false;
  p.contact_damping_n_s_per_m = 0;
  return p;
}

ForceTask::ForceTask(const Stimulus& stimulus, const Trial& trial, RunKind kind, const TaskGains& gains,
                     const DeviceTraits& device, double limit_n, double lead_s)
    : stimulus_(&stimulus),
      trial_(trial),
      kind_(kind),
      gains_(safe_gains(gains, device, stimulus.rate_hz)),
      dt_s_(1 / stimulus.rate_hz),
      lead_(static_cast<std::uint64_t>(std::lround(std::max(0.0, lead_s) * stimulus.rate_hz))),
      limit_n_(device.max_force_n > 0 ? std::min(limit_n, device.max_force_n) : limit_n),
      guard_(task_guard(limit_n), device) {}

TickRecord ForceTask::step(std::uint64_t tick, const DeviceSample& sample) noexcept {
  const Vec3 said{sample.position_mm[0], sample.position_mm[1], sample.position_mm[2]};
  const bool known = std::isfinite(dot(said, said));
  const Vec3 hand = known ? said : last_mm_;
  if (!from_mm_) from_mm_ = last_mm_ = hand;
  const bool jumped = !known || length(hand - last_mm_) > kJumpMm;
  if (jumped) last_mm_ = hand;
  const double blend = dt_s_ / (dt_s_ + kVelocityS);
  velocity_ += ((hand - last_mm_) / dt_s_ - velocity_) * blend;
  last_mm_ = hand;
  const std::size_t last = stimulus_->force_n.size() - 1;
  const bool leading = tick < lead_;
  const std::size_t i = leading ? 0 : std::min(last, static_cast<std::size_t>(tick - lead_));
  Vec3 goal{stimulus_->x_mm[i], 0, stimulus_->z_mm[i]}, goal_velocity;
  if (leading) {
    // To the beginning without a jerk.
    const double u = static_cast<double>(tick) / static_cast<double>(lead_), s = u * u * (3 - 2 * u);
    goal = {from_mm_->x + s * (goal.x - from_mm_->x), 0, from_mm_->z + s * (goal.z - from_mm_->z)};
  } else if (i < last) {
    goal_velocity = {stimulus_->vx_mm_s[i], 0, stimulus_->vz_mm_s[i]};
  }
  Vec3 force{gains_.path_n_per_mm * (goal.x - hand.x) + gains_.path_n_s_per_mm * (goal_velocity.x - velocity_.x), 0,
             gains_.path_n_per_mm * (goal.z - hand.z) + gains_.path_n_s_per_mm * (goal_velocity.z - velocity_.z)};
  const double target = leading ? 0 : stimulus_->force_n[i];
  const bool pushed = kind_ == RunKind::training && trial_.training == Training::haptic;
  // Pushed upwards by what is to be learned, or held in the plane by as much as the hand presses.
  const double plane = -gains_.plane_n_per_mm * hand.y - gains_.plane_n_s_per_mm * velocity_.y;
  force.y = pushed && !leading ? trial_.aid * target : plane;
  // At its limit the device lets the hand sink rather than leave the path: what is left beside the path's pull is the
  // plane's.
  const double limit = limit_n_, along = std::sqrt(force.x * force.x + force.z * force.z);
  bool capped = false;
  if (const double left = std::sqrt(std::max(0.0, limit * limit - along * along));
      along < limit && std::abs(force.y) > left) {
    force.y = force.y > 0 ? left : -left;
    capped = true;
  }
  Guard::Input in;
  in.position_mm = hand;
  in.effects_n = force;
  in.age_ms = sample.age_ms;
  in.jumped = jumped;
  const Guard::Output out = guard_.limit(in, dt_s_);
  TickRecord r;
  r.tick = tick;
  r.device = sample;
  r.force_n = to_floats(out.force_n);
  r.normal_force_n = static_cast<float>(pushed && !leading ? 0 : out.force_n.y);
  r.depth_mm = static_cast<float>(-hand.y);
  r.flags = out.flags | (capped ? kForceCapped : 0U);
  view_.t_s = (static_cast<double>(tick) - static_cast<double>(lead_)) * dt_s_;
  view_.hand_mm = hand;
  view_.path_x_mm = goal.x;
  view_.path_z_mm = goal.z;
  view_.target_n = target;
  view_.applied_n = r.normal_force_n;
  view_.saturated = (r.flags & kForceCapped) != 0;
  view_.done = tick + 1 >= ticks();
  return r;
}

}  // namespace osteo::inline assessment::experiment
