// The timeline of frames made by hand, where every number is known; and of a recorded session, against its records.
#include <gtest/gtest.h>

#include <numeric>

#include "osteo/assessment/evidence/timeline.h"
#include "osteo/session/scene/rehearsal.h"
#include "osteo/simulation/bone/instrument.h"
#include "scene.h"
#include "scratch.h"

namespace osteo {
namespace {

// A ball of 2 mm around the origin is the nerve (1), one around (0, 0, 6) the cells (2).
const StructureMap& two_balls() {
  static const StructureMap map = test::structure_map(
      [](Vec3 p) -> std::uint8_t {
        return length(p) < 2 ? 1 : length(p - Vec3{0, 0, 6}) < 2 ? 2 : 0;
      },
      {{1, "nerve", {}}, {2, "cells", {}}}, 0.25, 24);
  return map;
}
World block() {
  return test::solid_world([](Vec3 p) { return 8 - std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}); }, 1, 24);
}
TickRecord tick(std::uint64_t n, Vec3 at, float force, float rpm = 20'000) {
  TickRecord t;
  t.tick = n;
  for (std::size_t a = 0; a < 3; ++a) t.device.position_mm[a] = static_cast<float>(at[a]);
  t.device.tool = static_cast<std::uint8_t>(instrument_index("cutting 2 mm"));
  t.speed_rpm = rpm;
  t.normal_force_n = force;
  return t;
}
Procedure cells_to_be_opened() {
  return parse_procedure(
      "{ \"osteotome_procedure\": 1, \"name\": \"t\", \"structures\": [ {\"name\": \"nerve\", \"role\": \"keep\"}, "
      "{\"name\": \"cells\", \"role\": \"enter\"} ] }",
      "t.json");
}

TEST(TimelineKeeper, SamplesAreWhatTheirTicksSay) {
  const World world = block();
  TimelineKeeper keeper({1000, &two_balls(), nullptr});
  // 0.1 s at 10 mm/s away from the nerve's face at 7 mm, pressing; 0.1 s at rest.
  std::vector<TickRecord> ticks;
  for (std::uint64_t n = 0; n < 100; ++n)
    ticks.push_back(tick(n, {6 + 0.01 * static_cast<double>(n), 0, 0}, n == 40 ? 3.0F : 0.5F));
  ticks[7].removed_mm3 = 0.25F;
  for (std::uint64_t n = 100; n < 200; ++n) ticks.push_back(tick(n, {6.99, 0, 0}, 0, 0));
  const std::vector<TickRecord> first(ticks.begin(), ticks.begin() + 100), second(ticks.begin() + 100, ticks.end());
  keeper.frame({1000, {}, first, {}, {}, world, nullptr, 0});
  keeper.frame({1000, {}, second, {}, {}, world, nullptr, 0});
  const std::map<VoxelKey, VisibilityMetric::Voxel> voxels{{5, {VisibilityMetric::Seen::hidden, 99, {}, 1.5F}},
                                                           {6, {VisibilityMetric::Seen::seen, 100, {}, 2.0F}},
                                                           {7, {VisibilityMetric::Seen::unknown, 199, {}, 4.0F}}};
  const Timeline line = keeper.timeline(voxels);
  ASSERT_EQ(line.size(), 2U);
  EXPECT_EQ(line.force_n, (std::vector<float>{3, 0}));
  // A stop from one tick to the next is one over two windows of 25 ms, half of which lie before it: a sixth of the
  // speed goes over.
  EXPECT_NEAR(static_cast<double>(line.speed_mm_s[0]), (50 + 25 * 5.0 / 6) * 10 / 75, 0.1);
  EXPECT_NEAR(static_cast<double>(line.speed_mm_s[1]), 25 * 1.0 / 6 * 10 / 75, 0.1);
  EXPECT_NEAR(static_cast<double>(line.distance_mm[0]), 6 - 2 - 1, 0.08);  // burr of 1 mm radius, ball of 2
  EXPECT_EQ(line.structure[0], 1);
  EXPECT_EQ(line.drilling, (std::vector<std::uint8_t>{1, 0}));
  EXPECT_EQ(line.removed_mm3, (std::vector<float>{0.25F, 0}));
  EXPECT_EQ(line.hidden_mm3, (std::vector<float>{1.5F, 0}));
  EXPECT_EQ(line.seen_mm3, (std::vector<float>{0, 2}));
  EXPECT_EQ(line.unknown_mm3, (std::vector<float>{0, 4}));
  ASSERT_EQ(line.events.size(), 1U);
  EXPECT_EQ(line.events[0].kind, EventKind::instrument);
  EXPECT_EQ(line.events[0].what, "cutting 2 mm");
}

TEST(TimelineKeeper, TouchesAndInjuriesAreEventsOfTheirLength) {
  const World world = block();
  const Procedure procedure = cells_to_be_opened();
  const auto reported = [&](const Procedure* p) {
    TimelineKeeper keeper({1000, &two_balls(), p});
    std::vector<TickRecord> ticks;
    // Into the nerve for 50 ms turning, out for 200 ms, in again at rest for 20 ms; then into the cells.
    for (std::uint64_t n = 0; n < 400; ++n) {
      const bool in = (n >= 10 && n < 60) || (n >= 260 && n < 280), cells = n >= 350;
      ticks.push_back(tick(n,
                           cells ? Vec3{0, 0, 7}
                           : in  ? Vec3{2.5, 0, 0}
                                 : Vec3{9, 0, 0},
                           0, n >= 260 && n < 280 ? 0.0F : 20'000.0F));
    }
    keeper.frame({1000, {}, ticks, {}, {}, world, nullptr, 0});
    Timeline line = keeper.timeline({});
    std::erase_if(line.events, [](const TimelineEvent& e) { return e.kind == EventKind::instrument; });
    return line;
  };
  const Timeline line = reported(&procedure);
  ASSERT_EQ(line.events.size(), 2U);  // what is to be opened is not injured by that
  EXPECT_EQ(line.events[0].kind, EventKind::injury);
  EXPECT_EQ(line.events[0].structure, "nerve");
  EXPECT_NEAR(line.events[0].t_s, 0.010, 1e-9);
  EXPECT_NEAR(line.events[0].end_s, 0.059, 1e-9);
  EXPECT_EQ(line.events[1].kind, EventKind::touch);
  EXPECT_NEAR(line.events[1].t_s, 0.260, 1e-9);
  EXPECT_EQ(line.structure[3], 1);  // and is not what one is near
  const Timeline all = reported(nullptr);
  ASSERT_EQ(all.events.size(), 3U);
  EXPECT_EQ(all.events[2].structure, "cells");
}

TEST(TimelineKeeper, ActionsNotesAndGapsAreEvents) {
  const World world = block();
  TimelineKeeper keeper({1000, nullptr, nullptr});
  const auto at = [](std::uint64_t tick, SceneAction a) {
    a.tick = tick;
    return a;
  };
  std::vector<SceneAction> actions{at(100, SceneAction::saw({{1, 2, 3}, {1, 0, 0}, {0, 0, 1}, 1})),
                                   at(150, SceneAction::plain(ActionKind::undo)),
                                   at(180, SceneAction::plain(ActionKind::stroke))};
  for (std::uint64_t n = 0; n < 50; ++n) actions.push_back(at(200 + 20 * n, SceneAction::move(3, {})));
  const std::vector<TickRecord> ticks{tick(1300, {0, 0, 0}, 0)};
  keeper.frame({1000, actions, ticks, {}, {}, world, nullptr, 0});
  keeper.note({120, "note", "{\"number\":1,\"at_mm\":[1,2,3],\"text\":\"sinus?\"}"});
  keeper.note({130, "camera", "{}"});
  keeper.note({140, "mark", "not json"});
  keeper.note({141, "ruler", "{\"length_mm\":4.56}"});
  keeper.note({142, "of a later program", "{}"});
  keeper.gap({1200, 50, false});
  const Timeline line = keeper.timeline({});
  std::vector<std::string> kinds;
  for (const TimelineEvent& e : line.events) kinds.emplace_back(name_of(e.kind));
  EXPECT_EQ(kinds, (std::vector<std::string>{"saw", "note", "note", "note", "undo", "move", "gap", "instrument"}));
  EXPECT_EQ(line.events[1].what, "note: sinus?");
  EXPECT_TRUE(line.events[1].placed);
  EXPECT_EQ(line.events[1].at_mm, (Vec3{1, 2, 3}));
  EXPECT_FALSE(line.events[2].placed);
  EXPECT_EQ(line.events[3].what, "measured 4.6 mm");
  EXPECT_NEAR(line.events[5].t_s, 0.2, 1e-9);  // 50 small moves are one
  EXPECT_NEAR(line.events[5].end_s, 1.18, 1e-9);
  EXPECT_NEAR(line.events[6].end_s, 1.25, 1e-9);
  // Samples before the first tick that is known are not.
  EXPECT_EQ(line.known.front(), 0);
  EXPECT_EQ(line.known.back(), 1);
  EXPECT_TRUE(std::isnan(line.distance_mm.front()));
}

TEST(TimelineKeeper, EventsHaveABound) {
  const World world = block();
  TimelineKeeper keeper({1000, nullptr, nullptr});
  for (std::uint64_t n = 0; n < Timeline::kMaxEvents + 7; ++n) keeper.note({n, "mark", "{}"});
  const Timeline line = keeper.timeline({});
  EXPECT_EQ(line.events.size(), Timeline::kMaxEvents);
  EXPECT_EQ(line.events_left_out, 7U);
}

TEST(Timelines, OfAFileAgreesWithItsScore) {
  const test::ScratchFolder scratch;
  const auto slab = [](Vec3 p) { return std::min({4 - p.z, p.z + 6, 11 - std::abs(p.x), 11 - std::abs(p.y)}); };
  const World world = test::solid_world(slab, 0.5, 24);
  Script s;
  s.axis = {0, 0.3, 0.95};
  s.waypoints = {
      {0, {-6, 0, 8}, true}, {0.2, {-6, 0, 5.4}, true}, {0.8, {-4, 0.5, 4.2}, true}, {0.9, {-4, 0, 8}, false}};
  RehearsalOptions o;
  o.session_file = scratch / "s.oss";
  o.haptics.device = SpringHand::traits();
  Rehearsal r(world.copy(), std::make_unique<ScriptedDevice>(s, 1000), o, {});
  r.note("camera",
         "{\"eye_mm\":[0,-20,200],\"target_mm\":[0,0,4],\"up\":[0,1,0],\"view_angle_deg\":30,\"pixels_per_mm\":10}");
  const RehearsalSummary summary = r.run_to_end({});
  const SessionReader session(scratch / "s.oss");
  const Timeline line = read_timeline(session, world.copy(), nullptr);
  const auto sum = [](const std::vector<float>& v) { return std::accumulate(v.begin(), v.end(), 0.0); };
  EXPECT_NEAR(sum(line.removed_mm3), summary.removed_mm3, 1e-3);
  ScoreDetail detail;
  TimelineKeeper on_the_way({1000, nullptr, nullptr});
  detail.frame = [&](const EvidenceFrame& f) { on_the_way.frame(f); };
  const Score score = score_session(session, world.copy(), nullptr, nullptr, nullptr, {}, {}, &detail);
  ASSERT_FALSE(detail.voxels.empty());
  double hidden = 0, seen = 0;
  for (const Measured& m : score.values) {
    if (m.row->name == "hidden_mm3") hidden = *m.value;
    if (m.row->name == "seen_share") seen = *m.value;
  }
  EXPECT_NEAR(sum(line.hidden_mm3), hidden, 1e-6);
  EXPECT_NEAR(sum(line.seen_mm3) / (sum(line.seen_mm3) + sum(line.hidden_mm3)), seen, 1e-6);
  EXPECT_EQ(detail.end->hash(), session.outline().end->bone_hash);
  const Timeline same = on_the_way.timeline(detail.voxels);
  EXPECT_EQ(timeline_json(same).dump(), timeline_json(line).dump());
  const auto json = Json::parse(timeline_json(line).dump());
  ASSERT_TRUE(json);
  EXPECT_EQ(json->find("force_n")->items().size(), line.size());
  EXPECT_TRUE(json->find("distance_mm")->items().front().is_null());
}

}  // namespace
}  // namespace osteo
