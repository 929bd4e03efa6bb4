#include "osteo/simulation/haptics/device.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/portable_math.h"
#include "osteo/simulation/haptics/guide.h"

namespace osteo::inline simulation {
namespace {

constexpr double kMassKg = 0.15, kSpringNPerMm = 0.8, kMaxHandN = 6;

// Of a hand that is led: near bone a pull of 0.64 N at most, less where it touches.
constexpr double kNearMmPerS = 30, kFreeMmPerS = 200, kRadPerS = 4;
constexpr double kNearAheadMm = 0.8, kFreeAheadMm = 8, kTouchN = 0.1, kTouchAheadMm = 0.6;
constexpr double kThereMm = 0.3, kPatienceS = 1, kQuietS = 0.03;

// From one direction (a unit) towards another, by so many radians at most.
Vec3 turned_towards(Vec3 from, Vec3 to, double most_rad) {
  const double angle = portable::atan2(length(cross(from, to)), dot(from, to));
  if (!(angle > most_rad)) return to;  // also what is no number: it is judged where it is used
  Vec3 side = to - from * dot(from, to);
  side = length(side) < 1e-6 ? any_perpendicular(from) : normalized(side);
  const auto [sine, cosine] = portable::sin_cos(most_rad);
  return normalized(from * cosine + side * sine);
}

}  // namespace

void SpringHand::put(Vec3 at_mm) noexcept {
  started_ = true;
  position_mm_ = at_mm;
  velocity_mm_s_ = {};
}

DeviceSample SpringHand::step(const HandGoal& goal, double dt_s, Vec3 force_n) noexcept {
  start(goal.position_mm);
  const double damping_n_s_per_mm = 2 * std::sqrt(kSpringNPerMm * 1000 * kMassKg) / 1000;
  Vec3 pull = (goal.position_mm - position_mm_) * kSpringNPerMm;
  if (const double n = length(pull); n > kMaxHandN) pull = pull * (kMaxHandN / n);
  Vec3 total = pull + force_n;
  if (!std::isfinite(dot(total, total)))
    total = {};  // a goal or force that is no number must not lose the hand for good
  total -= velocity_mm_s_ * damping_n_s_per_mm;
  velocity_mm_s_ += total * (1000 * dt_s / kMassKg);
  position_mm_ += velocity_mm_s_ * dt_s;
  DeviceSample sample;
  sample.position_mm = to_floats(position_mm_);
  sample.axis = goal.axis;
  sample.pedal = goal.pedal;
  sample.tool = goal.tool;
  return sample;
}

void GuidedHand::lead(const HandWay& way) noexcept {
  const std::uint32_t number = given_.load(std::memory_order_relaxed) + 1;
  given_way_.store({way, number});
  given_.store(number, std::memory_order_release);
}

Led GuidedHand::led() const noexcept {
  const std::uint32_t given = given_.load(std::memory_order_relaxed), ended = ended_.load(std::memory_order_acquire);
  if (given == 0) return Led::no;
  if (ended >> 1 != given) return Led::on_the_way;
  return (ended & 1) != 0 ? Led::blocked : Led::arrived;
}

void GuidedHand::begin(const HandGoal& goal) noexcept {
  const HandWay& way = now_.way;
  leading_ = true;
  leg_ = 0;
  share_ = waited_s_ = quiet_s_ = 0;
  hand_.start(goal.position_mm);
  from_mm_ = hand_.position_mm();
  from_axis_ = from_floats(goal.axis);
  if (!way.put || way.count == 0) return;
  from_mm_ = way.points[0].at_mm;
  from_axis_ = from_floats(way.points[0].axis);
  hand_.put(from_mm_);
}

void GuidedHand::end(bool blocked) noexcept {
  leading_ = false;
  ended_.store(now_.number << 1 | (blocked ? 1U : 0U), std::memory_order_release);
}

DeviceSample GuidedHand::step(HandGoal& goal, double dt_s, Vec3 force_n) noexcept {
  // While it is being written, the next tick will do.
  if (given_.load(std::memory_order_acquire) != now_.number && given_way_.try_load(now_)) begin(goal);
  if (leading_) {
    if (now_.way.count == 0) {
      // Without a pull bone pushes it out.
      goal.position_mm = hand_.position_mm();
      waited_s_ += dt_s;
      quiet_s_ = length(force_n) < kTouchN ? quiet_s_ + dt_s : 0;
    } else if (leg_ < now_.way.count) {
      const HandWay::Point& to = now_.way.points[leg_];
      const Vec3 along = to.at_mm - from_mm_, to_axis = from_floats(to.axis);
      const double turn = portable::acos(std::clamp(dot(from_axis_, to_axis), -1.0, 1.0));
      const double seconds = std::max(length(along) / (to.near_bone ? kNearMmPerS : kFreeMmPerS), turn / kRadPerS);
      const bool touches = length(force_n) > kTouchN;
      const double ahead = touches ? kTouchAheadMm : to.near_bone ? kNearAheadMm : kFreeAheadMm;
      const double next = seconds > 0 ? std::min(1.0, share_ + dt_s / seconds) : 1.0;
      waited_s_ += dt_s;
      if (share_ < 1 && length(from_mm_ + along * next - hand_.position_mm()) <= std::max(ahead, kThereMm)) {
        share_ = next;
        waited_s_ = 0;
      }
      goal.position_mm = from_mm_ + along * share_;
      goal.axis = to_floats(normalized(from_axis_ * (1 - share_) + to_axis * share_));
      // Corners in free air are rounded.
      const bool round = !to.near_bone && leg_ + 1 < now_.way.count && !now_.way.points[leg_ + 1].near_bone;
      if (share_ >= 1 && length(to.at_mm - hand_.position_mm()) < (round ? kFreeAheadMm : kThereMm)) {
        from_mm_ = to.at_mm;
        from_axis_ = to_axis;
        share_ = waited_s_ = 0;
        ++leg_;
      }
    }
    goal.pedal = 0;
    if (now_.way.count == 0) {
      if (quiet_s_ > kQuietS || waited_s_ > kPatienceS) end(false);
    } else if (waited_s_ > kPatienceS) {
      goal.position_mm = hand_.position_mm();
      end(true);
    } else if (leg_ >= now_.way.count) {
      end(false);
    }
  }
  return hand_.step(goal, dt_s, force_n);
}

bool MouseDevice::lead(const HandWay& way) noexcept {
  hand_.lead(way);
  return true;
}

Led MouseDevice::led() noexcept {
  const Led led = hand_.led();
  if (led != Led::on_the_way) seen_ = hand_.ended();
  return led;
}

DeviceSample MouseDevice::read(std::uint64_t, double dt_s, Vec3 force_n) noexcept {
  static_cast<void>(goal_.try_load(last_));  // while it is being written, the last one will do
  if (!hand_.leading() && last_.ways == hand_.ended()) {
    // Pictures may be slow, and a step of the handle would throw its shaft into bone.
    const Vec3 axis = turned_towards(from_floats(held_.axis), from_floats(last_.goal.axis), kRadPerS * dt_s);
    held_ = last_.goal;
    held_.axis = to_floats(axis);
  }
  held_.tool = last_.goal.tool;
  return hand_.step(held_, dt_s, force_n);
}

HandGoal goal_at(const Strokes& strokes, double t_s, std::size_t& leg) noexcept {
  const auto& w = strokes.waypoints;
  while (leg + 1 < w.size() && w[leg + 1].t_s <= t_s) ++leg;
  HandGoal goal;
  goal.tool = static_cast<std::uint8_t>(strokes.tool);
  goal.axis = to_floats(strokes.axis);
  if (w[leg].drill_on && leg + 1 < w.size())
    goal.pedal = static_cast<std::uint8_t>(std::lround(255 * std::clamp(w[leg].pedal, 0.0, 1.0)));
  goal.position_mm = w[leg].at_mm;
  if (leg + 1 < w.size()) {
    const double s = std::clamp((t_s - w[leg].t_s) / (w[leg + 1].t_s - w[leg].t_s), 0.0, 1.0);
    goal.position_mm += (w[leg + 1].at_mm - w[leg].at_mm) * s;
  }
  return goal;
}

DeviceSample ScriptedDevice::read(std::uint64_t tick, double dt_s, Vec3 force_n) noexcept {
  return hand_.step(goal_at(strokes_, static_cast<double>(tick) / rate_hz_, leg_), dt_s, force_n);
}

}  // namespace osteo::inline simulation
