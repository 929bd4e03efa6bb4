#include "osteo/session/scene/monitor_reader.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "osteo/core/base/error.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/param.h"
#include "osteo/simulation/bone/instrument.h"

namespace osteo::inline session {
namespace {

constexpr double kReachMm = 12;           // beyond it no tool matters to a nerve
constexpr double kRayStepMm = 0.1;        // along which bone is added up
constexpr double kTouchesMm = 0.1;        // a tip nearer than that to a nerve gives it its current
constexpr double kMovesMmPerS = 0.5;      // slower is at rest
constexpr std::uint64_t kWarmEvery = 10;  // steps

}  // namespace

std::vector<std::string> MonitorWiring::labels() const {
  std::vector<std::string> all;
  for (const auto& c : channels) all.push_back(c.electrode.name);
  return all;
}

MonitorWiring wire_monitor(const MonitorSetup& setup, const StructureMap* map) {
  MonitorWiring wiring;
  for (const MonitoredNerve& nerve : setup.nerves) {
    bool found = false;
    for (std::size_t word = 0; word < nerve.structures.size() && !found && map != nullptr; ++word) {
      for (std::size_t n = 0; n < map->values().size() && !found; ++n) {
        const std::string name = map->name_of(map->values()[n]);
        if (lower_case(name) != nerve.structures[word]) continue;
        NerveCourse course = course_of(map->face(n), nerve.distal, name);
        if (course.points.empty()) continue;
        for (const MonitorChannel& c : nerve.channels) wiring.channels.push_back({wiring.courses.size(), c});
        wiring.courses.push_back(std::move(course));
        wiring.structures.push_back(map->values()[n]);
        found = true;
      }
    }
    if (!found) wiring.left_out.push_back(nerve.structures.front());
  }
  return wiring;
}

MonitorReader::MonitorReader(const MonitorOptions& options, const StructureMap* structures, double rate_hz)
    : options_(options),
      structures_(structures),
      rate_hz_(rate_hz),
      every_(static_cast<std::uint64_t>(std::max(1.0, std::floor(kStepS * rate_hz + 0.5)))),
      wiring_(wire_monitor(options.setup, structures)),
      model_(options.setup.constants, wiring_.courses, options.setup.seed),
      signal_(options.setup.constants, wiring_.channels, options.setup.seed),
      detector_(options.setup.constants, wiring_.channels.size()) {
  if (wiring_.channels.size() > MonitorSetup::kMaxChannels)
    throw Error(ExitCode::usage, "a monitor has at most " + std::to_string(MonitorSetup::kMaxChannels) + " channels");
  for (const NerveCourse& c : wiring_.courses) doses_.emplace_back(c.points.size());
}

MonitorReader::~MonitorReader() = default;

std::uint64_t MonitorReader::sample_of(std::uint64_t tick) const {
  return static_cast<std::uint64_t>(static_cast<double>(tick) * MonitorSetup::kRateHz / rate_hz_);
}

void MonitorReader::resync(const World& world) {
  if (wiring_.channels.empty()) return;
  applied_early_ += pending_;
  pending_ = 0;
  world_.emplace(world.copy());
  if (begun_) ++restarts_;
  if (!options_.heat) return;
  if (heat_) {
    heat_->resync(world);
  } else {
    heat_ = std::make_unique<HeatReader>(world, structures_, rate_hz_);
  }
}

void MonitorReader::scene_changed(const World& world, const World::Effect& effect) {
  ++pending_;
  if (heat_) heat_->scene_changed(world, effect);
}

void MonitorReader::action(const SceneAction& action) {
  if (heat_) heat_->action(action);
  if (!world_) return;
  if (row_of(action).changes_world) {
    if (applied_early_ > 0) {  // the copy was taken behind it
      --applied_early_;
      return;
    }
    if (pending_ > 0) --pending_;
  }
  if (!row_of(action).by_servo) world_->act(action);
  world_->notify(action);
}

void MonitorReader::tick(const TickRecord& record, std::span<const VoxelChange> changes) {
  if (wiring_.channels.empty()) return;
  if (record.hand == 0) {
    if (!begun_) {
      begun_ = true;
      step_tick_ = record.tick;
      sample_ = sample_of(record.tick);
    } else if (record.tick != next_tick_) {
      MonitorEvent e;
      e.kind = MonitorEventKind::lost;
      e.seconds = static_cast<double>(record.tick - next_tick_) / rate_hz_;
      if (next_tick_ > step_tick_) step(next_tick_);
      e.sample = sample_;
      notify(e);
      step_tick_ = record.tick;
      sample_ = sample_of(record.tick);
    }
    next_tick_ = record.tick + 1;
    if (record.tick - step_tick_ >= every_) step(record.tick);
  }
  if (heat_) heat_->tick(record, changes);
  if (world_ && !changes.empty()) {
    for (const VoxelChange& c : changes) {
      if (const PlacedBody* const b = world_->owner(c.voxel))
        b->body->bone.set(c.voxel - b->body->name_of(0), c.density);
    }
    world_->notify(changes);
  }
  if (record.hand >= kMaxHands) return;
  Hand& hand = hands_[record.hand];
  hand.seen = (record.flags & (kPlateInHand | kPoseInvalid)) == 0;
  const bool cutter = instrument_of(record.device.tool).cutter() != nullptr;
  const double press = cutter ? static_cast<double>(record.normal_force_n) : length(from_floats(record.force_n));
  hand.press_n = std::max(hand.press_n, press);
  hand.turns = cutter && record.speed_rpm > 0;
  hand.touches = hand.touches || press > 0 || record.immersed > 0;
  if (hand.seen) hand.last = record;
}

void MonitorReader::stimulate(const StimulatorSetting& setting) {
  const std::lock_guard lock(mutex_);
  waiting_.push_back(setting);
}

void MonitorReader::take_settings() {
  {
    const std::lock_guard lock(mutex_);
    for (const StimulatorSetting& s : waiting_) settings_.emplace_back(step_tick_, s);
    waiting_.clear();
  }
  while (!settings_.empty() && settings_.front().first <= step_tick_) {
    stimulator_.set(settings_.front().second);
    settings_.pop_front();
    const StimulatorSetting& s = stimulator_.setting();
    MonitorEvent e;
    e.kind = MonitorEventKind::stimulator;
    e.sample = sample_;
    e.tick = step_tick_;
    e.hand = s.hand;
    e.ma = s.current_ma;
    e.pulses_per_s = s.pulses_per_s;
    e.width_ms = s.width_ms;
    e.search = s.search;
    notify(e);
  }
}

double MonitorReader::bone_between(Vec3 from_mm, Vec3 to_mm) const {
  const double way = length(to_mm - from_mm);
  const auto steps = static_cast<int>(std::ceil(way / kRayStepMm));
  if (!world_ || steps <= 0) return 0;
  double sum = 0;
  for (int i = 0; i < steps; ++i)
    sum += static_cast<double>(world_->nearest(from_mm + (to_mm - from_mm) * ((static_cast<double>(i) + 0.5) / steps)));
  return sum * way / steps;
}

// Along the line from the tool's surface to the nearest point of each nerve's course.
void MonitorReader::find_nearest(const TickRecord& record, std::vector<Nearest>& all) const {
  all.clear();
  const Instrument& held = instrument_of(record.device.tool);
  const Vec3 axis = from_floats(record.device.axis), start = from_floats(record.device.position_mm) +
                                                             from_floats(record.shown_offset_mm) +
                                                             axis * held.head.start_mm;
  std::vector<double> clearance;
  for (std::size_t n = 0; n < wiring_.courses.size(); ++n) {
    const NerveCourse& course = wiring_.courses[n];
    double least = std::numeric_limits<double>::max();
    std::size_t nearest = 0;
    double foot_mm = 0;
    for (std::size_t p = 0; p < course.points.size(); ++p) {
      const Vec3 to = course.points[p].at_mm - start;
      const double along = std::clamp(dot(to, axis), 0.0, held.head.length_mm),
                   d = length(to - axis * along) - held.head.radius_at_mm(along);
      if (d < least) {
        least = d;
        nearest = p;
        foot_mm = along;
      }
    }
    if (least > kReachMm) continue;
    if (clearance.empty()) {
      clearance.resize(structures_->values().size());
      structures_->clearance(held.head, from_floats(record.device.position_mm) + from_floats(record.shown_offset_mm),
                             axis, clearance);
    }
    const auto number = std::find(structures_->values().begin(), structures_->values().end(), wiring_.structures[n]) -
                        structures_->values().begin();
    Nearest found{n, nearest, clearance[static_cast<std::size_t>(number)], 0};
    if (found.clearance_mm >= structures_->reach_mm()) continue;
    const Vec3 on_axis = start + axis * foot_mm, to = course.points[nearest].at_mm - on_axis;
    const double way = length(to);
    const double radius = held.head.radius_at_mm(foot_mm), ends = way - course.points[nearest].radius_mm;
    if (ends > radius && way > 0)
      found.bone_mm = std::min(std::max(0.0, found.clearance_mm),
                               bone_between(on_axis + to * (radius / way), on_axis + to * (ends / way)));
    all.push_back(found);
  }
}

void MonitorReader::warm_up() {
  if (!heat_ || steps_ % kWarmEvery != 0) return;
  if (warmth_.empty() && heat_->warm_bricks() == 0) return;
  warmth_.resize(wiring_.courses.size());
  const double seconds = static_cast<double>(kWarmEvery * every_) / rate_hz_;
  for (std::size_t n = 0; n < wiring_.courses.size(); ++n) {
    NerveModel::Warmth& w = warmth_[n];
    w.celsius.resize(doses_[n].size());
    w.cem43_min.resize(doses_[n].size());
    for (std::size_t p = 0; p < doses_[n].size(); ++p) {
      w.celsius[p] = heat_->celsius_at(wiring_.courses[n].points[p].at_mm);
      doses_[n][p].stay(w.celsius[p], seconds);
      w.cem43_min[p] = doses_[n][p].coagulated ? std::numeric_limits<double>::infinity() : doses_[n][p].cem43_min;
    }
  }
}

void MonitorReader::notify(MonitorEvent event) {
  for (MonitorSink* const s : sinks_) s->event(event);
}

void MonitorReader::pulse(std::uint64_t first, std::size_t samples) {
  const StimulatorSetting& s = stimulator_.setting();
  if (s.hand >= kMaxHands) return;
  Hand& hand = hands_[s.hand];
  bool touches = hand.touches;
  for (const Nearest& n : nearest_[s.hand]) touches = touches || n.clearance_mm <= kTouchesMm;
  const std::optional<std::uint64_t> at = stimulator_.pulse(first, samples, touches && hand.seen);
  if (!at) return;
  const double ma = stimulator_.current_ma();
  const auto offset = static_cast<std::size_t>(*at - first);
  signal_.stimulate(offset, ma);
  for (const Nearest& n : nearest_[s.hand]) {
    const double soft = std::max(0.0, n.clearance_mm - n.bone_mm);
    const double threshold = stimulus_threshold_ma(options_.setup.constants, soft, n.bone_mm, s.width_ms);
    signal_.answer(offset, model_, n.nerve, n.point, model_.answer(n.nerve, n.point, ma, threshold));
  }
  detector_.stimulus(*at, ma);
  MonitorEvent e;
  e.kind = MonitorEventKind::stimulus;
  e.sample = *at;
  e.ma = ma;
  notify(e);
}

void MonitorReader::step(std::uint64_t until_tick) {
  const std::uint64_t end = sample_of(until_tick);
  const double dt = static_cast<double>(until_tick - step_tick_) / rate_hz_;
  const auto samples = static_cast<std::size_t>(end - sample_);
  take_settings();
  stresses_.clear();
  DrillNoise drill;
  for (std::size_t h = 0; h < kMaxHands; ++h) {
    Hand& hand = hands_[h];
    nearest_[h].clear();
    if (!hand.seen) continue;
    find_nearest(hand.last, nearest_[h]);
    if (hand.turns) {
      drill.rotation_hz = std::max(drill.rotation_hz, static_cast<double>(hand.last.speed_rpm) / 60);
      drill.press_n += hand.press_n;
    }
    const Vec3 at = from_floats(hand.last.device.position_mm);
    const bool moves = length(at - hand.was_mm) > kMovesMmPerS * dt;
    hand.was_mm = at;
    for (const Nearest& n : nearest_[h]) {
      const bool on_sheath =
          n.clearance_mm <= options_.setup.constants.sheath_mm && n.bone_mm <= options_.setup.constants.sheath_mm;
      stresses_.push_back({n.nerve, n.point, n.clearance_mm, n.bone_mm, hand.press_n,
                           (hand.turns && (hand.press_n > 0 || on_sheath)) || (on_sheath && moves), hand.turns});
    }
  }
  warm_up();
  model_.step(dt, stresses_, warmth_);
  for (const NerveModel::Happening& happening : model_.happenings()) {
    MonitorEvent e;
    e.kind = MonitorEventKind::cause;
    e.sample = sample_;
    e.nerve = static_cast<int>(happening.nerve);
    e.cause = happening.cause;
    e.integrity = happening.integrity;
    e.to_distal_mm = wiring_.courses[happening.nerve].points[happening.point].to_distal_mm;
    notify(e);
  }
  pulse(sample_, samples);
  for (Hand& hand : hands_) {
    hand.press_n = 0;
    hand.touches = false;
  }
  block_.resize(samples * wiring_.channels.size());
  signal_.render(model_, drill, block_);
  const MonitorBlock block{sample_, wiring_.channels.size(), block_};
  detector_.take(sample_, block_);
  for (MonitorSink* const s : sinks_) {
    s->block(block);
    for (const MonitorSpike& spike : detector_.spikes()) s->spike(spike);
    for (const MonitorEvent& e : detector_.events()) s->event(e);
  }
  if (const std::optional<bool> answer = detector_.take_answer()) {
    if (const auto found = stimulator_.take(*answer)) {
      MonitorEvent e;
      e.kind = found->threshold_ma ? MonitorEventKind::threshold : MonitorEventKind::no_threshold;
      e.sample = end;
      e.ma = found->threshold_ma.value_or(StimulatorSetting::kMaxMa);
      notify(e);
    }
  }
  sample_ = end;
  step_tick_ = until_tick;
  ++steps_;
}

void MonitorReader::end() {
  if (begun_ && next_tick_ > step_tick_) step(next_tick_);
  detector_.end();
  for (const MonitorEvent& e : detector_.events()) notify(e);
}

std::string stimulator_note(const MonitorEvent& e) {
  return Json{{"at_tick", e.tick},      {"hand", e.hand},    {"current_ma", e.ma}, {"pulses_per_s", e.pulses_per_s},
              {"width_ms", e.width_ms}, {"search", e.search}}
      .dump();
}

std::vector<std::pair<std::uint64_t, StimulatorSetting>> stimulator_notes(const SessionReader& session,
                                                                          std::size_t& unreadable) {
  std::vector<std::pair<std::uint64_t, StimulatorSetting>> all;
  auto parts = session.parts();
  while (const SessionPart* const part = parts.next()) {
    for (const Note& note : part->notes) {
      if (note.kind != kStimulatorNote) continue;
      const auto j = Json::parse(note.json);
      const auto number = [&](const char* key) -> std::optional<double> {
        const Json* const v = j ? j->find(key) : nullptr;
        return v == nullptr ? std::nullopt : v->number();
      };
      const auto tick = number("at_tick"), hand = number("hand"), ma = number("current_ma"),
                 rate = number("pulses_per_s"), width = number("width_ms");
      const Json* const search = j ? j->find("search") : nullptr;
      if (!tick || !hand || !ma || !rate || !width || search == nullptr || !(*tick >= 0 && *tick < 1e15) ||
          !(*hand >= 0 && *hand < kMaxHands)) {
        ++unreadable;
        continue;
      }
      StimulatorSetting s;
      s.hand = static_cast<std::uint32_t>(*hand);
      s.current_ma = *ma;
      s.pulses_per_s = *rate;
      s.width_ms = *width;
      s.search = *search == Json(true);
      all.emplace_back(static_cast<std::uint64_t>(*tick), s);
    }
  }
  std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  return all;
}

std::string words_of(const MonitorEvent& e, const MonitorWiring& wiring) {
  const auto whole = [](double x) { return std::to_string(static_cast<long>(std::floor(x + 0.5))); };
  const auto hundredths = [](double x) { return format_number(std::floor(x * 100 + 0.5) / 100); };
  std::string words(name_of(e.kind));
  if (e.channel >= 0 && static_cast<std::size_t>(e.channel) < wiring.channels.size())
    words += ", " + wiring.channels[static_cast<std::size_t>(e.channel)].electrode.name;
  if (e.nerve >= 0 && static_cast<std::size_t>(e.nerve) < wiring.courses.size())
    words += ", " + wiring.courses[static_cast<std::size_t>(e.nerve)].name;
  switch (e.kind) {
    case MonitorEventKind::activity:
      return words + ", " + whole(e.uv) + " uV";
    case MonitorEventKind::burst:
    case MonitorEventKind::train:
      return words + ", " + whole(1000 * e.seconds) + " ms, " + whole(e.uv) + " uV";
    case MonitorEventKind::stimulus:
    case MonitorEventKind::no_response:
    case MonitorEventKind::threshold:
      return words + ", " + hundredths(e.ma) + " mA";
    case MonitorEventKind::no_threshold:
      return "no threshold up to " + hundredths(e.ma) + " mA";
    case MonitorEventKind::response:
      return words + ", " + hundredths(e.ma) + " mA: " + whole(e.uv) + " uV after " + hundredths(e.ms) + " ms";
    case MonitorEventKind::stimulator:
      return e.ma <= 0
                 ? "stimulator off"
                 : (e.search ? "stimulator looks for the threshold from " : "stimulator ") + hundredths(e.ma) + " mA";
    case MonitorEventKind::cause:
      return words + ": " + std::string(name_of(e.cause)) +
             (e.integrity < 1 ? ", " + whole(100 * e.integrity) + " % whole there" : "");
    case MonitorEventKind::lost:
      return hundredths(e.seconds) + " s lost";
  }
  return words;
}

}  // namespace osteo::inline session
