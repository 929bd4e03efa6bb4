// Sessions opened at a time, replayed past checkpoints, and written by other versions.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <random>
#include <set>

#include "bar.h"
#include "osteo/assessment/evidence/score.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/session/scene/rehearsal.h"
#include "osteo/session/scene/session_folder.h"
#include "osteo/simulation/bone/instrument.h"
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
  ReaderDispatcher dispatcher(stream.add_reader(), operation.world());
  dispatcher.add(operation.strokes(), false);
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
      dispatcher.drain();
      ASSERT_TRUE(operation.act(action->action).done);
    }
    if (t % 256 == 0) dispatcher.drain();
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
    test::OtherWriter w(later, header, test::tick_fields(),
                        [](nlohmann::ordered_json& j) { j["kernels"]["contact"] = 99; });
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

// A burr added where it belongs turns no recorded saw into another instrument, for whoever reads the session.
TEST(Sessions, OfAnotherLibraryHaveTheirOwnInstruments) {
  const test::ScratchFolder scratch;
  const auto file = scratch / "now.oss", earlier = scratch / "earlier.oss";
  World world(test::bar(0.5, 0.3));
  const World start = world.copy();
  Script s;
  s.tool = instrument_index("saw 25 mm");
  s.axis = {1, 0, 0};
  s.waypoints = {{0, {-12, 0, 6}, true}, {0.5, {-12, 0, 3}, true}};
  RehearsalOptions o;
  o.session_file = file;
  o.haptics.device = SpringHand::traits();
  Rehearsal(std::move(world), std::make_unique<ScriptedDevice>(s, 1000), o, {}).run_to_end({});
  {
    nlohmann::ordered_json list;
    test::OtherWriter w(earlier, SessionReader(file).header(), test::tick_fields(), [&](nlohmann::ordered_json& j) {
      test::renumber(j["instruments"], [](const std::string& name) { return name.find("taper") == name.npos; });
      list = j["instruments"];
    });
    test::write_otherwise(file, w, [&](TickRecord& t) {
      t.device.tool = static_cast<std::uint8_t>(test::number_in(list, instrument_of(t.device.tool).name));
    });
  }
  const Score now = score_session(SessionReader(file), start.copy(), nullptr, nullptr, nullptr, {});
  const Score then = score_session(SessionReader(earlier), start.copy(), nullptr, nullptr, nullptr, {});
  EXPECT_EQ(score_lines(then), score_lines(now));
  EXPECT_NE(score_lines(then).find("saw 25 mm"), std::string::npos) << score_lines(then);
  const ReplayResult r = replay(SessionReader(earlier), start.copy(), {}, {});
  EXPECT_TRUE(r.identical) << r.difference;
}

SessionFolder chained(const fs::path& folder, const std::string& from) {
  fs::create_directories(folder);
  write_file(folder / "session.json",
             R"({"osteotome_session_folder": 1, "case": "..", "resumed_from": ")" + from + "\"}\n");
  return open_session_folder(folder);
}

// A folder that was copied and renamed may name itself: that ended in a crash.
TEST(Sessions, ThatResumeFromEachOtherInACircleAreRefused) {
  const test::ScratchFolder scratch;
  const SessionFolder itself = chained(scratch / "1", "../1"), a = chained(scratch / "2", "../3"),
                      b = chained(scratch / "3", "../2/../2");
  const SessionFolder behind = chained(scratch / "4", "../2");
  for (const SessionFolder& s : {itself, a, b, behind}) {
    for (const auto& ask : {std::function([&] { static_cast<void>(world_at_begin(s, {}, {}, {})); }),
                            std::function([&] { static_cast<void>(world_at_end(s, {}, {}, {})); }),
                            std::function([&] { static_cast<void>(world_at(s, 1, {}, {}, {})); })}) {
      try {
        ask();
        FAIL() << s.folder;
      } catch (const Error& e) {
        EXPECT_EQ(e.code(), ExitCode::corrupt);
        EXPECT_NE(std::string(e.what()).find("in a circle"), std::string::npos) << e.what();
        EXPECT_NE(e.advice().find("session.json"), std::string::npos) << e.advice();
      }
    }
  }
}

// As long a chain as the disk holds, the first of all first, each up to where the next goes on.
TEST(Sessions, WhatASessionResumesFromIsListed) {
  const test::ScratchFolder scratch;
  fs::create_directories(scratch / "0");
  write_file(scratch / "0/session.json", R"({"osteotome_session_folder": 1, "case": ".."})");
  EXPECT_TRUE(sessions_before(open_session_folder(scratch / "0")).empty());
  constexpr int kLength = 40;
  for (int n = 1; n <= kLength; ++n)
    static_cast<void>(chained(scratch / std::to_string(n), "../" + std::to_string(n - 1)));
  write_file(scratch / "40/session.json",
             R"({"osteotome_session_folder": 1, "case": "..", "resumed_from": "../39", "resumed_at_s": 2.5})");
  const auto chain = sessions_before(open_session_folder(scratch / "40"));
  ASSERT_EQ(chain.size(), static_cast<std::size_t>(kLength));
  EXPECT_TRUE(fs::equivalent(chain.front().session.folder, scratch / "0"));
  EXPECT_TRUE(fs::equivalent(chain.back().session.folder, scratch / "39"));
  EXPECT_EQ(chain.back().until_s, 2.5);
  EXPECT_EQ(chain[5].until_s, 0);
}

}  // namespace
}  // namespace osteo
