// Sessions opened at a time, replayed past checkpoints, and written by other versions.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>
#include <set>

#include "bar.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/session/scene/rehearsal.h"
#include "other_session.h"
#include "rewrite_session.h"
#include "scratch.h"

namespace osteo {
namespace {

constexpr double kRate = 200, kSeconds = 250;

SceneAction at(double t_s, SceneAction a) {
  a.tick = static_cast<std::uint64_t>(t_s * kRate);
  return a;
}

// Four minutes of circles, deeper and deeper, while the bar is sawn, taken apart, moved and put together.
void record(const fs::path& file, World world) {
  Script s;
  s.axis = {0, 0.3, 0.95};
  s.waypoints.push_back({0, {4, 0, 8}, true});
  for (double t = 0.3; t < kSeconds - 0.5; t += 0.2)
    s.waypoints.push_back({t, {4 + 3 * std::cos(2 * t), 3 * std::sin(2.1 * t), 5.2 - 0.02 * t}, true});
  s.waypoints.push_back({kSeconds, {4, 0, 9}, false});
  RehearsalOptions o;
  o.rate_hz = kRate;
  o.session_file = file;
  o.follow = {true, false, false};
  o.haptics.device = SpringHand::traits();
  o.actions = {at(31, SceneAction::saw({{-4, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1})),
               at(32, SceneAction::split(20)),
               at(70, SceneAction::move(1, {{}, {-1, 0.5, 0}})),
               at(71, SceneAction::suction({4, 0, 5}, 3, 40)),
               at(90, SceneAction::plain(ActionKind::undo)),
               at(119.995, SceneAction::saw({{9, 0, 0}, {1, 0, 0}, {0, 0, 1}, 0.7}, 0)),
               at(120, SceneAction::split(20)),
               at(150, SceneAction::plain(ActionKind::undo)),
               at(200, SceneAction::move(0, {{}, {0, 0, 0.25}}))};
  Rehearsal r(std::move(world), std::make_unique<ScriptedDevice>(s, kRate), o, {});
  const RehearsalSummary summary = r.run_to_end({});
  ASSERT_TRUE(summary.notes.empty()) << summary.notes.front().why;
  ASSERT_GT(summary.removed_mm3, 20);
}

TEST(Sessions, OpenedAtAnyTimeTheyAreAsTheyWere) {
  const test::ScratchFolder scratch;
  const auto file = scratch / "long.oss";
  World world(test::bar(0.5, 0.3));
  const World start = world.copy();
  record(file, std::move(world));
  const SessionReader reader(file);
  std::mt19937 random(12);
  std::map<std::uint64_t, std::vector<std::string>> seen;  // by the tick that was reached
  const auto last = static_cast<std::uint64_t>(kSeconds * kRate);
  std::set<std::uint64_t> ticks{0, 1, last, 60 * 200, 120 * 200, 120 * 200 - 1, 120 * 200 + 1, 32 * 200};
  while (ticks.size() < 28) ticks.insert(random() % last);
  for (const std::uint64_t tick : ticks) {
    World w = start.copy();
    const std::uint64_t reached = apply_recorded_until(reader, w, tick);
    EXPECT_GE(reached, tick);
    EXPECT_LE(reached, tick + static_cast<std::uint64_t>(kRate / 10));
    seen[reached].push_back(w.hash());
  }
  // The servo once more, from the poses alone, stopped at each.
  const Session s = read_session(file);
  std::vector<DeviceSample> samples;
  for (const TickRecord& t : s.ticks) samples.push_back(t.device);
  ReplayDevice device(std::move(samples));
  Stream stream;
  Operation operation(start.copy(), s.header.haptics, {}, device, stream, kRate);
  ReaderHub hub(stream.add_reader(), operation.world());
  hub.add(operation.strokes(), false);
  auto action = s.actions.begin();
  std::set<std::string> different;
  for (std::uint64_t t = 0; t <= last; ++t) {
    if (const auto here = seen.find(t); here != seen.end()) {
      for (const std::string& hash : here->second) EXPECT_EQ(hash, operation.world().hash()) << "tick " << t;
      different.insert(operation.world().hash());
    }
    if (t == last) break;
    for (; action != s.actions.end() && action->action.tick == t; ++action) {
      if (row_of(action->action).by_servo) continue;
      hub.drain();
      ASSERT_TRUE(operation.act(action->action).done);
    }
    if (t % 256 == 0) hub.drain();
    ASSERT_TRUE(operation.step(0));
  }
  EXPECT_EQ(action, s.actions.end());
  EXPECT_GT(different.size(), 20u);
  // Behind its end it is as at its end.
  World end = start.copy();
  EXPECT_EQ(apply_recorded_until(reader, end, ~std::uint64_t{0}), last);
  EXPECT_EQ(end.hash(), reader.outline().end->bone_hash);
  EXPECT_TRUE(replay(reader, start.copy(), {}, {}).identical);

  // One pose a little elsewhere: found, and between which checkpoints.
  const auto other = scratch / "other.oss";
  const auto moved = static_cast<std::uint64_t>(100 * kRate);
  test::rewrite_session(file, other, [&](SessionBatch& b) {
    for (TickRecord& t : b.ticks) t.device.position_mm[2] -= t.tick == moved ? 0.4F : 0;
  });
  const ReplayResult r = replay(SessionReader(other), start.copy(), {}, {});
  EXPECT_FALSE(r.identical);
  EXPECT_EQ(r.difference_since_s, 60);
  EXPECT_NE(r.difference.find("between the checkpoints at 60 s and 120 s"), std::string::npos) << r.difference;
  EXPECT_NE(r.difference.find("tick " + std::to_string(moved)), std::string::npos) << r.difference;
}

// What another version added to each record does not end replay; other kernels do.
TEST(Sessions, OfOtherVersionsAreRepeatedWhereTheServoIsTheSame) {
  const test::ScratchFolder scratch;
  const auto file = scratch / "now.oss", later = scratch / "later.oss";
  World world(test::bar(0.5, 0.3));
  const World start = world.copy();
  Script s;
  s.waypoints = {{0, {4, 0, 6}, true}, {1, {4, 0, 2}, true}};
  RehearsalOptions o;
  o.session_file = file;
  o.haptics.device = SpringHand::traits();
  Rehearsal(std::move(world), std::make_unique<ScriptedDevice>(s, 1000), o, {}).run_to_end({});
  const auto header = SessionReader(file).header();
  {
    test::OtherWriter w(later, header, test::with_pulse());
    test::write_otherwise(file, w);
  }
  const ReplayResult r = replay(SessionReader(later), start.copy(), {}, {});
  EXPECT_TRUE(r.identical) << r.difference;
  EXPECT_EQ(r.ticks_repeated, 1000u);
  {
    test::OtherWriter w(later, header, test::without("thickness_mm"));
    test::write_otherwise(file, w);
  }
  EXPECT_TRUE(replay(SessionReader(later), start.copy(), {}, {}).identical);
  {
    test::OtherWriter w(later, header, test::tick_fields(), [](nlohmann::ordered_json& j) { j["kernels"]["contact"] = 99; });
    test::write_otherwise(file, w);
  }
  const SessionReader other(later);
  try {
    static_cast<void>(replay(other, start.copy(), {}, {}));
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::corrupt);
    EXPECT_NE(std::string(e.what()).find("other bits"), std::string::npos) << e.what();
    EXPECT_NE(e.advice().find("osteo export"), std::string::npos) << e.advice();
  }
  World resumed = start.copy();
  apply_recorded(other, resumed);
  EXPECT_EQ(resumed.hash(), other.outline().end->bone_hash) << "what it came to is known all the same";
}

}  // namespace
}  // namespace osteo
