#include "osteo/simulation/marker/device.h"

#include <pthread.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <opencv2/core.hpp>

#include "osteo/core/base/error.h"
#include "osteo/core/rt/loop.h"

namespace osteo::inline simulation {
namespace {

constexpr double kTurnRadPerS = 2;
constexpr double kQuietS = 1.5;  // without a pen before it is told

}  // namespace

Mat3 controller_from_camera(CameraPlace place) {
  switch (place) {
    case CameraPlace::above:
      return {{Vec3{1, 0, 0}, Vec3{0, -1, 0}, Vec3{0, 0, -1}}};
    case CameraPlace::behind:
      return {{Vec3{1, 0, 0}, Vec3{0, 0, -1}, Vec3{0, 1, 0}}};
    case CameraPlace::facing:
      break;
  }
  return {{Vec3{-1, 0, 0}, Vec3{0, 0, -1}, Vec3{0, -1, 0}}};
}

PenLink::PenLink(Open open, const CameraModel& camera, const Pen& pen, const PenFilterParams& filter)
    : open_(std::move(open)), camera_(camera), pen_(pen), filter_(filter) {
  thread_ = std::thread([this] { run(); });
}

PenLink::~PenLink() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
}

void PenLink::say(const std::string& what) {
  const std::lock_guard lock(trouble_mutex_);
  trouble_ = what;
}

std::string PenLink::trouble() const {
  const std::lock_guard lock(trouble_mutex_);
  return trouble_;
}

void PenLink::run() {
  ::pthread_setname_np(::pthread_self(), "osteo-camera");
  cv::setNumThreads(1);  // pictures are small, and the other cores are the servo's and the window's
  while (!stop_) {
    try {
      read_on();
    } catch (const Error& e) {
      say(std::string("camera: ") + e.what() + (e.advice().empty() ? "" : "; " + e.advice()));
    } catch (const std::exception& e) {
      say(std::string("camera: ") + e.what());
    }
    connected_ = false;
    state_.store({{}, 0, pictures_});
    for (int i = 0; i < 10 && !stop_; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

// Until it is gone, or was not there.
void PenLink::read_on() {
  const auto source = open_();
  connected_ = true;
  PenTracker tracker(camera_, pen_.pen, pen_.scale);
  PenFilter filter(pen_.tip_mm, filter_);
  const double period_s = source->fps() > 0 ? 1 / source->fps() : 1 / camera_.fps;
  const auto delay_ns = static_cast<std::int64_t>(camera_.delay_ms() * 1e6);
  unseen_ = odd_ = 0;
  const std::int64_t begin = monotonic_ns();
  std::uint64_t number = 0;
  GrayPicture picture;
  while (!stop_ && source->next(picture)) {
    std::int64_t arrived = monotonic_ns();
    if (!source->live()) {
      // A video stands for a camera: its pictures come when they were taken.
      const std::int64_t due = begin + static_cast<std::int64_t>(static_cast<double>(number) * period_s * 1e9);
      if (arrived < due) std::this_thread::sleep_for(std::chrono::nanoseconds(due - arrived));
      arrived = monotonic_ns();
    }
    ++number;
    const PenSight sight = tracker.look(picture);
    const std::int64_t of_ns = arrived - delay_ns;
    ++pictures_;
    if (sight.state == PenSight::State::seen) {
      ++seen_;
      filter.add(static_cast<double>(of_ns - begin) / 1e9, sight);
      State s{filter.motion(), of_ns, pictures_};
      s.motion.time_s = 0;
      state_.store(s);
    }
    notify(sight, source->live());
  }
  if (!stop_) {
    const bool live = source->live();
    say(live ? "the camera is gone; plugged in again, it goes on" : "the video has ended");
    state_.store({{}, 0, pictures_});
    // A video does not begin again: a pose that was is not a hand.
    while (!stop_ && !live) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

void PenLink::notify(const PenSight& sight, bool) {
  using Sight = PenSight::State;
  const int quiet = std::max(3, static_cast<int>(kQuietS * camera_.fps));
  unseen_ = sight.state == Sight::seen ? 0 : unseen_ + 1;
  // Left-out markers in every picture: something else is in it.
  odd_ = sight.state == Sight::seen && sight.doubled ? odd_ + 1 : 0;
  if (unseen_ == 0) {
    if (odd_ > quiet) {
      say("a marker of the pen is seen twice: two pens with the same print? Take one away, or print pen 2");
    } else if (sight.mirrored != camera_.mirrored) {
      say("the camera's picture is mirrored otherwise than when it was calibrated; it is turned back");
    } else {
      say({});
    }
    return;
  }
  if (unseen_ < quiet) return;
  if (sight.dark) return say("the camera's picture is too dark to see markers: more light, or open its shutter");
  if (sight.state == Sight::doubled)
    return say("two pens with the same print are in the picture: take one away, or print pen 2");
  if (sight.state == Sight::unlike)
    return say(
        "markers are seen, but they do not make up this pen: another print, one glued otherwise, or another camera's "
        "file");
  if (sight.state == Sight::ambiguous)
    return say(
        "too little of the pen is seen to tell how it is held: nearer, in better light, no finger over its markers");
  if (sight.other_pen) return say("markers of another pen are seen, none of pen " + std::to_string(pen_.pen));
  say("the camera sees no marker of pen " + std::to_string(pen_.pen));
}

MarkerDevice::MarkerDevice(std::shared_ptr<PenLink> link, const CameraModel& camera, const HandGoal& start,
                           const Mat3& scene_from_camera, double scale, const FootPedal* pedal, std::size_t hand)
    : TunedHand(hand),
      link_(std::move(link)),
      scene_from_camera_(scene_from_camera),
      scale_(scale),
      patience_ms_(camera.delay_ms() + 2.5 * camera.period_ms()),
      pedal_(pedal),
      tool_(start.tool),
      map_(start.position_mm, scene_from_camera, scale),
      goal_(start),
      axis_(from_floats(start.axis)) {}

// The handle's way to where the pen points; at once when it has got there.
Vec3 MarkerDevice::towards(Vec3 wanted, double dt_s) noexcept {
  if (!turning_) return wanted;
  const Vec3 about = cross(axis_, wanted);
  const double sine = length(about), angle = std::atan2(sine, dot(axis_, wanted));
  const double step = kTurnRadPerS * dt_s;
  if (!(angle > step)) {
    turning_ = false;
    return wanted;
  }
  const Vec3 pole = sine > 1e-6 ? about / sine : any_perpendicular(axis_);
  return normalized(axis_ * std::cos(step) + cross(pole, axis_) * std::sin(step));
}

DeviceSample MarkerDevice::read(std::uint64_t, double dt_s, Vec3 force_n) noexcept {
  static_cast<void>(link_->latest(last_));
  const std::int64_t now = monotonic_ns();
  const double since_ms = last_.of_ns == 0 ? 1e9 : static_cast<double>(now - last_.of_ns) / 1e6;
  const HandTuning& t = tuning();
  const std::uint32_t switches = pedal_ != nullptr ? pedal_->pressed() : 0;
  map_.rescale(t.scale);
  double silent_ms = 0;
  if (since_ms > patience_ms_) {
    // Nothing pulls the tool; bone may push it out while the force fades.
    silent_ms = since_ms - patience_ms_;
    if (silent_ms > 1 || last_.of_ns == 0) out_of_sight_ = true;
    hand_.start(goal_.position_mm);
    goal_.position_mm = hand_.position_mm();
    goal_.pedal = 0;
  } else {
    const double ahead_s = std::min(since_ms / 1e3, PenMotion::kMaxAheadS);
    if (out_of_sight_) {
      hand_.start(goal_.position_mm);
      map_ = WorkspaceMap(hand_.position_mm(), scene_from_camera_, scale_);
      map_.rescale(t.scale);
      turning_ = true;
      out_of_sight_ = false;
    }
    goal_.position_mm = map_.update(last_.motion.tip_at(ahead_s), t.clutch || (switches & t.clutch_switches) != 0);
    axis_ = towards(normalized(scene_from_camera_ * last_.motion.rotation_at(ahead_s).column[2]), dt_s);
    goal_.pedal = pedal_of(t, 0, switches);
  }
  goal_.axis = to_floats(axis_);
  goal_.tool = tool_;
  DeviceSample s = hand_.step(goal_, dt_s, force_n);
  s.age_ms = static_cast<std::uint8_t>(std::clamp(silent_ms, 0.0, 255.0));
  return s;
}

}  // namespace osteo::inline simulation
