#include "osteo/network/wire/tracked_hand.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/core/rt/loop.h"

namespace osteo::inline network {
namespace {

constexpr std::size_t kMaxBody = 4096;  // of what is understood; longer messages (pictures) are passed over

}  // namespace

TrackerAddress tracker_address(const std::string& text) {
  TrackerAddress t;
  const std::size_t slash = text.find('/');
  if (slash != std::string::npos) t.tool = text.substr(slash + 1);
  if (t.tool.size() > 20)
    throw Error(ExitCode::usage, "'" + t.tool + "' is longer than OpenIGTLink's names", "at most 20 characters");
  t.server = wire_address(text.substr(0, slash));
  if (t.server.port == 0)
    throw Error(ExitCode::usage, "'" + text + "' names no port",
                "HOST:PORT or HOST:PORT/NAME, as localhost:18944/Drill");
  return t;
}

TrackedLink::TrackedLink(const TrackerAddress& tracker)
    : tracker_(tracker),
      follows_(tracker.tool),
      client_(tracker.server, kMaxBody, [this](const IgtlMessage& m) { take(m); }) {}

void TrackedLink::take(const IgtlMessage& m) {
  if (m.type == "TRANSFORM") {
    bool ours = false;
    {
      const std::lock_guard lock(mutex_);
      if (follows_.empty()) follows_ = m.device;
      ours = follows_ == m.device;
    }
    if (!ours) {
      ++others_;
      return;
    }
    const auto pose = igtl_pose_in(m);
    if (!pose || !is_rigid(*pose)) {
      ++refused_;
      return;
    }
    const IgtlPose lps = ras_of_lps(*pose);  // its own inverse
    now_.tip_mm = lps.at_mm;
    now_.axis = normalized(lps.axes.column[2]);
    now_.heard_ns = monotonic_ns();
    ++poses_;
    state_.store(now_);
  } else if (const auto values = igtl_sensor_in(m); values && !values->empty()) {
    {
      const std::lock_guard lock(mutex_);
      if (follows_.empty() || m.device != follows_ + "Pedal") return;
    }
    now_.pedal = std::clamp(values->front(), 0.0, 1.0);
    now_.pedal_ns = monotonic_ns();
    state_.store(now_);
  }
}

std::string TrackedLink::trouble() const {
  if (!client_.connected()) return "tracker " + client_.trouble();
  State s;
  while (!latest(s)) {
  }
  const double since_ms = s.heard_ns == 0 ? -1 : static_cast<double>(monotonic_ns() - s.heard_ns) / 1e6;
  if (since_ms >= 0 && since_ms <= 10 * kStaleMs) return {};
  const std::lock_guard lock(mutex_);
  if (refused_ > 0 && poses_ == 0)
    return "the tracker's matrices are no poses: not finite, scaled, sheared or mirrored";
  if (s.heard_ns == 0)
    return follows_.empty()
               ? "the tracker has not said yet where a tool is"
               : "the tracker says nothing of '" + follows_ + "'" + (others_ > 0 ? ", but of other tools" : "");
  return "the tracked tool '" + follows_ + "' is out of sight; the hand rests where it was";
}

TrackedHand::TrackedHand(std::shared_ptr<TrackedLink> link, const HandGoal& start, const FootPedal* pedal,
                         std::size_t hand)
    : TunedHand(hand), link_(std::move(link)), pedal_(pedal), tool_(start.tool), goal_(start) {}

DeviceSample TrackedHand::read(std::uint64_t, double dt_s, Vec3 force_n) noexcept {
  static_cast<void>(link_->latest(last_));
  const std::int64_t now = monotonic_ns();
  const double since_ms = last_.heard_ns == 0 ? 1e9 : static_cast<double>(now - last_.heard_ns) / 1e6;
  const HandTuning& t = tuning();
  double silent_ms = 0;
  if (since_ms > TrackedLink::kStaleMs) {
    silent_ms = since_ms - TrackedLink::kStaleMs;
    holds_ = false;
    hand_.start(goal_.position_mm);
    goal_.position_mm = hand_.position_mm();
    goal_.pedal = 0;
  } else {
    goal_.position_mm = last_.tip_mm;
    goal_.axis = to_floats(last_.axis);
    if (!begun_) hand_.put(last_.tip_mm);
    begun_ = true;
    holds_ = holds_ || length(hand_.position_mm() - last_.tip_mm) <= kTakesHoldMm;
    const std::uint32_t switches = pedal_ != nullptr ? pedal_->pressed() : 0;
    const bool fresh = last_.pedal_ns != 0 && static_cast<double>(now - last_.pedal_ns) / 1e6 <= TrackedLink::kStaleMs;
    const int sent = fresh ? static_cast<int>(std::lround(255 * last_.pedal)) : 0;
    goal_.pedal = holds_ ? static_cast<std::uint8_t>(std::max<int>(sent, pedal_of(t, 0, switches))) : std::uint8_t{0};
  }
  goal_.tool = tool_;
  DeviceSample s = hand_.step(goal_, dt_s, force_n);
  s.age_ms = static_cast<std::uint8_t>(std::clamp(silent_ms, 0.0, 255.0));
  return s;
}

}  // namespace osteo::inline network
