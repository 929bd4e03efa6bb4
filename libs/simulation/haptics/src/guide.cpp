#include "osteo/simulation/haptics/guide.h"

#include <algorithm>
#include <cmath>

namespace osteo::inline simulation {

SceneAction action_of(const HandGuide& g) {
  SceneAction a = SceneAction::plain(ActionKind::guide);
  a.item = g.leader;
  a.values = {
      static_cast<double>(g.hand), g.stiffness_n_per_mm, g.damping_n_s_per_m, g.forward, g.most_n, g.dead_zone_mm,
      g.own_contact ? 1.0 : 0.0,   g.brake_n_s_per_m};
  return a;
}

HandGuide guide_of(const SceneAction& a) {
  const auto& v = a.values;
  return {static_cast<std::uint32_t>(v[0]), a.item, v[1], v[2], v[3], v[4], v[5], v[6] != 0, v[7]};
}

void GuideLaw::set(const HandGuide& guide, const DeviceTraits& device, double contact_damping_n_s_per_m,
                   double tick_s) noexcept {
  guide_ = guide;
  borne_ = safe_stiffness_n_per_mm(device, contact_damping_n_s_per_m, tick_s) / 2;
  if (guide.stiffness_n_per_mm < 0) {
    const double held = 5 * (device.damping_n_s_per_m + guide.damping_n_s_per_m) / 1000;
    stiffness_ = -std::min({-guide.stiffness_n_per_mm, kAwayStiffness, held});
  } else {
    stiffness_ = std::min(guide.stiffness_n_per_mm, borne_);
  }
}

Vec3 GuideLaw::step(Vec3 at_mm, const Hand& hand, const DeviceSample& leader, Vec3 leader_force_n,
                    double dt_s) noexcept {
  const Vec3 apart = from_floats(leader.position_mm) - at_mm;
  const bool there = leader.age_ms < 255 && std::isfinite(dot(apart, apart));
  if (!there) {
    started_ = false;
    share_ = 0;
    return {};
  }
  const double smooth = dt_s / (dt_s + kSmoothS);
  if (started_) {
    rate_ += ((apart - last_apart_) / dt_s - rate_) * smooth;
    speed_ += ((at_mm - last_at_) / dt_s - speed_) * smooth;
  } else {
    rate_ = speed_ = {};
  }
  started_ = true;
  last_apart_ = apart;
  last_at_ = at_mm;
  const bool still = (leader.buttons & kLeadStill) != 0;
  share_ = std::clamp(share_ + (still ? -dt_s : dt_s) / kFadeS, 0.0, 1.0);

  const double far = length(apart), beyond = far - guide_.dead_zone_mm;
  const bool away = stiffness_ < 0;
  Vec3 pull = beyond > 0 ? apart * (stiffness_ * beyond / far) : Vec3{};
  if (away) {
    if (static_cast<double>(hand.clearance_mm) < kAwayClearanceMm || length(speed_) > kAwayMmPerS || beyond <= 0) {
      pull = {};
    } else {
      pull -= speed_ * (guide_.damping_n_s_per_m / 1000);
    }
  } else {
    pull += rate_ * (guide_.damping_n_s_per_m / 1000) - speed_ * (guide_.brake_n_s_per_m / 1000);
  }
  const double strength = static_cast<double>(leader.buttons & kLeadStrength) / double{kLeadStrength};
  const double most = away ? std::min(guide_.most_n, kAwayN) : guide_.most_n;
  // What is forwarded gives way as the hand goes off, no more steeply than the device bears.
  Vec3 forwarded = leader_force_n * (guide_.forward * share_);
  if (const double n = length(forwarded), limit = std::min(guide_.most_n, borne_ * kNearMm); n > limit)
    forwarded = forwarded * (limit / n);
  pull += forwarded * std::max(0.0, 1 - std::max(0.0, beyond) / kNearMm);
  if (const double n = length(pull); n > most) pull = pull * (most / n);
  const Vec3 force = pull * strength;
  return std::isfinite(dot(force, force)) ? force : Vec3{};
}

}  // namespace osteo::inline simulation
