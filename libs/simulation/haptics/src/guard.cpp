#include "osteo/simulation/haptics/guard.h"

#include <algorithm>
#include <cmath>

#include "osteo/simulation/haptics/stream.h"

namespace osteo::inline simulation {
namespace {

// Also of the square of its length, so that nothing overflows on the way.
Vec3 finite_or_zero(Vec3 v) {
  return std::isfinite(dot(v, v)) ? v : Vec3{};
}
Vec3 direction(Vec3 v) {
  const double n2 = dot(v, v);
  return std::abs(n2 - 1) < 1e-6 ? v : normalized(finite_or_zero(v));
}
// What strokes with the drag may get back of what strokes against it have cost, mJ.
constexpr double kDragCreditMj = 0.1;
// Energy put in beyond what contact would give back (bone taken away, damping) buys no gains later, but for this.
constexpr double kCreditShare = 0.5, kCreditMj = 0.1;
// The way over which the share of the force follows.
constexpr double kShareMm = 0.02;

// Of a force of damping, for one step of the encoder.
constexpr double kFeltStepN = 0.05;
// Below, the force changes by the noise of numbers.
constexpr double kLeastWayMm = 1e-3;

// A limit that is not a number is the strictest.
double limit_of(double value) {
  return value > 0 ? value : 0;
}

}  // namespace

double safe_stiffness_n_per_mm(const DeviceTraits& d, double contact_damping_n_s_per_m, double tick_s) {
  const double bound = (d.damping_n_s_per_m + contact_damping_n_s_per_m) / (tick_s / 2 + d.delay_s);
  const double share = d.encoder_mm > 0 ? 0.25 : 0.5;
  return limit_of(std::min(limit_of(share * bound / 1000), limit_of(d.max_stiffness_n_per_mm)));
}

double PassivityControl::update(Vec3 x_mm, Vec3 elastic_n, Vec3 velocity_mm_s, double dt_s, double encoder_mm,
                                double most) noexcept {
  if (started_) energy_mj_ += dot(last_force_n_, x_mm - last_x_mm_);
  started_ = true;
  last_x_mm_ = x_mm;
  if (elastic_n == Vec3{} || !std::isfinite(energy_mj_)) {
    energy_mj_ = 0;
    return 0;
  }
  // Half an encoder step at each end of a cycle, and what adds up over a few, may be feigned.
  const double feigned = 4 * encoder_mm * length(elastic_n), speed2 = dot(velocity_mm_s, velocity_mm_s);
  const double least = encoder_mm > 0 ? encoder_mm / (16 * dt_s) : 1e-6;
  if (energy_mj_ <= feigned || speed2 < least * least) return 0;
  // Damping alpha takes alpha v^2 dt out in the tick to come: mJ = N mm; alpha in N s/mm here.
  return std::min((energy_mj_ - feigned) / (speed2 * dt_s) * 1000, most);
}

double EnergyDebt::update(Vec3 x_mm, Vec3 elastic_n, double stored_mj, Vec3 velocity_mm_s, double dt_s,
                          double encoder_mm) noexcept {
  const double stored = stored_mj > 0 && std::isfinite(stored_mj) ? stored_mj : 0;
  if (started_)
    given_mj_ += dot(last_force_n_, x_mm - last_x_mm_);
  else
    given_mj_ = std::min(given_mj_, -stored);
  started_ = true;
  last_x_mm_ = x_mm;
  if (!std::isfinite(given_mj_)) given_mj_ = 0;
  if (elastic_n == Vec3{}) {
    // As much may encoder steps feign.
    given_mj_ = std::clamp(given_mj_ - limit_of(encoder_mm) * most_n_, 0.0, kMaxOwedMj);
    owed_mj_ = given_mj_;
    most_n_ = out_mm_ = 0;
    fits_ = 1;
    return share_ = 1;
  }
  most_n_ = std::max(most_n_, length(elastic_n));
  double wanted = 1;
  const double way_mm = length(velocity_mm_s) * dt_s, reach_mm = kShareMm + 4 * limit_of(encoder_mm);
  if (stored > 0) {
    given_mj_ = std::max(given_mj_, -(1 + kCreditShare) * stored - kCreditMj);
    if (dot(elastic_n, velocity_mm_s) > 0) {
      out_mm_ += way_mm;
      wanted = std::clamp((limit_of(encoder_mm) * most_n_ - given_mj_) / (fits_ * stored), kMinShare, 1.0);
    } else if (out_mm_ < reach_mm) {
      fits_ = std::clamp((owed_mj_ - given_mj_) / stored, kMinShare, 1.0);
    }
  }
  share_ += (wanted - share_) * std::min(1.0, way_mm / reach_mm);
  return share_;
}

void LocalStiffness::update(Vec3 x_mm, Vec3 elastic_n, Vec3 normal, double dt_s, double encoder_mm) noexcept {
  const Vec3 moved = x_mm - last_x_mm_, more = elastic_n - last_force_n_;
  const double step_mm = limit_of(encoder_mm);
  if (!started_ || elastic_n == Vec3{}) {
    const double left = std::max(0.0, 1 - dt_s / kForgetS);
    along_ *= left;
    across_ *= left;
  } else if (length(moved) < std::max(kLeastWayMm, 0.5 * step_mm)) {
    return;  // the force has hardly changed either; the way adds up
  } else {
    const auto follow = [&](double& value, double way_mm, double rise_n) {
      const double slope = std::clamp(rise_n / std::max(way_mm, kLeastWayMm), 0.0, kMostNPerMm);
      value += (slope - value) * std::min(1.0, way_mm / ((slope > value ? kWayMm : 8 * kWayMm) + step_mm));
    };
    const double out = dot(moved, normal);
    const Vec3 aside = moved - normal * out, more_aside = more - normal * dot(more, normal);
    follow(along_, std::abs(out), out > 0 ? -dot(more, normal) : dot(more, normal));
    const double aside_mm = length(aside);
    follow(across_, aside_mm, aside_mm > 0 ? -dot(more_aside, aside) / aside_mm : 0);
  }
  started_ = true;
  last_x_mm_ = x_mm;
  last_force_n_ = elastic_n;
}

Guard::Guard(const GuardParams& params, const DeviceTraits& device) : device_(device) {
  set(params);
}

void Guard::set(const GuardParams& params) noexcept {
  params_ = params;
  most_n_ = std::min(limit_of(params.max_force_n), limit_of(device_.max_force_n));
}

Guard::Output Guard::limit(const Input& in, double dt_s) noexcept {
  Output out;
  const double dt = std::isfinite(dt_s) && dt_s > 0 ? dt_s : 1e-3;
  const bool placed = std::isfinite(dot(in.position_mm, in.position_mm));
  if (in.jumped || !placed) {
    moving_ = false;
    passivity_.reset();
    drag_.reset();
    debt_.jumped();
    stiffness_.jumped();
    resume_ = 0;
    out.flags |= kPoseJumped;
  }
  // From one tick to the next, in encoder steps or not: the steps average out, while any smoothing would come late, and
  // damping by a late velocity drives what it should damp.
  const Vec3 at = placed ? in.position_mm : last_x_mm_;
  velocity_ = moving_ ? finite_or_zero((at - last_x_mm_) / dt) : Vec3{};
  last_x_mm_ = at;
  moving_ = true;
  double share = resume_;
  if (!(in.age_ms <= params_.stale_ms)) {
    // The hand may be anywhere by now.
    share = std::min(share, std::max(0.0, 1 - (in.age_ms - params_.stale_ms) / params_.fade_ms));
    resume_ = std::min(resume_, share);
    out.flags |= kPoseStale;
  } else if (resume_ < 1) {
    resume_ = params_.resume_s > 0 ? std::min(1.0, resume_ + dt / params_.resume_s) : 1.0;
    share = resume_;
  }
  Vec3 elastic = finite_or_zero(in.elastic_n) * share;
  const bool owes = params_.passivity && params_.law > 1;
  if (owes) elastic = elastic * debt_.update(at, elastic, in.stored_mj, velocity_, dt, device_.encoder_mm);
  Vec3 force = elastic, effects = finite_or_zero(in.effects_n) * share;
  if (!(elastic == Vec3{})) {
    // Damping may slow the hand's way out, but never hold it.
    const Vec3 normal = direction(in.normal);
    double along = params_.contact_damping_n_s_per_m, across = 0;
    if (params_.law > 2) {
      // What safe_stiffness_n_per_mm() would ask of damping where the force is as stiff as it really is.
      stiffness_.update(at, elastic, normal, dt, device_.encoder_mm);
      const double s = (dt / 2 + limit_of(device_.delay_s)) / (device_.encoder_mm > 0 ? 0.25 : 0.5);
      // Velocities of an encoder come in steps, each of which would be felt.
      const double most =
          std::min(limit_of(params_.max_damping_n_s_per_m), kFeltStepN * 1000 * dt / limit_of(device_.encoder_mm));
      const auto asked = [&](double n_per_mm) {
        return std::clamp(1000 * n_per_mm * s - limit_of(device_.damping_n_s_per_m), 0.0, most);
      };
      along = std::max(along, asked(stiffness_.along_n_per_mm()));
      across = asked(stiffness_.across_n_per_mm());
    }
    const double out = dot(velocity_, normal), damping = along / 1000 * out * share;
    force -= (velocity_ - normal * out) * (across / 1000 * share);
    force -= normal * std::min(damping, std::max(0.0, dot(elastic, normal)));
  }
  if (params_.passivity) {
    const double alpha =
        passivity_.update(at, elastic, velocity_, dt, device_.encoder_mm, params_.max_damping_n_s_per_m);
    if (alpha > 0) {
      force -= velocity_ * (alpha / 1000);
      out.flags |= kPassivity;
    }
  }
  if (owes) {
    const Vec3 drag = finite_or_zero(in.drag_n) * share;
    const double alpha = drag_.update(at, drag, velocity_, dt, device_.encoder_mm, params_.max_damping_n_s_per_m);
    drag_.keep_at_most(kDragCreditMj);
    const Vec3 damping = alpha > 0 ? velocity_ * (-alpha / 1000) : Vec3{};
    if (alpha > 0) {
      effects += damping;
      out.flags |= kPassivity;
    }
    drag_.applied(drag + damping);
  }
  force = finite_or_zero(force + effects);
  if (const double n = length(force); n > most_n_) {
    force = force * (most_n_ / n);
    out.flags |= kForceCapped;
  }
  const Vec3 change = force - last_force_n_;
  if (const double n = length(change), allowed = limit_of(params_.max_rate_n_per_s * dt);
      params_.max_rate_n_per_s != 0 && n > allowed) {
    force = last_force_n_ + change * (allowed / n);
    out.flags |= kRateCapped;
  }
  last_force_n_ = force;
  passivity_.applied(force - effects);
  debt_.applied(force - effects);
  out.force_n = force;
  return out;
}

}  // namespace osteo::inline simulation
