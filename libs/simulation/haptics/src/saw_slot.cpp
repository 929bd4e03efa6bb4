#include "osteo/simulation/haptics/saw_slot.h"

#include <algorithm>
#include <cmath>

namespace osteo::inline simulation {

bool SawSlot::step(const CuttingGuide& guide, bool saw, Vec3& at_mm, Vec3& axis, double dt_s) noexcept {
  if (!saw) share_ = 0;  // another instrument is in the hand
  if (share_ <= 0) {
    held_ = guide;
    in_ = false;
  }
  if (!saw || !held_.on()) return false;
  offset_mm_ = held_.offset_mm(at_mm);
  const double sine = dot(axis, held_.normal);
  const double far = in_ ? kLeaveTimes * held_.within_mm : held_.within_mm, steep = in_ ? kLeaveSine : kEnterSine;
  // A guide that was put elsewhere or taken away lets the saw go as if it had left.
  in_ = guide == held_ && std::abs(offset_mm_) <= far && std::abs(sine) <= steep;
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
