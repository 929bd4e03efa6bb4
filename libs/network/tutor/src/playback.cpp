#include "osteo/network/tutor/playback.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/core/base/order.h"

namespace osteo::inline network {

bool leads(const PlaybackParams& p) {
  return p.mode != PlaybackMode::feel && p.mode != PlaybackMode::graphics;
}
bool expert_drills(const PlaybackParams& p) {
  if (p.drills != WhoDrills::usual) return p.drills == WhoDrills::expert;
  return p.mode == PlaybackMode::show || p.mode == PlaybackMode::feel || p.mode == PlaybackMode::guide;
}
bool by_clock(const PlaybackParams& p) {
  if (p.pace != Pace::usual) return p.pace == Pace::clock;
  return p.mode == PlaybackMode::show || p.mode == PlaybackMode::feel;
}

HandGuide guide_of(const PlaybackParams& p) {
  HandGuide g;
  g.most_n = std::max(p.most_n, 1e-3);  // a leader there is, though it may not pull
  if (!leads(p)) return g;
  g.stiffness_n_per_mm = p.stiffness_n_per_mm;
  g.damping_n_s_per_m = p.damping_n_s_per_m;
  g.own_contact = p.mode != PlaybackMode::show;
  if (p.mode == PlaybackMode::show) g.forward = p.forward;
  if (p.mode == PlaybackMode::fading || p.mode == PlaybackMode::amplify) g.dead_zone_mm = p.dead_zone_mm;
  if (p.mode == PlaybackMode::amplify) {
    g.stiffness_n_per_mm = -std::min(p.stiffness_n_per_mm, GuideLaw::kAwayStiffness);
    g.damping_n_s_per_m = std::max(p.damping_n_s_per_m, 10.0);  // bears the spring that pushes away
  }
  return g;
}

void FadingGuide::add(double error_mm) noexcept {
  const double bin = std::isfinite(error_mm) ? error_mm / kBinMm : 1e9;
  ++bins_[static_cast<std::size_t>(std::clamp(bin, 0.0, static_cast<double>(bins_.size() - 1)))];
  ++count_;
}

void FadingGuide::end_trial() noexcept {
  if (count_ == 0) return;
  std::uint32_t left = count_ - count_ / 10;  // the 90th percentile
  std::size_t bin = 0;
  while (bin + 1 < bins_.size() && left > bins_[bin]) left -= bins_[bin++];
  error_mm_ = (static_cast<double>(bin) + 0.5) * kBinMm;
  const double gain = (1 - forget_) / std::max(kWorstMm - dead_mm_, 0.1);
  strength_ = std::clamp(forget_ * strength_ + gain * std::max(0.0, error_mm_ - dead_mm_), 0.0, 1.0);
  bins_.fill(0);
  count_ = 0;
  ++trials_;
}

LessonClock::LessonClock(const Lesson& lesson, const PlaybackParams& params)
    : lesson_(lesson), waits_(leads(params)), by_clock_(by_clock(params)), tolerance_mm_(params.tolerance_radius_mm) {
  target_ = from_floats(lesson.way.front().at_mm);
}

// Along the way, of the nearest place near the target; looks no farther than eight millimetres of way.
double LessonClock::behind_mm(Vec3 hand_mm) noexcept {
  constexpr std::size_t kNear = static_cast<std::size_t>(8 / Lesson::kStepMm);
  const auto& way = lesson_.way;
  while (point_ + 1 < way.size() && way[point_ + 1].sample <= sample_) ++point_;
  while (point_ > 0 && way[point_].sample > sample_) --point_;
  const std::size_t from = point_ > kNear ? point_ - kNear : 0, to = std::min(way.size(), point_ + kNear + 1);
  std::size_t nearest = point_;
  double least = 1e300;
  for (std::size_t i = from; i < to; ++i) {
    const Vec3 d = hand_mm - from_floats(way[i].at_mm);
    if (const double d2 = dot(d, d); d2 < least) {
      least = d2;
      nearest = i;
    }
  }
  return static_cast<double>(way[point_].arc_mm) - static_cast<double>(way[nearest].arc_mm);
}

void LessonClock::step(Vec3 hand_mm, double dt_s) noexcept {
  goes_on_ = false;
  if (ended_) return;
  if (!started_) {
    const Vec3 start = from_floats(lesson_.way.front().at_mm);
    if (!waits_) {
      // Along the way: time waits for who comes by himself.
      target_ = start;
      started_ = by_clock_ || length(hand_mm - start) <= kStartMm;
    } else {
      if (!begun_) target_ = hand_mm;
      const Vec3 left = start - target_;
      const double far = length(left), step = kApproachMmPerS * dt_s;
      if (length(hand_mm - target_) <= std::max(tolerance_mm_, kStartMm))
        target_ = far <= step ? start : target_ + left * (step / far);
      started_ = target_ == start && length(hand_mm - start) <= kStartMm;
    }
    begun_ = true;
    if (!started_) return;
    goes_on_ = true;
    return;
  }
  const std::size_t last = lesson_.size() - 1;
  int go = 1;
  // Nobody is led on who is not there; in real time time waits without going back, and not at all where nothing leads.
  if ((!by_clock_ || waits_) && length(hand_mm - target_) > tolerance_mm_)
    go = !by_clock_ && behind_mm(hand_mm) >= 2 * tolerance_mm_ && sample_ > 0 ? -1 : 0;
  if (go > 0 && sample_ == last) {
    ended_ = true;
    return;
  }
  sample_ = go > 0 ? sample_ + 1 : go < 0 ? sample_ - 1 : sample_;
  goes_on_ = sample_ > furthest_;
  furthest_ = std::max(furthest_, sample_);
  const Vec3 at = from_floats(lesson_.hands.front()[sample_].position_mm);
  if (std::isfinite(dot(at, at))) target_ = at;
}

Playback::Playback(std::shared_ptr<const Lesson> l, const PlaybackParams& p)
    : lesson(std::move(l)), params(p), clock(*lesson, params), fading(params.forget, params.dead_zone_mm) {}

DeviceSample LedDevice::read(std::uint64_t tick, double dt_s, Vec3 force_n) noexcept {
  DeviceSample sample = held_->read(tick, dt_s, force_n);
  Playback& p = *playback_;
  if (const Vec3 at = from_floats(sample.position_mm); std::isfinite(dot(at, at))) p.hand_mm = at;
  if (expert_drills(p.params)) {
    sample.pedal = 0;
    sample.tool = p.lesson->hands.front()[p.clock.sample()].tool;
  }
  return sample;
}

DeviceSample RecordedDevice::read(std::uint64_t tick, double dt_s, Vec3) noexcept {
  Playback& p = *playback_;
  if (hand_ == 0) {
    const bool before = p.clock.started();
    p.clock.step(p.hand_mm, dt_s);
    if (p.clock.started() && !before) p.begun = tick;
    if (p.params.mode == PlaybackMode::fading && p.clock.started() && p.clock.goes_on()) {
      p.fading.add(length(p.hand_mm - p.clock.target_mm()));
      p.trial_s += dt_s;
      if (p.trial_s >= p.params.trial_s) {
        p.fading.end_trial();
        p.trial_s = 0;
      }
    }
    p.waited_s = p.clock.goes_on() || p.clock.ended() ? 0 : p.waited_s + dt_s;
    if (p.patience_s > 0 && p.waited_s > p.patience_s) {
      p.given_up = true;
      p.over.store(true, std::memory_order_relaxed);
    }
    const bool pulls = p.on.load(std::memory_order_relaxed) && !p.clock.ended();
    const double most = p.params.mode == PlaybackMode::fading ? p.fading.strength() : 1.0;
    // Let go by who learns: at once, but softly.
    const double ramp_s = pulls || p.clock.ended() ? p.params.ramp_s : std::min(p.params.ramp_s, Playback::kLetGoS);
    p.strength = std::clamp(p.strength + (pulls ? dt_s : -dt_s) / ramp_s, 0.0, most);
    if (p.clock.ended() && p.strength <= 0) p.over.store(true, std::memory_order_relaxed);
    p.seconds.store(static_cast<double>(p.clock.sample()) / p.lesson->rate_hz, std::memory_order_relaxed);
    p.pulled.store(p.strength, std::memory_order_relaxed);
  }
  DeviceSample sample = p.lesson->hands[hand_][p.clock.sample()];
  if (hand_ == 0 && !p.clock.started()) sample.position_mm = to_floats(p.clock.target_mm());
  const bool drills = expert_drills(p.params);
  if (!drills) sample.pedal = 0;
  const int strength = hand_ == 0 ? static_cast<int>(std::lround(p.strength * double{kLeadStrength})) : 0;
  const int still = drills && p.clock.goes_on() ? 0 : kLeadStill;
  sample.buttons = static_cast<std::uint8_t>(strength | still);
  return sample;
}

std::vector<std::unique_ptr<Device>> playback_devices(std::unique_ptr<Device> learner,
                                                      const std::shared_ptr<Playback>& playback, HapticSetup& setup) {
  setup = playback->lesson->setup;
  setup.more_devices.clear();
  setup.device = learner->traits();
  std::vector<std::unique_ptr<Device>> all;
  all.push_back(std::make_unique<LedDevice>(std::move(learner), playback));
  for (std::size_t h = 0; h < playback->lesson->hands.size(); ++h) {
    all.push_back(std::make_unique<RecordedDevice>(playback, h));
    setup.more_devices.push_back(all.back()->traits());
  }
  return all;
}

std::vector<SceneAction> playback_actions(const Playback& playback) {
  std::vector<SceneAction> all{action_of(guide_of(playback.params))};
  for (const SceneAction& a : playback.lesson->actions) {
    if (by_clock(playback.params) && !leads(playback.params)) {
      all.push_back(a);
      continue;
    }
    if (a.is(ActionKind::setting))
      throw Error(
          ExitCode::usage,
          "a haptic setting changes within the lesson, at " +
              format_number(static_cast<double>(a.tick + playback.lesson->first_tick) / playback.lesson->rate_hz) +
              " s",
          "play a part before or behind it: --from-s, --to-s");
  }
  return all;
}

FollowingHand::FollowingHand(double stiffness_n_per_m, Vec3 start_mm, std::shared_ptr<const Playback> playback,
                             const SimulatedDeviceParams& arm)
    : device_(arm, start_mm),
      stiffness_n_per_mm_(stiffness_n_per_m / 1000),
      place_(start_mm),
      playback_(std::move(playback)) {}

DeviceSample FollowingHand::read(std::uint64_t tick, double dt_s, Vec3 force_n) noexcept {
  place_ += (device_.position_mm() - place_) * (dt_s / kYieldS);
  device_.set_hand(push_n, place_, stiffness_n_per_mm_);
  DeviceSample sample = device_.read(tick, dt_s, force_n);
  const DeviceSample& recorded = playback_->lesson->hands.front()[playback_->clock.sample()];
  sample.tool = recorded.tool;
  sample.axis = recorded.axis;
  sample.pedal = playback_->clock.started() && !playback_->clock.ended() ? recorded.pedal : std::uint8_t{0};
  return sample;
}

GuidedFacts measure_guided(const SessionReader& session, std::uint64_t begin_tick) {
  GuidedFacts f;
  const HapticSetup& setup = session.header().haptics;
  const double dt = 1 / session.header().rate_hz;
  GuideLaw law;
  TickRecord own, leader_before, own_before;
  bool has_before = false;
  double squares = 0;
  std::vector<float> errors;
  auto parts = session.parts();
  while (const SessionPart* const part = parts.next()) {
    for (const SceneAction& a : part->actions) {
      if (a.is(ActionKind::guide)) law.set(guide_of(a), setup.device, setup.params.guard.contact_damping_n_s_per_m, dt);
    }
    for (const TickRecord& t : part->ticks) {
      if (t.hand == 0) own = t;
      if (t.hand != 1) continue;
      const Vec3 at = from_floats(own.device.position_mm);
      const GuideLaw::Hand hand{has_before && own_before.structure != 0 ? own_before.clearance_mm : 1e9F};
      const Vec3 pull =
          law.guide().on() ? law.step(at, hand, t.device, from_floats(leader_before.force_n), dt) : Vec3{};
      if (t.tick >= begin_tick && (t.device.buttons & kLeadStrength) != 0) {
        const double e = length(from_floats(t.device.position_mm) - at);
        errors.push_back(static_cast<float>(e));
        squares += e * e;
        f.most_pull_n = std::max(f.most_pull_n, length(pull));
        if (has_before) f.work_mj += dot(pull, at - from_floats(own_before.device.position_mm));
        f.most_work_mj = std::max(f.most_work_mj, f.work_mj);
        f.guided_s += (own.flags & kGuided) != 0 ? dt : 0;
        f.capped_s += (own.flags & kForceCapped) != 0 ? dt : 0;
      }
      own_before = own;
      leader_before = t;
      has_before = true;
    }
  }
  f.ticks = errors.size();
  if (errors.empty()) return f;
  f.rms_mm = std::sqrt(squares / static_cast<double>(errors.size()));
  f.most_mm = static_cast<double>(*std::max_element(errors.begin(), errors.end()));
  f.p95_mm = static_cast<double>(value_at_share(std::move(errors), 0.95));
  return f;
}

}  // namespace osteo::inline network
