#include "osteo/simulation/haptics/saw_slot.h"

#include <algorithm>
#include <cmath>

namespace osteo::inline simulation {
namespace {

// Where a slot with play lets a blade lie: how far its tip is off the plane, and the sine of its slope.
struct Lie {
  double offset_mm = 0, sine = 0;
};

// Offsets along the blade are a line; it is moved to where both ends of the faces let it be.
Lie within_play(const CuttingGuide& g, Vec3 at_mm, Vec3 axis, Lie hand) {
  const Vec3 flat = axis - g.normal * hand.sine;
  const double cosine = length(flat);  // not small: a saw this steep is out
  if (!(g.play_mm > 0) || !(cosine > 0)) return {};
  const Vec3 along = flat * (1 / cosine);
  const double tip = dot(at_mm - g.at_mm, along), reach = g.reach_mm(along), slope = hand.sine / cosine,
               middle = hand.offset_mm - slope * tip, half = g.play_mm / 2;
  const double near = std::clamp(middle - slope * reach, -half, half),
               far = std::clamp(middle + slope * reach, -half, half);
  const double left = (far - near) / (2 * reach);
  return {(far + near) / 2 + left * tip, left * cosine};
}

}  // namespace

bool SawSlot::step(const CuttingGuide& guide, bool saw, Vec3& at_mm, Vec3& axis, double dt_s) noexcept {
  if (!saw) share_ = 0;  // another instrument is in the hand
  if (share_ <= 0) {
    held_ = guide;
    in_ = false;
  }
  if (!saw || !held_.on()) return false;
  const Lie hand{held_.offset_mm(at_mm), dot(axis, held_.normal)}, lie = within_play(held_, at_mm, axis, hand);
  offset_mm_ = hand.offset_mm - lie.offset_mm;
  const double sine = hand.sine - lie.sine;
  const double far = in_ ? kLeaveTimes * held_.within_mm : held_.within_mm, steep = in_ ? kLeaveSine : kEnterSine;
  // A guide that was put elsewhere or taken away lets the saw go as if it had left.
  in_ = guide == held_ && std::abs(offset_mm_) <= far && std::abs(hand.sine) <= steep;
  share_ = std::clamp(share_ + (in_ ? dt_s : -dt_s) / kEaseS, 0.0, 1.0);
  if (share_ <= 0) return false;
  at_mm -= held_.normal * (offset_mm_ * share_);
  axis = normalized(axis - held_.normal * (sine * share_));
  return true;
}

Vec3 SawSlot::force_n(double stiffness_n_per_mm, double most_n) const noexcept {
  return held_.normal * std::clamp(-stiffness_n_per_mm * offset_mm_ * share_, -most_n, most_n);
}

}  // namespace osteo::inline simulation
