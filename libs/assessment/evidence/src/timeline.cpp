#include "osteo/assessment/evidence/timeline.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "osteo/assessment/evidence/detail/process.h"
#include "osteo/assessment/evidence/frames.h"
#include "osteo/core/base/translate.h"
#include "osteo/simulation/bone/instrument.h"
#include "osteo/simulation/haptics/saw_slot.h"

namespace osteo::inline assessment {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

double second_of(std::uint64_t tick, double rate_hz) {
  return static_cast<double>(tick) / rate_hz;
}
// Multiplied first, so that a whole number of samples stays whole.
std::size_t sample_of(std::uint64_t tick, double rate_hz) {
  return static_cast<std::size_t>(static_cast<double>(tick) * Timeline::kRateHz / rate_hz);
}

// Four digits that count: what a chart can show.
Json short_number(float x) {
  if (!std::isfinite(x)) return {};
  if (x == 0) return 0;
  const double v = static_cast<double>(x), scale = std::pow(10, 3 - std::floor(std::log10(std::abs(v))));
  return std::round(v * scale) / scale;
}
Json numbers(const std::vector<float>& values) {
  Json list = Json::list();
  for (const float v : values) list.push_back(short_number(v));
  return list;
}

std::string in_english(const TimelineEvent& e) {
  return filled(e.text, {{"part", e.part}});
}

}  // namespace

std::string_view name_of(EventKind kind) {
  static constexpr std::array<std::string_view, 10> kNames{"injury", "touch", "undo",  "instrument", "saw",
                                                           "split",  "move",  "plate", "note",       "gap"};
  return kNames[static_cast<std::size_t>(kind)];
}

TimelineKeeper::TimelineKeeper(const EvidenceScene& scene) : scene_(scene), motion_(scene.rate_hz) {
  if (scene_.structures == nullptr) return;
  const std::size_t n = scene_.structures->values().size();
  each_.resize(n);
  for (Hand& hand : hands_) {
    hand.touch.resize(n);
    hand.injury.resize(n);
  }
  for (std::size_t s = 0; s < n; ++s) {
    watched_.push_back(scene_.opens(s) ? 0 : 1);
    line_.structure_names[scene_.structures->values()[s]] = scene_.structures->name_of(scene_.structures->values()[s]);
  }
}

std::size_t TimelineKeeper::sample_at(std::uint64_t tick) {
  const std::size_t n = sample_of(tick, scene_.rate_hz);
  if (n >= line_.size()) {
    const std::size_t size = n + 1;
    for (auto* const bytes : {&line_.known, &line_.drilling, &line_.structure}) bytes->resize(size, 0);
    // The instrument lasts until another comes.
    line_.tool.resize(size, line_.tool.empty() ? std::uint8_t{0} : line_.tool.back());
    for (auto* const values : {&line_.force_n, &line_.speed_mm_s, &line_.removed_mm3}) values->resize(size, 0);
    speeds_known_.resize(size, 0);
    line_.distance_mm.resize(size, kNan);
    line_.at_mm.resize(size, line_.at_mm.empty() ? std::array<float, 3>{} : line_.at_mm.back());
  }
  return n;
}

std::string TimelineEvent::shown() const {
  // Messages of the window are kept in English. Those that hold no value are found in the catalogue again.
  if (text == nullptr) return kind == EventKind::note ? tr(what) : what;
  if (kind == EventKind::instrument) return filled(tr(text), {{"part", tr_sized(part)}});
  if (kind == EventKind::injury || kind == EventKind::touch) return filled(tr(text), {{"part", tr(part)}});
  const bool figure = part.find_first_not_of("0123456789.") == std::string::npos;
  return filled(tr(text), {{"part", figure ? shown_figures(part) : part}});
}

std::size_t TimelineKeeper::add(TimelineEvent event) {
  if (line_.events.size() >= Timeline::kMaxEvents) {
    ++line_.events_left_out;
    return Timeline::kMaxEvents;
  }
  if (event.text != nullptr) event.what = in_english(event);
  line_.events.push_back(std::move(event));
  return line_.events.size() - 1;
}

void TimelineKeeper::near(const EvidenceFrame& f, const TickRecord& t, std::size_t sample) {
  if (scene_.structures == nullptr || (t.flags & kPlateInHand) != 0) return;
  const Instrument& tool = instrument_of(t.device.tool);
  if (tool.cutter() == nullptr) return;
  const RigidTransform own = f.world.bodies().front().world_from_body.inverse();
  const Vec3 at = own(from_floats(t.device.position_mm) + from_floats(t.shown_offset_mm));
  scene_.structures->clearance(tool.head, at, own.rotation * tool_axis(t, f.world.cutting_guide(t.hand)), each_);
  const bool turns = static_cast<double>(t.speed_rpm) > kTurnsRpm, saw = tool.kind == InstrumentKind::saw;
  const double t_s = second_of(t.tick, f.rate_hz);
  for (std::size_t s = 0; s < each_.size(); ++s) {
    if (watched_[s] == 0) continue;
    const std::uint8_t value = scene_.structures->values()[s];
    const auto d = static_cast<float>(each_[s]);
    if (each_[s] < scene_.structures->reach_mm() && !(line_.distance_mm[sample] <= d)) {
      line_.distance_mm[sample] = d;
      line_.structure[sample] = value;
    }
    if (d > 0) continue;
    Near& now = turns ? hands_[t.hand].injury[s] : hands_[t.hand].touch[s];
    if (!now.contact.begins(t.tick, f.rate_hz, kSameContactS)) {
      if (now.event < line_.events.size()) line_.events[now.event].end_s = t_s;
    } else {
      const std::string name = scene_.structures->name_of(value);
      now.event = add({turns ? EventKind::injury : EventKind::touch,
                       t_s,
                       t_s,
                       {},
                       name,
                       true,
                       at,
                       turns ? (saw ? tr_later("the running saw reached the {part}")
                                    : tr_later("a rotating burr reached the {part}"))
                             : (saw ? tr_later("the saw, at rest, touched the {part}")
                                    : tr_later("the burr, at rest, touched the {part}")),
                       name});
    }
  }
}

void TimelineKeeper::act(const SceneAction& a, double rate_hz) {
  const double t_s = second_of(a.tick, rate_hz);
  const auto placed = [&](EventKind kind, const char* text, Vec3 at) {
    add({kind, t_s, t_s, {}, {}, true, at, text, {}});
  };
  if (a.is(ActionKind::undo)) {
    add({EventKind::undo, t_s, t_s, {}, {}, false, {}, tr_later("a step was taken back"), {}});
  } else if (a.is(ActionKind::saw)) {
    placed(EventKind::saw, tr_later("saw cut"), a.saw_cut().at_mm);
  } else if (a.is(ActionKind::split)) {
    add({EventKind::split, t_s, t_s, {}, {}, false, {}, tr_later("what is not connected was separated"), {}});
  } else if (a.is(ActionKind::attach)) {
    placed(EventKind::plate, tr_later("a plate was fixed"), a.transform().shift_mm);
  } else if (a.is(ActionKind::detach)) {
    add({EventKind::plate, t_s, t_s, {}, {}, false, {}, tr_later("a plate was taken off"), {}});
  } else if (a.is(ActionKind::open) || a.is(ActionKind::move)) {
    // They come many times a second while something is wound or pulled: one event for as long as that goes on.
    const bool move = a.is(ActionKind::move);
    TimelineEvent e{move ? EventKind::move : EventKind::plate, t_s, t_s, {}, {}, false, {}};
    e.text = move ? tr_later("piece {part} was moved") : tr_later("a distractor was opened to {part} mm");
    e.part = move ? std::to_string(a.body) : format_number(std::round(a.values[0] * 100) / 100);
    const auto last = last_slow_.find({a.kind, move ? a.body : a.item});
    if (last != last_slow_.end() && last->second < line_.events.size() && t_s - line_.events[last->second].end_s < 1) {
      line_.events[last->second].end_s = t_s;
      line_.events[last->second].part = e.part;
      line_.events[last->second].what = in_english(e);
    } else {
      last_slow_[{a.kind, move ? a.body : a.item}] = add(std::move(e));
    }
  }
}

void TimelineKeeper::frame(const EvidenceFrame& f) {
  for (const SceneAction& a : f.actions) act(a, f.rate_hz);
  if (f.lost_before > 0) {
    motion_.forget();
    for (Hand& hand : hands_) {
      for (auto* const all : {&hand.touch, &hand.injury}) {
        for (Near& n : *all) n.contact.forget();
      }
    }
  }
  for (const TickRecord& t : f.ticks) {
    const std::size_t n = sample_at(t.tick);
    line_.known[n] = 1;
    const Instrument& tool = instrument_of(t.device.tool);
    line_.removed_mm3[n] += t.removed_mm3;
    if (tool.cutter() != nullptr) {
      line_.force_n[n] = std::max(line_.force_n[n], t.normal_force_n);
      if (static_cast<double>(t.speed_rpm) > kTurnsRpm && t.normal_force_n > 0) line_.drilling[n] = 1;
    }
    near(f, t, n);
    if (t.hand != 0) continue;
    const bool plate = (t.flags & kPlateInHand) != 0;
    const int now = plate ? Timeline::kPlate : t.device.tool;
    line_.tool[n] = static_cast<std::uint8_t>(now);
    if (now != last_tool_) {
      const double t_s = second_of(t.tick, f.rate_hz);
      add({EventKind::instrument, t_s, t_s, {}, {}, false, {}, plate ? tr_later("a plate") : "{part}", tool.name});
      last_tool_ = now;
    }
    if ((t.flags & (kPoseInvalid | kPoseJumped)) != 0) {
      motion_.forget();
      continue;
    }
    line_.at_mm[n] = t.device.position_mm;
    motion_.add(t.tick, from_floats(t.device.position_mm));
    // Speeds are summed here and divided by their number when it is asked for.
    if (const auto speed = motion_.speed_mm_s()) {
      const std::size_t then = sample_at(motion_.speed_tick());
      line_.speed_mm_s[then] += static_cast<float>(*speed);
      ++speeds_known_[then];
    }
  }
}

void TimelineKeeper::note(const Note& n) {
  if (n.kind == "camera") return;
  const auto j = Json::parse(n.json);
  const double t_s = second_of(n.tick, scene_.rate_hz);
  TimelineEvent e{EventKind::note, t_s, t_s, {}, {}, false, {}};
  const Json* const text = j ? j->find("text") : nullptr;
  const auto place = [&](const char* key) {
    const Json* const at = j ? j->find(key) : nullptr;
    if (at == nullptr || at->items().size() != 3) return;
    for (std::size_t a = 0; a < 3; ++a) {
      const auto v = at->items()[a].number();
      if (!v || !std::isfinite(*v)) return;
      e.at_mm[a] = *v;
    }
    e.placed = true;
  };
  if (n.kind == "mark") {
    e.text = tr_later("a mark");
  } else if (n.kind == "note") {
    const bool has = text != nullptr && text->text() != nullptr;
    e.text = has ? tr_later("note: {part}") : tr_later("a note");
    if (has) e.part = *text->text();
    place("at_mm");
  } else if (n.kind == "ruler") {
    const Json* const mm = j ? j->find("length_mm") : nullptr;
    const auto v = mm != nullptr ? mm->number() : std::nullopt;
    e.text = v ? tr_later("measured {part} mm") : tr_later("a measurement");
    if (v) e.part = format_number(std::round(*v * 10) / 10);
    place("from_mm");
  } else if (n.kind == "message") {
    e.what = text != nullptr && text->text() != nullptr ? *text->text()
             : j && j->text() != nullptr                ? *j->text()
                                                        : std::string();
    if (e.what.empty()) e.text = tr_later("a message");
  } else {
    return;
  }
  add(std::move(e));
}

void TimelineKeeper::gap(const Gap& g) {
  const double from = second_of(g.first_tick, scene_.rate_hz);
  add({EventKind::gap,
       from,
       from + second_of(g.ticks, scene_.rate_hz),
       {},
       {},
       false,
       {},
       g.bone_lost ? tr_later("not recorded, bone too") : tr_later("not recorded"),
       {}});
}

Timeline TimelineKeeper::timeline(const std::map<VoxelKey, VisibilityMetric::Voxel>& voxels) const {
  Timeline line = line_;
  const std::size_t size = line.size();
  for (std::size_t n = 0; n < size; ++n) line.speed_mm_s[n] /= static_cast<float>(std::max(speeds_known_[n], 1U));
  for (auto* const values : {&line.seen_mm3, &line.hidden_mm3, &line.unknown_mm3}) values->assign(size, 0);
  for (const auto& [name, v] : voxels) {
    const std::size_t n = sample_of(v.tick, scene_.rate_hz);
    if (n >= size) continue;
    (v.seen == VisibilityMetric::Seen::seen     ? line.seen_mm3
     : v.seen == VisibilityMetric::Seen::hidden ? line.hidden_mm3
                                                : line.unknown_mm3)[n] += v.mm3;
  }
  std::stable_sort(line.events.begin(), line.events.end(),
                   [](const TimelineEvent& a, const TimelineEvent& b) { return a.t_s < b.t_s; });
  return line;
}

void report_notes(const SessionReader& session, TimelineKeeper& keeper) {
  auto parts = session.parts();
  while (const SessionPart* const p = parts.next()) {
    for (const Note& n : p->notes) keeper.note(n);
  }
  for (const Gap& g : session.outline().gaps) keeper.gap(g);
}

Timeline read_timeline(const SessionReader& session, World begin, const StructureMap* structures,
                       const Procedure* procedure, const Context& context) {
  const EvidenceScene scene{session.header().rate_hz, structures, procedure};
  TimelineKeeper keeper(scene);
  VisibilityMetric visibility(scene);
  report_notes(session, keeper);
  const World end = report_frames(
      session, std::move(begin),
      [&](const EvidenceFrame& f) {
        keeper.frame(f);
        visibility.frame(f);
      },
      context);
  std::vector<Measured> values;
  std::vector<Moment> moments;
  visibility.finish(end, values, moments);
  return keeper.timeline(visibility.voxels());
}

Json timeline_json(const Timeline& line) {
  Json j{{"osteotome_timeline", 1}, {"rate_hz", Timeline::kRateHz}, {"samples", line.size()}};
  j["structures"] = Json::object();
  for (const auto& [value, name] : line.structure_names) j["structures"][std::to_string(value)] = name;
  j["instruments"] = Json::object();
  for (const std::uint8_t t : line.tool)
    j["instruments"][std::to_string(t)] = t == Timeline::kPlate ? std::string("a plate") : instrument_of(t).name;
  j["known"] = line.known;
  j["drilling"] = line.drilling;
  j["force_n"] = numbers(line.force_n);
  j["speed_mm_s"] = numbers(line.speed_mm_s);
  j["distance_mm"] = numbers(line.distance_mm);
  j["structure"] = line.structure;
  j["removed_mm3"] = numbers(line.removed_mm3);
  j["seen_mm3"] = numbers(line.seen_mm3);
  j["hidden_mm3"] = numbers(line.hidden_mm3);
  j["unknown_mm3"] = numbers(line.unknown_mm3);
  j["tool"] = line.tool;
  Json at = Json::list();
  for (const auto& p : line.at_mm) {
    Json place = Json::list();
    for (const float x : p) place.push_back(std::round(static_cast<double>(x) * 100) / 100);
    at.push_back(std::move(place));
  }
  j["at_mm"] = std::move(at);
  j["events"] = Json::list();
  for (const TimelineEvent& e : line.events) {
    Json v{{"t_s", e.t_s}, {"end_s", e.end_s}, {"kind", name_of(e.kind)}, {"what", e.what}};
    if (!e.structure.empty()) v["structure"] = e.structure;
    if (e.placed) {
      v["at_mm"] = Json::list();
      for (std::size_t a = 0; a < 3; ++a) v["at_mm"].push_back(std::round(e.at_mm[a] * 1000) / 1000);
    }
    j["events"].push_back(std::move(v));
  }
  j["events_left_out"] = line.events_left_out;
  return j;
}

}  // namespace osteo::inline assessment
