#include "osteo/session/scene/sound.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "osteo/core/base/error.h"
#include "osteo/core/base/portable_math.h"
#include "osteo/simulation/bone/instrument.h"
#include "osteo/simulation/sound/wav.h"

namespace osteo::inline session {
namespace {

static_assert(kMaxHands == SoundState::kMaxVoices);

// How long water takes to fill a cavity, to be sucked off, and to run off by itself: designed for the ear.
constexpr double kFillS = 1, kSuckS = 1.5, kRunOffS = 20;
constexpr double kSoftReachMm = 2;          // beneath the burr
constexpr double kThicknessSmoothS = 0.03;  // a ray that meets a hole for a tick is no thin bone
constexpr double kTouchN = 1,
                 kTouchEveryS =
                     0.005;      // of two instruments: they do not push each other, so this is designed for the ear
constexpr double kAlarmS = 0.4;  // goes on so long behind the last touch, so that a beep is whole

}  // namespace

std::set<std::uint32_t> soft_structures(std::span<const Structure> structures) {
  std::set<std::uint32_t> soft;
  for (const Structure& s : structures) {
    std::string name = s.name;
    std::transform(name.begin(), name.end(), name.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    for (const char* const word : {"sinus", "dura", "vein", "artery", "bulb"}) {
      if (name.find(word) != std::string::npos) soft.insert(s.value);
    }
  }
  return soft;
}

SoundTracker::SoundTracker(std::set<std::uint32_t> soft, double rate_hz, bool alarms)
    : soft_(std::move(soft)), rate_hz_(rate_hz), alarms_(alarms) {
  static_cast<void>(instrument_library());  // made here, not in take()
}

void SoundTracker::take(const SceneAction& action) noexcept {
  if (action.is(ActionKind::suction)) standing_suction_ = action.values[4] > 0;
  if (action.is(ActionKind::irrigate)) standing_water_ = action.values[4] > 0;
}

// Of any two hands, as of the tick before; looked at every few milliseconds.
bool SoundTracker::instruments_touch(std::uint64_t tick) noexcept {
  const auto every = static_cast<std::uint64_t>(std::max(1.0, kTouchEveryS * rate_hz_));
  if (tick % every != 0) return touching_;
  touching_ = false;
  const auto place = [&](std::size_t hand) {
    const TickRecord& t = last_[hand];
    return InstrumentPlace{&instrument_of(t.device.tool),
                           from_floats(t.device.position_mm) + from_floats(t.shown_offset_mm),
                           normalized(from_floats(t.device.axis))};
  };
  for (std::size_t a = 0; a < kMaxHands; ++a) {
    for (std::size_t b = a + 1; b < kMaxHands; ++b) {
      if (has_[a] && has_[b] && gap_between(place(a), place(b)).gap_mm < 0) touching_ = true;
    }
  }
  return touching_;
}

void SoundTracker::take(const TickRecord& record) noexcept {
  if (record.hand >= kMaxHands) return;
  const Instrument& instrument = instrument_of(record.device.tool);
  SoundVoice& voice = state_.voices[record.hand];
  double& thickness = thickness_mm_[record.hand];
  const bool plate = (record.flags & kPlateInHand) != 0;
  const double dt = 1 / rate_hz_, pedal = record.device.pedal / 255.0;
  voice = {};
  const Burr* const edge = plate ? nullptr : instrument.cutter();
  if (edge != nullptr) {
    voice.kind = SoundKind::burr;
    voice.edge_db = row_of(edge->kind).sound_db;
    voice.teeth_share = row_of(edge->kind).sound_teeth_share;
    voice.speed_rpm = record.speed_rpm * instrument.speed_share;  // a saw sounds at its strokes
    voice.diameter_mm = edge->diameter_mm;
    voice.press_n = record.normal_force_n;
    if (record.normal_force_n > 0 && record.thickness_mm > 0) {
      thickness = thickness > 0 ? thickness + (record.thickness_mm - thickness) * std::min(1.0, dt / kThicknessSmoothS)
                                : record.thickness_mm;
    } else if (record.normal_force_n <= 0) {
      thickness = 0;
    }
    voice.thickness_mm = thickness;
    if (soft_.contains(record.structure)) voice.softness = std::clamp(1 - record.clearance_mm / kSoftReachMm, 0.0, 1.0);
  } else if (!plate && instrument.kind == InstrumentKind::sucker) {
    voice.kind = SoundKind::sucker;
    voice.diameter_mm = 2 * instrument.head.start_radius_mm;
    voice.draws = pedal;
  } else if (!plate && instrument.kind == InstrumentKind::irrigator) {
    voice.kind = SoundKind::irrigator;
    voice.draws = pedal;
  }
  if (record.hand == 0) {
    // A sucker and water without a hand stand beside the burr: heard in the last voices, where no hand is.
    SoundVoice& beside = state_.voices[kMaxHands - 1];
    SoundVoice& water = state_.voices[kMaxHands - 2];
    if (beside.kind == SoundKind::silent || beside.kind == SoundKind::sucker) beside = {};
    if (standing_suction_) beside = {SoundKind::sucker, 0, 8.0 / 3, 0, 0, 0, 1};
    if (water.kind == SoundKind::irrigator) water = {};
    if (standing_water_ && water.kind == SoundKind::silent) water = {SoundKind::irrigator, 0, 2, 0, 0, 0, 1};

    bool wets = false, sucks = false;
    for (const SoundVoice& v : state_.voices) {
      wets = wets || (v.kind == SoundKind::irrigator && v.draws > 0);
      sucks = sucks || (v.kind == SoundKind::sucker && v.draws > 0);
    }
    double& w = state_.water;
    w += (wets ? (1 - w) * dt / kFillS : 0) - (sucks ? w * dt / kSuckS : 0) - w * dt / kRunOffS;
    state_.metal_n = instruments_touch(record.tick) ? kTouchN : 0;
  }
  last_[record.hand] = record;
  has_[record.hand] = !plate;
  if (plate) state_.metal_n = std::max(state_.metal_n, static_cast<double>(record.normal_force_n));
  const auto lasts = static_cast<std::uint64_t>(kAlarmS * rate_hz_);
  if ((record.flags & kStructureTouched) != 0) touched_until_ = record.tick + lasts;
  if ((record.flags & kStructureInjured) != 0) injured_until_ = record.tick + lasts;
  state_.alarm = !alarms_                       ? SoundAlarm::none
                 : record.tick < injured_until_ ? SoundAlarm::injured
                 : record.tick < touched_until_ ? SoundAlarm::touched
                                                : SoundAlarm::none;
}

// --- live

namespace {

constexpr std::size_t kTicksAtOnce = 256, kChangesAtOnce = 4096, kActionsAtOnce = 64;
constexpr double kSilentAfterS = 0.1;  // without ticks

std::set<std::uint32_t> soft_structures_of(const Rehearsal& rehearsal) {
  return rehearsal.structures() == nullptr ? std::set<std::uint32_t>()
                                           : soft_structures(rehearsal.structures()->structures());
}

}  // namespace

LiveSound::LiveSound(Rehearsal& rehearsal, bool alarms, double volume)
    : stream_(rehearsal.stream()),
      from_(stream_.add_reader(1 << 12, 1 << 16)),
      tracker_(soft_structures_of(rehearsal), rehearsal.rate_hz(), alarms),
      ticks_(kTicksAtOnce),
      changes_(kChangesAtOnce),
      actions_(kActionsAtOnce),
      volume_(volume),
      alarms_(alarms) {}

LiveSound::~LiveSound() {
  stream_.remove_reader(from_);
}

void LiveSound::fill(std::span<float> out) noexcept {
  tracker_.set_alarms(alarms_.load(std::memory_order_relaxed));
  // At most what the rings hold: the servo is far slower than this, but the loops must end.
  for (int i = 0; i < 1024 && from_.changes.pop(changes_) == changes_.size(); ++i) {
  }
  for (std::size_t n = actions_.size(), i = 0; n == actions_.size() && i < 64; ++i) {
    n = from_.actions.pop(actions_);
    for (std::size_t a = 0; a < n; ++a) tracker_.take(actions_[a]);
  }
  std::size_t ticks = 0;
  for (std::size_t n = ticks_.size(), i = 0; n == ticks_.size() && i < 64; ++i) {
    n = from_.ticks.pop(ticks_);
    for (std::size_t t = 0; t < n; ++t) tracker_.take(ticks_[t]);
    ticks += n;
  }
  without_ticks_s_ = ticks > 0 ? 0 : without_ticks_s_ + static_cast<double>(out.size()) / Synthesizer::kRateHz;
  synthesizer_.render(without_ticks_s_ > kSilentAfterS ? SoundState{} : tracker_.state(),
                      volume_.load(std::memory_order_relaxed), out);
}

// --- to a file

SoundFileFacts write_session_sound(const SessionReader& session, const std::set<std::uint32_t>& soft, double volume,
                                   bool alarms, const std::filesystem::path& out, const Context& context) {
  const SessionOutline& outline = session.outline();
  const double samples_per_tick = Synthesizer::kRateHz / outline.header.rate_hz;
  const double all = std::max<double>(
      1, static_cast<double>(outline.tick_records) / static_cast<double>(outline.header.haptics.hands()));
  SoundFileFacts facts;
  facts.gaps = outline.gaps.size();
  Synthesizer synthesizer;
  SoundTracker tracker(soft, outline.header.rate_hz, alarms);
  auto parts = session.parts();
  std::uint64_t samples_made = 0;
  double loudest = 0;
  std::vector<SceneAction> waiting;
  write_wav(out, Synthesizer::kRateHz, [&](std::vector<float>& samples) {
    const auto until = [&](std::uint64_t tick, bool silent) {
      const auto wanted = static_cast<std::uint64_t>(static_cast<double>(tick) * samples_per_tick);
      while (samples_made + Synthesizer::kBlock <= wanted) {
        const std::size_t at = samples.size();
        samples.resize(at + Synthesizer::kBlock);
        synthesizer.render(silent ? SoundState{} : tracker.state(), volume, std::span(samples).subspan(at));
        samples_made += Synthesizer::kBlock;
      }
    };
    const SessionPart* const part = parts.next();
    if (part == nullptr) return false;
    waiting.insert(waiting.end(), part->actions.begin(), part->actions.end());
    if (part->gap != nullptr) {
      until(part->gap->first_tick, false);
      until(part->gap->first_tick + part->gap->ticks, true);
    }
    for (const TickRecord& r : part->ticks) {
      if (r.hand == 0) until(r.tick, false);
      while (!waiting.empty() && waiting.front().tick <= r.tick) {
        tracker.take(waiting.front());
        waiting.erase(waiting.begin());
      }
      tracker.take(r);
    }
    for (const float s : samples) loudest = std::max(loudest, std::abs(static_cast<double>(s)));
    facts.most_held_down_db = std::min(facts.most_held_down_db, synthesizer.held_down_db());
    context.progress(std::min(1.0, static_cast<double>(samples_made) / samples_per_tick / all), "sound");
    return true;
  });
  facts.seconds = static_cast<double>(samples_made) / Synthesizer::kRateHz;
  if (loudest > 0) facts.loudest_db = 20 * portable::log(loudest) / portable::log(10);
  return facts;
}

}  // namespace osteo::inline session
