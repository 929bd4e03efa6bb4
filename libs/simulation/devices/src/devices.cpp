#include "osteo/simulation/devices/devices.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/rt/loop.h"

namespace osteo::inline simulation {
namespace {

std::uint8_t age_ms(std::int64_t time_ns) noexcept {
  if (time_ns == 0) return 255;
  return static_cast<std::uint8_t>(std::clamp<std::int64_t>((monotonic_ns() - time_ns) / 1'000'000, 0, 255));
}

// v turned about a unit axis (O. Rodrigues).
Vec3 turned(Vec3 v, Vec3 axis, double angle) {
  return v * std::cos(angle) + cross(axis, v) * std::sin(angle) + axis * (dot(axis, v) * (1 - std::cos(angle)));
}

// A small dead zone, and finer near the middle.
double shaped(double v) noexcept {
  const double a = std::max(0.0, std::abs(v) - 0.04) / 0.96;
  return std::copysign(a * (0.3 + 0.7 * a), v);
}

// The desk's right, away and up as right, up and towards the user.
DeviceMotion motion_of(const SpaceMouseState& s) noexcept {
  DeviceMotion m;
  m.push = Vec3{shaped(s.move[0]), shaped(s.move[2]), -shaped(s.move[1])};
  m.turn = {shaped(s.turn[0]), shaped(s.turn[2]), -shaped(s.turn[1])};
  return m;
}

}  // namespace

DeviceMotion CameraPuck::motion() const noexcept {
  return motion_of(shared_.load());
}

Vec3 extrapolate(const ForcePlane& p, Vec3 position_mm, std::int64_t now_ns, double hold_ms, double fade_ms) noexcept {
  if (p.time_ns == 0) return {};
  const double age_ms = static_cast<double>(now_ns - p.time_ns) / 1e6;
  const double share = age_ms <= hold_ms ? 1 : std::clamp(1 - (age_ms - hold_ms) / fade_ms, 0.0, 1.0);
  if (!(share > 0)) return {};
  Vec3 force = p.force_n;
  const double deeper = dot(p.position_mm - position_mm, p.normal);
  if (std::isfinite(deeper)) {
    // The plane pushes more the deeper the hand goes, and never pulls it back.
    const double pushed = dot(p.force_n, p.normal);
    force += p.normal * (std::max(0.0, pushed + p.stiffness_n_per_mm * deeper) - std::max(0.0, pushed));
  }
  const double most = 2 * length(p.force_n) + 0.5, n = length(force);
  if (!std::isfinite(n)) return {};
  return force * (share * (n > most ? most / n : 1.0));
}

SpaceMouseDevice::SpaceMouseDevice(HidLink::Open open, const HandGoal& start, const Mat3& rotation,
                                   const FootPedal* pedal, std::size_t hand)
    : TunedHand(hand),
      goal_(start),
      tool_(start.tool),
      rotation_(rotation),
      pedal_(pedal),
      link_(std::move(open), *this, 100) {}

void SpaceMouseDevice::report(HidPort&, std::span<const std::byte> report) {
  if (!decode_space_mouse(report, own_.state)) return;
  own_.time_ns = monotonic_ns();
  shared_.store(own_);
}

void SpaceMouseDevice::gone() {
  own_ = {};
  shared_.store(own_);
}

DeviceSample SpaceMouseDevice::read(std::uint64_t, double dt_s, Vec3 force_n) noexcept {
  static_cast<void>(shared_.try_load(last_));
  constexpr double kFullMmPerS = 60, kFullRadPerS = 1.5;
  const bool lent = lent_;
  const HandTuning& t = tuning();
  const std::uint32_t switches = pedal_ != nullptr ? pedal_->pressed() : 0;
  SpaceMouseState s = lent ? SpaceMouseState{} : last_.state;
  if (t.clutch || (switches & t.clutch_switches) != 0) s.move = s.turn = {};
  const Vec3 move{shaped(s.move[0]), shaped(s.move[1]), shaped(s.move[2])},
      turn{shaped(s.turn[0]), shaped(s.turn[1]), shaped(s.turn[2])};
  goal_.position_mm += rotation_ * (move * (kFullMmPerS * t.scale * dt_s));
  if (const double rate = length(turn); rate > 0)
    goal_.axis =
        to_floats(normalized(turned(from_floats(goal_.axis), rotation_ * (turn / rate), rate * kFullRadPerS * dt_s)));
  goal_.tool = tool_;
  goal_.pedal = lent ? 0 : pedal_of(t, s.buttons, switches);
  DeviceSample sample = hand_.step(goal_, dt_s, force_n);
  sample.buttons = static_cast<std::uint8_t>(s.buttons);
  // The cap at rest sends nothing, so silence is not a sign of an unplugged device; gone() says that.
  return sample;
}

DeviceMotion SpaceMouseDevice::motion() const noexcept {
  return motion_of(shared_.load().state);
}

WoodenHapticsDevice::WoodenHapticsDevice(HidLink::Open open, const WoodenHapticsGeometry& geometry,
                                         const WorkspaceMap& map, int tool, const FootPedal* pedal, std::size_t hand)
    : TunedHand(hand),
      geometry_(geometry),
      kinematics_(geometry),
      map_(map),
      tool_(static_cast<std::uint8_t>(tool)),
      pedal_(pedal),
      link_(std::move(open), *this, 2) {}

DeviceTraits WoodenHapticsDevice::traits() const {
  // A report and its answer take a millisecond each over USB at full speed.
  return {geometry_.damping_n_s_per_m, 1e-3, kinematics_.resolution_mm() * map_.scale(), geometry_.max_force_n,
          geometry_.max_stiffness_n_per_mm / map_.scale()};
}

bool WoodenHapticsDevice::send(HidPort& port, std::array<double, 3> current_ma) {
  last_write_ns_ = monotonic_ns();
  return port.write(encode_woodenhaptics(current_ma, WoodenHapticsCommand::force, {}, 65));
}

void WoodenHapticsDevice::opened(HidPort& port) {
  // The device speaks once it has been spoken to.
  send(port, {});
}

void WoodenHapticsDevice::report(HidPort& port, std::span<const std::byte> bytes) {
  WoodenHapticsReport r;
  if (!decode_woodenhaptics(bytes, r)) {
    ++garbled_;
    return;
  }
  newest_angles_rad_ = kinematics_.angles_rad(r.encoder);
  newest_ = {kinematics_.position_mm(newest_angles_rad_), kinematics_.axis(newest_angles_rad_, r.encoder), r.button,
             monotonic_ns()};
  pose_.store(newest_);
  ForcePlane plane;
  if (!force_.try_load(plane)) plane = {};
  Vec3 force = extrapolate(plane, newest_.position_mm, newest_.time_ns);
  if (const double n = length(force); n > geometry_.max_force_n) force = force * (geometry_.max_force_n / n);
  send(port, kinematics_.currents_ma(newest_angles_rad_, force));
}

void WoodenHapticsDevice::idle(HidPort& port) {
  const std::int64_t now = monotonic_ns();
  // No report: no force, since nobody knows where the hand is. And the device falls silent when it is not spoken to.
  if (now - last_write_ns_ > 20'000'000) send(port, {});
}

void WoodenHapticsDevice::gone() {
  Pose none = newest_;
  none.time_ns = 0;
  pose_.store(none);
}

DeviceSample WoodenHapticsDevice::read(std::uint64_t, double, Vec3) noexcept {
  static_cast<void>(pose_.try_load(last_pose_));
  const HandTuning& t = tuning();
  const std::uint32_t switches = pedal_ != nullptr ? pedal_->pressed() : 0;
  map_.rescale(t.scale);
  const bool clutch = t.clutch || (switches & t.clutch_switches) != 0;
  DeviceSample s;
  s.age_ms = age_ms(last_pose_.time_ns);
  if (last_pose_.time_ns == 0) {
    silent_ = true;
    s.position_mm = to_floats(map_.last_mm());
  } else {
    s.position_mm = to_floats(map_.update(last_pose_.position_mm, clutch || silent_ || lent_));
    silent_ = false;
  }
  s.axis = to_floats(normalized(map_.direction(last_pose_.axis)));
  s.pedal = lent_ ? 0 : pedal_of(t, last_pose_.button ? 1 : 0, switches);
  s.buttons = last_pose_.button ? 1 : 0;
  s.tool = tool_;
  return s;
}

void WoodenHapticsDevice::feel(Vec3 force_n, Vec3 normal, double stiffness_n_per_mm) noexcept {
  ForcePlane p;
  if (lent_) {  // what it is pushed by is not where its hand is
    force_.store(p);
    return;
  }
  p.force_n = map_.to_device(force_n);
  p.normal = map_.to_device(normal);
  p.position_mm = last_pose_.position_mm;
  p.stiffness_n_per_mm = stiffness_n_per_mm * map_.scale();
  p.time_ns = monotonic_ns();
  force_.store(p);
}

DeviceMotion WoodenHapticsDevice::motion() const noexcept {
  const Pose pose = pose_.load();
  if (pose.time_ns == 0) return {};
  const auto seen = [](Vec3 v) { return Vec3{-v.y, v.z, -v.x}; };  // of forward, left, up
  DeviceMotion m;
  m.hand_mm = seen(pose.position_mm);
  m.axis = normalized(seen(pose.axis));
  return m;
}

std::vector<FoundDevice> find_devices() {
  std::vector<FoundDevice> found;
  for (const HidInfo& info : list_hid()) {
    const DeviceModel model = model_of(info.vendor, info.product);
    if (model == DeviceModel::unknown) continue;
    FoundDevice f{info, model, false, {}};
    f.readable = open_hid(info, f.why) != nullptr;
    found.push_back(std::move(f));
  }
  return found;
}

}  // namespace osteo::inline simulation
