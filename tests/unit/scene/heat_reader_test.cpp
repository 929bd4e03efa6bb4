// Heat of a rehearsal: the same live and in a replay, in balance, less with water, nothing without a burr.
#include "osteo/session/scene/heat_reader.h"

#include <gtest/gtest.h>

#include "bar.h"
#include "evidence/scene.h"
#include "osteo/assessment/scoring/hint_reader.h"
#include "osteo/session/recording/session_reader.h"
#include "osteo/session/scene/rehearsal.h"
#include "scratch.h"

namespace osteo {
namespace {

// A hole in the bar's upper face (z = 4), drilled for three seconds.
Script hole(bool pedal) {
  Script s;
  s.axis = {0, 0.3, 0.95};
  s.waypoints.push_back({0, {-5, 0, 8}, pedal});
  s.waypoints.push_back({0.1, {-5, 0, 5.6}, pedal});
  s.waypoints.push_back({3.0, {-3, 0.5, 4.6}, pedal});
  s.waypoints.push_back({3.2, {-3, 0.5, 9}, false});
  s.waypoints.push_back({4.0, {-3, 0.5, 9}, false});
  return s;
}

SceneAction at(std::uint64_t tick, SceneAction a) {
  a.tick = tick;
  return a;
}

struct Heated {
  double peak_c = 0, added_j = 0, balance_j = 0, cooled_j = 0, below_c = 0;
  std::size_t bricks = 0;
  std::uint64_t restarts = 0;
  friend bool operator==(const Heated&, const Heated&) = default;
};
Heated reported(const HeatReader& h) {
  const HeatLedger l = h.ledger();
  return {h.hottest_c(),
          l.added_j,
          l.added_j - l.chips_j - l.cooled_j - l.forgotten_j - h.stored_j(),
          l.cooled_j,
          h.celsius_at({-4, 0, 2}),
          h.warm_bricks(),
          h.restarts()};
}

struct Drilled {
  Heated live, again;
};
Drilled run(bool pedal, std::vector<SceneAction> actions, int tool) {
  const test::ScratchFolder scratch;
  const World world(test::bar(0.5, 0.2));
  RehearsalOptions o;
  o.session_file = scratch / "heat.oss";
  o.follow = {true, true, false, true};
  o.haptics.device = SpringHand::traits();
  o.actions = std::move(actions);
  Script script = hole(pedal);
  script.tool = tool;
  Rehearsal r(world.copy(), std::make_unique<ScriptedDevice>(script, 1000), o, {});
  HeatReader live(world, nullptr, 1000), again(world, nullptr, 1000);
  r.add_reader(live);
  static_cast<void>(r.run_to_end({}));
  r.look([&](const World&, SceneReaders& listed) {
    Heated own = reported(*listed.heat);
    ++own.restarts;  // who joins is told of the scene once more
    EXPECT_EQ(own, reported(live)) << "the scene's own";
    std::size_t warm = 0;
    listed.heat->for_warm_places([&](Vec3 centre_mm, double radius_mm) {
      ++warm;
      EXPECT_LT(length(centre_mm - Vec3{-4, 0.2, 4}), 20 + radius_mm);
    });
    EXPECT_EQ(warm, listed.heat->warm_bricks());
  });
  std::vector<Reader*> readers{&again};
  EXPECT_TRUE(replay(SessionReader(o.session_file), world.copy(), {}, {}, readers).identical);
  return {reported(live), reported(again)};
}

TEST(HeatReader, IsInBalanceAndTheSameInAReplay) {
  const int cutting = burr_index(BurrKind::cutting, 4), diamond = burr_index(BurrKind::diamond, 4);
  const Drilled dry = run(true, {}, diamond);
  EXPECT_GT(dry.live.peak_c, 40);
  EXPECT_LT(dry.live.peak_c, 400);
  EXPECT_GT(dry.live.below_c, 37.05);
  EXPECT_GT(dry.live.added_j, 0.1);
  EXPECT_NEAR(dry.live.balance_j, 0, 1e-6 * dry.live.added_j);
  EXPECT_GT(dry.live.bricks, 0u);
  // Both began with resync(): told of the bone as it was.
  EXPECT_EQ(dry.live, dry.again);
  const Drilled wet = run(true, {at(10, SceneAction::irrigate({-4, 0, 5}, 6, 1))}, diamond);
  EXPECT_LT(wet.live.peak_c, dry.live.peak_c);
  EXPECT_GT(wet.live.cooled_j, 0.01);
  EXPECT_NEAR(wet.live.balance_j, 0, 1e-6 * (wet.live.added_j + wet.live.cooled_j));
  const Drilled steel = run(true, {}, cutting);
  EXPECT_GT(steel.live.added_j, 0);
  EXPECT_LT(steel.live.peak_c, dry.live.peak_c) << "a cutting burr is the cooler one";
  EXPECT_EQ(steel.live, steel.again);
}

// Twice its stroke of 3 mm for every fourth turn, along the blade where there is bone at it.
TEST(HeatReader, ASawHeatsAlongItsBlade) {
  const World world(test::bar(0.5, 0.2));
  const HeatOfCutting params;
  HeatReader heat(world, nullptr, 1000, params);
  heat.resync(world);
  TickRecord t;
  t.device.tool = static_cast<std::uint8_t>(instrument_index("saw 25 mm"));
  // On the bar's upper face: its tip in the middle, its last fifth beyond the bar's end.
  t.device.position_mm = {-5, 0, 4.4F};
  t.device.axis = {1, 0, 0};
  t.device.pedal = 255;
  t.speed_rpm = 60000;
  t.normal_force_n = 4;
  t.force_n = {0, 0, 4};
  for (; t.tick < 1000; ++t.tick) heat.tick(t, {});
  const double metres = 2 * 0.003 * 60000 / 4 / 60;  // in the second
  EXPECT_NEAR(heat.ledger().added_j, params.cutting_share * 4 * metres, 1e-9);
  for (const double x : {-5.0, 0.0, 5.0, 10.0}) EXPECT_GT(heat.celsius_at({x, 0, 3.5}), 37.5) << x;
  EXPECT_LT(heat.celsius_at({-12, 0, 3.5}), 37.5) << "ahead of the tip";
  // In a guide its blade lies in the plane, however the hand holds it.
  HeatReader held(world, nullptr, 1000, params);
  held.resync(world);
  held.action(SceneAction::cutting_guide({{0, 0, 4.4}, {0, 0, 1}, 2}));
  TickRecord tilted = t;
  tilted.device.axis = {0.88F, 0, 0.475F};
  tilted.flags |= kInSlot;
  for (tilted.tick = 0; tilted.tick < 1000; ++tilted.tick) held.tick(tilted, {});
  for (const double x : {-5.0, 0.0, 5.0, 10.0})
    EXPECT_NEAR(held.celsius_at({x, 0, 3.5}), heat.celsius_at({x, 0, 3.5}), 1e-9) << x;
  HeatReader loose(world, nullptr, 1000, params);
  loose.resync(world);
  for (tilted.tick = 0; tilted.tick < 1000; ++tilted.tick) loose.tick(tilted, {});
  EXPECT_LT(loose.celsius_at({10, 0, 3.5}), 37.2) << "without one it points away from the bone";
  // At rest it heats nothing.
  t.speed_rpm = 0;
  const double before = heat.ledger().added_j;
  for (; t.tick < 1100; ++t.tick) heat.tick(t, {});
  EXPECT_EQ(heat.ledger().added_j, before);
}

TEST(HeatReader, ABurrThatStandsHeatsNothing) {
  const Drilled idle = run(false, {}, 0);
  EXPECT_EQ(idle.live.added_j, 0);
  EXPECT_EQ(idle.live.bricks, 0u);
  EXPECT_EQ(idle.live.peak_c, 37);
}

TEST(HeatReader, IsAmongTheMetricsOfAScore) {
  // Two balls: one under the hole, one at the bar's other end.
  const StructureMap balls = test::structure_map(
      [](Vec3 p) -> std::uint8_t {
        return length(p - Vec3{-4, 0, 1}) < 1.5 ? 1 : length(p - Vec3{12, 0, 0}) < 1.5 ? 2 : 0;
      },
      {{1, "near", {}}, {2, "far", {}}}, 0.5, 32);
  const test::ScratchFolder scratch;
  const World world(test::bar(0.5, 0.2));
  RehearsalOptions o;
  o.session_file = scratch / "heat.oss";
  o.haptics.device = SpringHand::traits();
  Script script = hole(true);
  script.tool = burr_index(BurrKind::diamond, 4);
  Rehearsal r(world.copy(), std::make_unique<ScriptedDevice>(script, 1000), o, {});
  HeatReader heat(world, &balls, 1000);
  r.add_reader(heat);
  static_cast<void>(r.run_to_end({}));
  std::map<std::string, double> by_name;
  for (const Measured& m : heat_values(heat, &balls)) by_name[m.name()] = m.value.value_or(-1);
  ASSERT_EQ(by_name.size(), 5U);
  EXPECT_EQ(by_name["heat_bone_c"], heat.hottest_c());
  EXPECT_EQ(by_name["heat_peak_c[near]"], heat.structures().at(1).worst.peak_c);
  EXPECT_GT(by_name["heat_peak_c[near]"], 37.5);
  EXPECT_EQ(by_name["heat_cem43_min[near]"], heat.structures().at(1).worst.cem43_min);
  EXPECT_NEAR(by_name["heat_peak_c[far]"], 37, 0.1);
  EXPECT_EQ(by_name["heat_cem43_min[far]"], 0);
  const auto bare = heat_values(heat, nullptr);
  ASSERT_EQ(bare.size(), 3U);
  EXPECT_EQ(bare[1].word, "the case has no structures");
}

// A diamond burr pressed with 2 N onto the bar for a second, and a second after it.
template <class F>
void press(HeatReader& heat, F&& after_each) {
  TickRecord r;
  r.device.position_mm = {-4, 0, 5.6F};
  r.device.tool = static_cast<std::uint8_t>(burr_index(BurrKind::diamond, 4));
  r.force_n = {0, 0, 2};
  for (std::uint64_t t = 0; t < 2000; ++t) {
    r.tick = t;
    r.normal_force_n = t < 1000 ? 2 : 0;
    r.speed_rpm = 40000;
    heat.tick(r, {});
    after_each();
  }
}

TEST(HeatReader, HistoryKeepsTheHighestOfEachPlace) {
  const StructureMap balls = test::structure_map(
      [](Vec3 p) -> std::uint8_t {
        return length(p - Vec3{-4, 0, 1}) < 1.5 ? 1 : 0;
      },
      {{1, "near", {}}}, 0.5, 32);
  const World world(test::bar(0.5, 0.2));
  HeatReader none(world, &balls, 1000);
  press(none, [] {});
  EXPECT_FALSE(none.warmest_left());
  EXPECT_TRUE(none.courses().empty());
  EXPECT_EQ(none.peak_c_at({-4, 0, 3.4}), 37);
  HeatReader heat(world, &balls, 1000);
  heat.keep_history();
  press(heat, [] {});
  EXPECT_EQ(heat.hottest_c(), none.hottest_c()) << "keeping it changes nothing";
  const auto warmest = heat.warmest_left();
  ASSERT_TRUE(warmest);
  EXPECT_GT(warmest->peak_c, 50);
  EXPECT_LE(warmest->peak_c, heat.hottest_c());
  EXPECT_LT(length(warmest->at_mm - Vec3{-4, 0, 3.6}), 1.5);
  // What was there at any time, seen from outside.
  HeatReader again(world, &balls, 1000);
  double highest = 0, deeper = 0;
  const Vec3 below =
      warmest->at_mm - world.bodies()[0].body->bone.frame().direction.column[2] * 1.5;  // a cell's centre too
  press(again, [&] {
    highest = std::max(highest, again.celsius_at(warmest->at_mm));
    deeper = std::max(deeper, again.celsius_at(below));
  });
  EXPECT_NEAR(warmest->peak_c, highest, 1e-9);
  EXPECT_NEAR(heat.peak_c_at(warmest->at_mm), highest, 1e-9);
  EXPECT_NEAR(heat.peak_c_at(below), deeper, 1e-9);
  EXPECT_GT(deeper, 38);
  EXPECT_LT(again.celsius_at(warmest->at_mm), highest - 5)
      << "it has cooled since: the highest is no longer there to be read";
  ASSERT_TRUE(heat.courses().contains(1));
  const auto& course = heat.courses().at(1);
  EXPECT_EQ(course.size(), heat.steps());
  EXPECT_NEAR(static_cast<double>(heat.steps()) * heat.step_s(), 2, heat.step_s());
  EXPECT_EQ(*std::max_element(course.begin(), course.end()), heat.structures().at(1).worst.peak_c);
  EXPECT_EQ(course.back(), heat.structures().at(1).now_c);
  EXPECT_NEAR(heat.bone_at({0, 0, 0}), 1, 1e-6);
  EXPECT_EQ(heat.bone_at({0, 0, 9}), 0);
}

// Bone that is cut, taken apart and put together again while it is warm.
TEST(HeatReader, CutsAndUndo) {
  const Drilled cut =
      run(true,
          {at(1000, SceneAction::saw({{2, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1})), at(1500, SceneAction::split(20)),
           at(2200, SceneAction::plain(ActionKind::undo)), at(2300, SceneAction::plain(ActionKind::undo))},
          0);
  EXPECT_EQ(cut.live, cut.again);
  EXPECT_NEAR(cut.live.balance_j, 0, 1e-6 * cut.live.added_j);
  EXPECT_GT(cut.live.added_j, 0);
}

}  // namespace
}  // namespace osteo
