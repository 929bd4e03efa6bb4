#include "osteo/simulation/camera/scope_control.h"

#include <algorithm>
#include <cmath>

namespace osteo::inline simulation {
namespace {

constexpr std::size_t kMaxUndo = 64;

Vec3 limited(Vec3 v, double most) {
  const double n = length(v);
  return n > most ? v * (most / n) : v;
}

// v' = (u - v) / tau, from v: the way.
Vec3 driven(Vec3& v, Vec3 u, double tau, double t) {
  const double left = tau > 0 ? std::exp(-t / tau) : 0.0;
  const Vec3 way = u * t + (v - u) * (tau * (1 - left));
  v = u + (v - u) * left;
  return way;
}

// |v|' = -|v| / tau - a until it rests: the way.
Vec3 running_out(Vec3& v, double a, double tau, double t) {
  const double speed = length(v);
  if (speed == 0 || tau <= 0) {
    v = {};
    return {};
  }
  const Vec3 along = v / speed;
  const double rests_s = a > 0 ? tau * std::log1p(speed / (a * tau)) : t;
  const double s = std::min(t, rests_s), left = std::exp(-s / tau), reach = speed + a * tau;
  v = a > 0 && t >= rests_s ? Vec3{} : along * (reach * left - a * tau);
  return along * (reach * tau * (1 - left) - a * tau * s);
}

}  // namespace

ScopeMotion ScopeArm::advance(const std::optional<ScopeRates>& drive, double seconds) {
  const double tau = params.inertia_s;
  if (!drive) {
    return {running_out(velocity_.move_mm_s, params.friction_mm_s2, tau, seconds),
            running_out(velocity_.turn_rad_s, params.friction_rad_s2, tau, seconds)};
  }
  return {driven(velocity_.move_mm_s, limited(drive->move_mm_s, params.most_mm_s), tau, seconds),
          driven(velocity_.turn_rad_s, limited(drive->turn_rad_s, params.most_rad_s), tau, seconds)};
}

void ScopeControl::keep() {
  undo_.push_back(view_);
  if (undo_.size() > kMaxUndo) undo_.pop_front();
}

// A hand that takes hold ends a flight where it is.
void ScopeControl::begin(Kind kind) {
  if (flight_) {
    flight_.reset();
    if (view_.upright) level(view_);
    kind_.reset();
  }
  if (kind_ != kind) {
    keep();
    ++moves_[static_cast<std::size_t>(kind)];
  }
  kind_ = kind;
  quiet_s_ = 0;
}

void ScopeControl::orbit(double right_rad, double up_rad) {
  begin(Kind::orbit);
  osteo::orbit(view_, right_rad, up_rad);
}
void ScopeControl::pan(double right_mm, double up_mm) {
  begin(Kind::pan);
  osteo::pan(view_, right_mm, up_mm);
}
void ScopeControl::roll(double angle_rad) {
  begin(Kind::roll);
  osteo::roll(view_, angle_rad);
}
void ScopeControl::zoom(double factor) {
  begin(Kind::zoom);
  magnify(view_, view_.magnification * factor);
}
void ScopeControl::step(int direction) {
  begin(Kind::zoom);
  step_magnification(view_, direction);
}
void ScopeControl::focus(double deeper_mm) {
  begin(Kind::focus);
  focus_deeper(view_, deeper_mm);
}
void ScopeControl::set_working_distance(double mm) {
  begin(Kind::working_distance);
  osteo::set_working_distance(view_, mm);
}
void ScopeControl::set_upright(bool on) {
  ScopeView to = target();
  if (on) {
    look_from(to, to.back);
  } else {
    to.upright = false;
  }
  go(to);
}

void ScopeControl::guide(CameraGuide mode, const ScopeMotion& device, double seconds) {
  begin(Kind::guide);
  if (seconds <= 0) return;
  const double mm = kFieldsPerMm * view_.field_mm();
  ScopeMotion wanted;
  if (mode != CameraGuide::turn) wanted.shift_mm = device.shift_mm * mm;
  if (mode == CameraGuide::six) wanted.turn_rad = device.turn_rad;
  // The hand grips the eye's end of the microscope: right moves the eye to the right, up moves it up, pulling focuses.
  if (mode == CameraGuide::turn) {
    wanted.turn_rad = {-device.shift_mm.y * kRadPerMm, device.shift_mm.x * kRadPerMm, 0};
    wanted.shift_mm = {0, 0, device.shift_mm.z * mm};
  }
  arm.params.most_mm_s = 4 * view_.field_mm();
  arm.params.friction_mm_s2 = 0.5 * view_.field_mm();
  const bool rests = length(wanted.shift_mm) == 0 && length(wanted.turn_rad) == 0;
  const auto drive =
      rests ? std::nullopt : std::optional(ScopeRates{wanted.shift_mm / seconds, wanted.turn_rad / seconds});
  move(view_, arm.advance(drive, seconds));
}

void ScopeControl::drive(Vec3 shift, Vec3 turn, double seconds) {
  const bool rests = length(shift) == 0 && length(turn) == 0;
  if (rests && !arm.moves()) return;
  begin(Kind::guide);
  arm.params.most_mm_s = 4 * view_.field_mm();
  arm.params.friction_mm_s2 = 0.5 * view_.field_mm();
  const auto drive = rests ? std::nullopt : std::optional(ScopeRates{shift * view_.field_mm(), turn * 0.5});
  move(view_, arm.advance(drive, seconds));
}

void ScopeControl::fly(const ScopeView& to) {
  ++moves_[static_cast<std::size_t>(Kind::flight)];
  arm.brake();
  kind_.reset();
  if (flights) {
    flight_ = Flight{view_, to};
  } else {
    flight_.reset();
    view_ = to;
  }
}

void ScopeControl::go(const ScopeView& to) {
  if (to == target()) return;
  keep();
  fly(to);
}

void ScopeControl::jump(const ScopeView& to) {
  flight_.reset();
  arm.brake();
  kind_.reset();
  undo_.clear();
  view_ = to;
}

bool ScopeControl::go_to_bookmark(std::size_t n) {
  const auto& kept = bookmarks_.at(n);
  if (kept) go(*kept);
  return kept.has_value();
}

void ScopeControl::look_at(Vec3 place_mm) {
  ScopeView to = target();
  to.focus_mm = place_mm;
  go(to);
}

void ScopeControl::look_along(Vec3 place_mm, Vec3 handle) {
  ScopeView to = target();
  to.focus_mm = place_mm;
  if (to.upright) {
    look_from(to, handle);
  } else {
    look_from(to, handle, std::abs(dot(normalized(handle), to.up)) > 0.99 ? to.back : to.up);
  }
  go(to);
}

void ScopeControl::from_side(Vec3 towards_eye, std::optional<Vec3> up) {
  ScopeView to = target();
  look_from(to, towards_eye, up);
  go(to);
}

bool ScopeControl::undo() {
  if (undo_.empty()) return false;
  const ScopeView to = undo_.back();
  undo_.pop_back();
  fly(to);
  return true;
}

void ScopeControl::advance(double seconds) {
  quiet_s_ += seconds;
  if (quiet_s_ > kPauseS) kind_.reset();
  if (!flight_) return;
  flight_->gone_s += seconds;
  const double t = flight_->gone_s / kFlightS;
  if (t >= 1) {
    view_ = flight_->to;
    flight_.reset();
  } else {
    view_ = between(flight_->from, flight_->to, t * t * (3 - 2 * t));
  }
}

}  // namespace osteo::inline simulation
