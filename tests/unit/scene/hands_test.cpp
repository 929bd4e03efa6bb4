// Two hands and live settings through a whole rehearsal: recorded, replayed to the bit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <thread>

#include "bar.h"
#include "osteo/core/base/error.h"
#include "osteo/session/recording/export.h"
#include "osteo/session/scene/rehearsal.h"
#include "osteo/simulation/bone/instrument.h"
#include "scratch.h"

namespace osteo {
namespace {

namespace fs = std::filesystem;

World bar() {
  return World(test::bar(0.5, 0.3));
}

// The first drills a groove along the bar's upper face (z = 4); the second holds a sucker into it, and lets go once.
Script drill_and_suck() {
  Script s;
  s.tool = burr_index(BurrKind::cutting, 4);
  s.waypoints = {{0, {-6, 0, 8}, true}, {0.3, {-6, 0, 5}, true}, {1.8, {6, 0, 4}, true, 0.7}, {2, {6, 0, 9}, false}};
  Strokes sucker;
  sucker.tool = instrument_index("sucker 12 Fr");
  sucker.axis = normalized({0, 1, 1});
  sucker.waypoints = {{0, {-6, 4, 7}, false},
                      {0.5, {-8, 0, 6}, true},
                      {1.2, {-4, 0, 5}, false},
                      {1.5, {-2, 0, 5}, true},
                      {2.2, {4, 0, 5}, false}};
  s.more_hands = {sucker};
  return s;
}

RehearsalOptions options(const Script& script, const fs::path& file) {
  RehearsalOptions o;
  o.session_file = file;
  o.follow = {true, false, true};
  o.haptics.device = SpringHand::traits();
  o.haptics.more_devices.assign(script.more_hands.size(), SpringHand::traits());
  o.actions = actions_of(script, 1000);
  return o;
}

RehearsalSummary run(const Script& script, bool by_the_clock, const fs::path& file) {
  Rehearsal r(bar(), devices_of(script, 1000), options(script, file), {});
  if (!by_the_clock) return r.run_to_end({});
  r.start();
  while (r.running()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  return r.stop();
}

std::uint32_t setting(const char* name) {
  return static_cast<std::uint32_t>(setting_number(name));
}

TEST(TwoHands, OneSucksWhileTheOtherDrillsAndAReplayGetsTheSame) {
  const test::ScratchFolder scratch;
  const Script script = drill_and_suck();
  for (const bool by_the_clock : {false, true}) {
    const fs::path file = scratch / (by_the_clock ? "clock.oss" : "fast.oss");
    const RehearsalSummary s = run(script, by_the_clock, file);
    EXPECT_EQ(s.ticks, 2200u);
    EXPECT_GT(s.removed_mm3, 1);
    ASSERT_TRUE(s.dust);
    EXPECT_GT(s.dust->sucked_mm3, 0.05 * s.dust->added_mm3);
    const Session session = read_session(file);
    ASSERT_EQ(session.header.haptics.hands(), 2u);
    ASSERT_EQ(session.ticks.size(), 2 * s.ticks);
    std::uint64_t changes[2] = {};
    double felt = 0;
    for (std::size_t i = 0; i < session.ticks.size(); ++i) {
      const TickRecord& t = session.ticks[i];
      ASSERT_EQ(t.tick, i / 2);
      ASSERT_EQ(t.hand, i % 2);
      changes[t.hand] += t.voxels_changed;
      if (t.hand == 0) continue;
      felt = std::max(felt, static_cast<double>(t.normal_force_n));
      ASSERT_EQ(t.speed_rpm, 0);
    }
    EXPECT_GT(changes[0], 0u);
    EXPECT_EQ(changes[1], 0u);
    EXPECT_GT(felt, 0.05) << "the sucker touches bone";
    const ReplayResult r = replay(SessionReader(file), bar(), {}, {});
    EXPECT_TRUE(r.identical) << r.difference;
    EXPECT_EQ(r.ticks, 2200u);
    EXPECT_EQ(r.ticks_repeated, 2200u);
    EXPECT_EQ(r.bone_hash, s.bone_hash);
    EXPECT_FALSE(r.dust_hash.empty());
  }
}

// A plate in the second hand is the second hand's when it is replayed too; in a file without the field, as before, the
// first's.
TEST(TwoHands, WhoseHandAnActionMeansIsRecorded) {
  const test::ScratchFolder scratch;
  const Script script = drill_and_suck();
  RehearsalOptions o = options(script, scratch / "grip.oss");
  SceneAction grip = SceneAction::grip(0, {}, 1);
  grip.tick = 400;
  o.actions.push_back(grip);
  Rehearsal r(bar(), devices_of(script, 1000), o, {});
  const RehearsalSummary s = r.run_to_end({});
  const Session session = read_session(scratch / "grip.oss");
  const auto found = std::find_if(session.actions.begin(), session.actions.end(),
                                  [](const RecordedAction& a) { return a.action.is(ActionKind::grip); });
  ASSERT_NE(found, session.actions.end());
  EXPECT_EQ(found->action.hand, 1u);
  std::uint64_t held[2] = {};
  for (const TickRecord& t : session.ticks) held[t.hand] += (t.flags & kPlateInHand) != 0 ? 1 : 0;
  EXPECT_EQ(held[0], 0u);
  EXPECT_GT(held[1], 1000u);
  const ReplayResult again = replay(SessionReader(scratch / "grip.oss"), bar(), {}, {});
  EXPECT_TRUE(again.identical) << again.difference;
  EXPECT_EQ(again.bone_hash, s.bone_hash);
}

// The sucker alone makes the difference to the dust, and none to the bone that it does not touch.
TEST(TwoHands, WithoutTheSuckerDustStaysAndTheBoneIsTheSame) {
  const test::ScratchFolder scratch;
  Script script = drill_and_suck();
  for (auto& w : script.more_hands[0].waypoints) w.at_mm.z += 2.5;  // above the dust's surface, and off the bone
  const RehearsalSummary with = run(script, false, scratch / "with.oss");
  for (auto& w : script.more_hands[0].waypoints) w.drill_on = false;
  const RehearsalSummary pedal_up = run(script, false, scratch / "up.oss");
  script.more_hands.clear();
  const RehearsalSummary alone = run(script, false, scratch / "alone.oss");
  EXPECT_EQ(with.bone_hash, alone.bone_hash);
  EXPECT_GT(with.dust->sucked_mm3, 0);
  EXPECT_EQ(pedal_up.dust->sucked_mm3, 0);
  EXPECT_EQ(alone.dust->sucked_mm3, 0);
}

// A hand missing in a file, or in the wrong place, is damage.
TEST(TwoHands, AreExportedByHand) {
  const test::ScratchFolder scratch;
  Script script = drill_and_suck();
  script.waypoints.resize(2);
  script.more_hands[0].waypoints.resize(2);
  run(script, false, scratch / "s.oss");
  export_session(SessionReader(scratch / "s.oss"), scratch / "s.csv", {});
  std::ifstream in(scratch / "s.csv");
  std::string line;
  std::getline(in, line);
  EXPECT_EQ(line.rfind("time_s,tick,hand,", 0), 0u) << line;
  std::getline(in, line);
  EXPECT_EQ(line.rfind("0,0,0,", 0), 0u) << line;
  std::getline(in, line);
  EXPECT_EQ(line.rfind("0,0,1,", 0), 0u) << line;
  EXPECT_EQ(line.substr(line.size() - 2), ",0") << "nothing is missing before the second hand";
}

TEST(TwoHands, AsManyDevicesAsHands) {
  Script script = drill_and_suck();
  RehearsalOptions o = options(script, {});
  o.haptics.more_devices.clear();
  EXPECT_THROW(Rehearsal(bar(), devices_of(script, 1000), o, {}), Error);
}

// Every setting is changed while it runs, and a replay does the same.
TEST(LiveSettings, AllOfThemAreReplayedToTheBit) {
  const test::ScratchFolder scratch;
  Script script = drill_and_suck();
  double t = 0.4;
  const HapticsParams usual;
  for (std::size_t n = 0; n < setting_names().size(); ++n, t += 0.03) {
    const double now = setting_value(static_cast<int>(n), usual);
    const bool flag = now == 0 || now == 1;
    const double next = setting_names()[n] == "method" ? setting_value(static_cast<int>(n), "proxy")
                        : flag                         ? 1 - now
                                                       : 0.8 * now;
    script.actions.push_back({t, SceneAction::setting(static_cast<std::uint32_t>(n), next)});
  }
  // And back: the distance map is made again of the bone as it is then.
  for (const char* name : {"method", "fail_safe", "shaft", "vibration"})
    script.actions.push_back(
        {t += 0.03, SceneAction::setting(setting(name), setting_value(setting_number(name), usual))});
  ASSERT_LT(t, 1.6);
  for (const bool by_the_clock : {false, true}) {
    const fs::path file = scratch / (by_the_clock ? "clock.oss" : "fast.oss");
    const RehearsalSummary s = run(script, by_the_clock, file);
    EXPECT_TRUE(s.notes.empty()) << name_of(s.notes.front().kind) << s.notes.front().why;
    const Session session = read_session(file);
    std::size_t settings = 0, holds = 0;
    for (const RecordedAction& a : session.actions) {
      settings += a.action.is(ActionKind::setting) ? 1 : 0;
      holds += a.action.is(ActionKind::hold) ? 1 : 0;
    }
    EXPECT_EQ(settings, setting_names().size() + 4);
    EXPECT_EQ(holds, by_the_clock ? 1u : 0u) << "only a new distance map needs the bone to stand still";
    const ReplayResult r = replay(SessionReader(file), bar(), {}, {});
    EXPECT_TRUE(r.identical) << r.difference;
  }
}

// At its tick: the force of the tick before is as without it, that of its own is not.
TEST(LiveSettings, TakeEffectAtTheirTick) {
  const test::ScratchFolder scratch;
  Script script;
  script.tool = burr_index(BurrKind::cutting, 4);
  script.waypoints = {{0, {0, 0, 8}, false}, {0.3, {0, 0, 5}, false}, {1, {0, 0, 5}, false}};
  run(script, false, scratch / "without.oss");
  script.actions = {{0.7, SceneAction::setting(setting("stiffness_n_per_mm"), 2)},
                    {0.7, SceneAction::setting(setting("soft_stiffness_n_per_mm"), 1)}};
  run(script, false, scratch / "with.oss");
  const Session without = read_session(scratch / "without.oss"), with = read_session(scratch / "with.oss");
  ASSERT_EQ(with.actions.size(), 2u);
  EXPECT_EQ(with.actions[0].action.tick, 700u);
  for (std::size_t t = 0; t < 700; ++t) ASSERT_EQ(with.ticks[t].normal_force_n, without.ticks[t].normal_force_n) << t;
  EXPECT_LT(with.ticks[700].normal_force_n, 0.8F * without.ticks[700].normal_force_n);
}

TEST(LiveSettings, WhatIsOutOfRangeIsRefusedAndToldOf) {
  const test::ScratchFolder scratch;
  Script script = drill_and_suck();
  script.actions = {{0.1, SceneAction::setting(setting("stiffness_n_per_mm"), 1e6)},
                    {0.2, SceneAction::setting(9999, 1)}};
  const RehearsalSummary s = run(script, false, scratch / "s.oss");
  ASSERT_EQ(s.notes.size(), 2u);
  EXPECT_FALSE(s.notes[0].done);
  EXPECT_NE(s.notes[0].why.find("stiffness_n_per_mm"), std::string::npos) << s.notes[0].why;
  EXPECT_NE(s.notes[1].why.find("9999"), std::string::npos);
  const Session session = read_session(scratch / "s.oss");
  EXPECT_TRUE(session.actions.empty());
}

}  // namespace
}  // namespace osteo
