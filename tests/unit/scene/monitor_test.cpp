// The nerve monitor of a rehearsal: a burr that comes nearer to the phantom's facial nerve, live and from the file to
// the bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "ear.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/session/scene/monitor_reader.h"
#include "osteo/session/scene/rehearsal.h"
#include "scratch.h"

namespace osteo {
namespace {

// Through the bone onto the nerve (its outer face at x = 45.7), stands on it with its weight, then goes into it, and
// away.
Script onto_the_nerve() {
  Script s;
  s.tool = burr_index(BurrKind::cutting, 3);
  s.axis = normalized({0.96, 0.2, 0.2});
  const auto at = [&](double t, double x, bool drill) { s.waypoints.push_back({t, {x, 9.5, -33.5}, drill}); };
  at(0, 58, true);
  at(2, 50.3, true);
  at(4.5, 49.2, true);
  at(7, 48, true);
  at(9, 47.7, true);
  at(9.1, 47.7, false);
  at(10, 46.2, false);
  at(11.5, 46.2, false);
  at(12, 47.5, true);
  at(13.2, 44, true);
  at(13.7, 44, true);
  at(14, 50, false);
  return s;
}

MonitorOptions usual() {
  MonitorOptions o;
  o.setup = parse_monitor(default_monitor_json(), "built in");
  return o;
}

class Witness : public MonitorSink {
 public:
  void block(const MonitorBlock& b) override {
    EXPECT_EQ(b.first_sample, samples);
    samples += b.samples();
    hasher.add(b.values.data(), b.values.size_bytes());
  }
  void event(const MonitorEvent& e) override { events.push_back(e); }
  void spike(const MonitorSpike& s) override { hasher.add(s.wave.data(), sizeof s.wave); }
  [[nodiscard]] std::vector<double> times(MonitorEventKind kind, NerveCause cause = NerveCause::none) const {
    std::vector<double> t;
    for (const MonitorEvent& e : events) {
      if (e.kind == kind && e.cause == cause) t.push_back(static_cast<double>(e.sample) / MonitorSetup::kRateHz);
    }
    return t;
  }
  std::uint64_t samples = 0;
  std::vector<MonitorEvent> events;
  Hasher hasher;
};

std::string reported(const Witness& w) {
  std::string text = std::to_string(w.samples) + " " + w.hasher.hex();
  for (const MonitorEvent& e : w.events)
    text += "\n" + std::to_string(e.sample) + " " + std::string(name_of(e.kind)) + " " + std::to_string(e.channel) +
            " " + format_number(e.uv) + " " + format_number(e.ma) + " " + std::string(name_of(e.cause)) + " " +
            std::to_string(e.tick);
  return text;
}

// As the window does: settings go into the session; at the first burst the threshold is looked for.
class Technician final : public Witness {
 public:
  Technician(MonitorReader& reader, Rehearsal& rehearsal) : reader_(reader), rehearsal_(rehearsal) {}
  void event(const MonitorEvent& e) override {
    Witness::event(e);
    if (e.kind == MonitorEventKind::stimulator) rehearsal_.note(kStimulatorNote, stimulator_note(e));
    // At the first that is heard, a burst or a train.
    if (e.kind == MonitorEventKind::activity && !asked_) reader_.stimulate({0, 0.4, 20, 0.1, true});
    asked_ = asked_ || e.kind == MonitorEventKind::activity;
  }

 private:
  MonitorReader& reader_;
  Rehearsal& rehearsal_;
  bool asked_ = false;
};

struct FirstTouch final : Reader {
  void tick(const TickRecord& r, std::span<const VoxelChange> /*changes*/) override {
    if (at_s < 0 && (r.flags & kStructureTouched) != 0) at_s = static_cast<double>(r.tick) / 1000;
  }
  double at_s = -1;
};

TEST(Monitor, BurstsBeforeTouchTrainsUnderPressureSilenceAfterTheCut) {
  const test::ScratchFolder scratch;
  const HeadAnatomy head;
  test::Ear ear = test::ear(head, 0.5);
  const World world(std::move(ear.bone));
  RehearsalOptions o;
  o.session_file = scratch / "nerve.oss";
  o.haptics.device = SpringHand::traits();
  o.anatomy.structures = std::make_shared<const StructureMap>(ear.labels);
  o.haptics.structures = o.anatomy.structures->hash();
  Rehearsal rehearsal(world.copy(), std::make_unique<ScriptedDevice>(onto_the_nerve(), 1000), o, {});
  MonitorReader live(usual(), o.anatomy.structures.get(), 1000);
  ASSERT_EQ(live.wiring().labels().size(), 4u);
  EXPECT_EQ(live.wiring().left_out, (std::vector<std::string>{"inferior alveolar nerve", "chorda tympani"}));
  Technician seen(live, rehearsal);
  FirstTouch touch;
  live.add_sink(seen);
  rehearsal.add_reader(live);
  rehearsal.add_reader(touch);
  static_cast<void>(rehearsal.run_to_end({}));
  live.end();
  EXPECT_EQ(seen.samples, 14u * 30000u) << "every one of them";

  const auto alarms = seen.times(MonitorEventKind::activity), trains = seen.times(MonitorEventKind::train),
             pressed = seen.times(MonitorEventKind::cause, NerveCause::pressure),
             hurt = seen.times(MonitorEventKind::cause, NerveCause::injury);
  ASSERT_GT(touch.at_s, 2);
  ASSERT_FALSE(alarms.empty());
  EXPECT_LT(alarms.front(), touch.at_s) << "heard before it is touched";
  EXPECT_GT(alarms.front(), 2) << "silent far away";
  ASSERT_FALSE(pressed.empty());
  EXPECT_GT(pressed.front(), touch.at_s - 0.1);
  ASSERT_FALSE(trains.empty());
  ASSERT_FALSE(hurt.empty());
  EXPECT_GT(seen.times(MonitorEventKind::threshold).size() + seen.times(MonitorEventKind::no_threshold).size(), 0u);

  // Cut: what comes from above does not arrive.
  const NerveModel& model = live.model();
  std::size_t cut = model.courses()[0].points.size();
  for (std::size_t p = 0; p < model.courses()[0].points.size(); ++p) {
    if (model.integrity(0, p) == 0) cut = std::min(cut, p);
  }
  ASSERT_LT(cut, model.courses()[0].points.size());
  ASSERT_GT(cut, 0u);
  EXPECT_EQ(model.conducts(0, 0), 0);
  for (const MonitorEvent& e : seen.events) {
    if (e.kind == MonitorEventKind::activity) {
      EXPECT_LT(e.sample, 13.9 * 30000) << "quiet at the end";
    }
  }

  // From the file: the same settings at the same ticks, the same bits.
  const SessionReader session(o.session_file);
  std::size_t unreadable = 0;
  const auto settings = stimulator_notes(session, unreadable);
  EXPECT_EQ(settings.size(), 1u);
  EXPECT_EQ(unreadable, 0u);
  MonitorReader again(usual(), o.anatomy.structures.get(), 1000);
  for (const auto& [tick, setting] : settings) again.stimulate_at(tick, setting);
  Witness repeated;
  again.add_sink(repeated);
  std::vector<Reader*> readers{&again};
  ASSERT_TRUE(replay(session, world.copy(), o.anatomy, {}, readers).identical);
  again.end();
  EXPECT_EQ(reported(repeated), reported(seen));

  // The course beside the phantom's own line, within the part of the ear that is here.
  double worst = 0;
  for (const auto& p : live.wiring().courses[0].points) {
    if (p.at_mm.z < -40 || p.at_mm.z > -27) continue;
    double nearest = 1e9;
    const auto line = head.facial_nerve();
    for (std::size_t k = 0; k + 1 < line.size(); ++k) {
      const Vec3 from = line[k].at_mm, along = line[k + 1].at_mm - from;
      const double share = std::clamp(dot(p.at_mm - from, along) / dot(along, along), 0.0, 1.0);
      nearest = std::min(nearest, length(from + along * share - p.at_mm));
    }
    worst = std::max(worst, nearest);
  }
  EXPECT_LT(worst, 0.4);
  RecordProperty("course_error_mm", std::to_string(worst));
}

TEST(Monitor, WithoutNervesThereIsNothing) {
  MonitorReader none(usual(), nullptr, 1000);
  Witness w;
  none.add_sink(w);
  for (std::uint64_t t = 0; t < 1000; ++t) {
    TickRecord r;
    r.tick = t;
    none.tick(r, {});
  }
  none.end();
  EXPECT_TRUE(none.wiring().channels.empty());
  EXPECT_EQ(none.wiring().left_out.size(), 3u);
  EXPECT_EQ(w.samples, 0u);
  EXPECT_TRUE(w.events.empty());
}

TEST(Monitor, LostTicksAreTold) {
  const HeadAnatomy head;
  test::Ear ear = test::ear(head, 0.5);
  const World world(std::move(ear.bone));
  const StructureMap map(ear.labels);
  MonitorReader monitor(usual(), &map, 1000);
  struct Gap final : MonitorSink {
    void event(const MonitorEvent& e) override {
      if (e.kind == MonitorEventKind::lost) lost_s += e.seconds;
    }
    double lost_s = 0;
  } gap;
  monitor.add_sink(gap);
  const auto run = [&](std::uint64_t from, std::uint64_t to) {
    for (std::uint64_t t = from; t < to; ++t) {
      TickRecord r;
      r.tick = t;
      r.device.position_mm = {80, 9, -33};
      monitor.tick(r, {});
    }
  };
  monitor.resync(world);
  run(0, 503);
  monitor.resync(world);
  run(753, 1000);
  monitor.end();
  EXPECT_EQ(gap.lost_s, 0.25);
  EXPECT_EQ(monitor.restarts(), 1u);
  EXPECT_EQ(monitor.samples(), 30000u);
}

TEST(Monitor, NotesThatAreNoneAreCounted) {
  MonitorEvent e;
  e.kind = MonitorEventKind::stimulator;
  e.tick = 125;
  e.ma = 0.35;
  e.pulses_per_s = 7;
  e.width_ms = 0.3;
  e.search = true;
  const test::ScratchFolder scratch;
  SessionHeader header;
  header.bone_hash = "x";
  StreamReader stream(16, 16);
  Recorder recorder(stream, scratch / "n.oss", header);
  recorder.note({0, kStimulatorNote, stimulator_note(e)});
  recorder.note({0, kStimulatorNote, R"({"at_tick": -1})"});
  recorder.note({0, "camera", "{}"});
  recorder.finish({});
  std::size_t unreadable = 0;
  const auto all = stimulator_notes(SessionReader(scratch / "n.oss"), unreadable);
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].first, 125u);
  EXPECT_EQ(all[0].second, (StimulatorSetting{0, 0.35, 7, 0.3, true}));
  EXPECT_EQ(unreadable, 1u);
}

}  // namespace
}  // namespace osteo
