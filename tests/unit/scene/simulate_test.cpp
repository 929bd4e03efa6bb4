// Dust and heat that begin and end while a session runs: the same live, in a replay, in a copy elsewhere.
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "bar.h"
#include "hole_script.h"
#include "osteo/session/recording/session_reader.h"
#include "osteo/session/scene/rehearsal.h"
#include "osteo/session/scene/session_player.h"
#include "osteo/session/scene/session_scene.h"
#include "scratch.h"

namespace osteo {
namespace {

SceneAction at(std::uint64_t tick, SceneAction a) {
  a.tick = tick;
  return a;
}
SceneAction dust(bool on) {
  return SceneAction::simulate(Simulated::dust, on);
}
SceneAction heat(bool on) {
  return SceneAction::simulate(Simulated::heat, on);
}
const SceneAction kUndo = SceneAction::plain(ActionKind::undo);

World bar() {
  return World(test::bar(0.5, 0.2));
}
// Five holes, a second each, into the bar.
std::unique_ptr<Device> drill() {
  return std::make_unique<ScriptedDevice>(test::holes(5, -10, 4.6), 1000);
}
RehearsalOptions options(const std::filesystem::path& file) {
  RehearsalOptions o;
  o.session_file = file;
  o.haptics.device = SpringHand::traits();
  return o;
}

struct Found {
  RehearsalSummary summary;
  std::string dust;  // its hash; empty: there is none
  Dust::Totals totals;
  double hottest_c = 0, heat_j = 0, cooled_j = 0;  // 0: there is none
};
Found found(SceneReaders& readers) {
  Found f;
  if (readers.dust) {
    f.dust = readers.dust->dust().hash();
    f.totals = readers.dust->dust().totals();
  }
  if (readers.heat) {
    f.hottest_c = readers.heat->hottest_c();
    f.heat_j = readers.heat->ledger().added_j;
    f.cooled_j = readers.heat->ledger().cooled_j;
  }
  return f;
}
Found run(const RehearsalOptions& o) {
  Rehearsal r(bar(), drill(), o, {});
  const RehearsalSummary s = r.run_to_end({});
  Found f;
  r.look([&](const World&, SceneReaders& readers) { f = found(readers); });
  f.summary = s;
  return f;
}

// With what a replay tells: dust and heat as they were seen.
Found again(const std::filesystem::path& file, std::string& difference) {
  const SessionReader session(file);
  SessionScene scene({.dust_by_action = true, .heat_by_action = true}, 1000, {});
  Reader* const readers[] = {&scene};
  const ReplayResult r = replay(session, bar(), {}, {}, readers);
  difference = r.difference;
  Found f = found(scene.readers());
  EXPECT_EQ(r.dust_hash, f.dust) << "the replay's own";
  return f;
}

void expect_same(const Found& live, const std::filesystem::path& file) {
  std::string difference;
  const Found replayed = again(file, difference);
  EXPECT_EQ(difference, "");
  EXPECT_EQ(replayed.dust, live.dust);
  EXPECT_EQ(replayed.hottest_c, live.hottest_c);
  EXPECT_EQ(replayed.heat_j, live.heat_j);
  EXPECT_EQ(replayed.cooled_j, live.cooled_j);
}

TEST(Simulate, DustAndHeatBeginAtATick) {
  const test::ScratchFolder scratch;
  RehearsalOptions o = options(scratch / "s.oss");
  // Water that runs already, half a hole behind, and a stroke that is taken back afterwards.
  o.actions = {at(300, SceneAction::irrigate({0, 0, 8}, 20, 300)), at(1400, dust(true)), at(1410, heat(true)),
               at(3800, kUndo)};
  const Found live = run(o);
  ASSERT_FALSE(live.dust.empty());
  EXPECT_GT(live.totals.added_mm3, 0.3 * live.summary.removed_mm3);
  EXPECT_LT(live.totals.added_mm3, 0.9 * live.summary.removed_mm3) << "what was drilled before is no dust";
  EXPECT_GT(live.totals.poured_mm3, 300) << "the water that ran before";
  EXPECT_GT(live.hottest_c, 37.1);
  EXPECT_GT(live.cooled_j, 0) << "by that water";
  const SessionReader session(o.session_file);
  EXPECT_FALSE(session.header().dust) << "it began without";
  EXPECT_EQ(session.outline().end->dust_hash, live.dust);
  expect_same(live, o.session_file);
}

TEST(Simulate, WhatBeganLaterIsLess) {
  const test::ScratchFolder scratch;
  RehearsalOptions whole = options(scratch / "whole.oss"), late = options(scratch / "late.oss");
  whole.follow.heat = whole.follow.dust = true;
  late.actions = {at(1700, dust(true)), at(1710, heat(true))};
  const Found all = run(whole), some = run(late);
  EXPECT_EQ(all.summary.bone_hash, some.summary.bone_hash) << "dust is no matter of the bone";
  EXPECT_NEAR(all.totals.added_mm3, all.summary.removed_mm3, 1e-3);
  EXPECT_LT(some.totals.added_mm3, 0.8 * all.totals.added_mm3);
  EXPECT_LT(some.heat_j, 0.8 * all.heat_j);
  EXPECT_GT(some.heat_j, 0.2 * all.heat_j);
}

TEST(Simulate, EndsAndBeginsAgain) {
  const test::ScratchFolder scratch;
  RehearsalOptions o = options(scratch / "s.oss");
  o.follow.dust = true;
  o.actions = {at(1000, dust(false)), at(1800, dust(true)), at(1801, dust(true)), at(2500, heat(true)),
               at(3500, heat(false))};
  const Found live = run(o);
  ASSERT_FALSE(live.dust.empty());
  EXPECT_LT(live.totals.added_mm3, 0.75 * live.summary.removed_mm3) << "the first two holes' dust is gone";
  EXPECT_GT(live.totals.added_mm3, 0.4 * live.summary.removed_mm3);
  EXPECT_EQ(live.heat_j, 0) << "there is no heat any more";
  expect_same(live, o.session_file);
  // Off to its end: there is nothing to compare, and nothing of it is in the summary.
  o.session_file = scratch / "off.oss";
  o.actions = {at(1000, dust(false))};
  const Found off = run(o);
  EXPECT_TRUE(off.dust.empty());
  EXPECT_FALSE(off.summary.dust.has_value());
  expect_same(off, o.session_file);
}

// A copy elsewhere, and whoever looks at the session later, know of it from the header.
TEST(Simulate, WhatASessionBeginsWithIsInItsHeader) {
  const test::ScratchFolder scratch;
  RehearsalOptions o = options(scratch / "s.oss");
  o.follow.heat = true;
  const Found live = run(o);
  EXPECT_GT(live.heat_j, 0);
  const SessionReader session(o.session_file);
  EXPECT_TRUE(session.header().heat);
  EXPECT_FALSE(session.header().dust);
  expect_same(live, o.session_file);
}

TEST(Simulate, NonsenseIsRejected) {
  World w = bar();
  SceneAction a = dust(true);
  EXPECT_TRUE(w.act(a).done);
  EXPECT_TRUE(w.simulates(Simulated::dust));
  EXPECT_FALSE(w.simulates(Simulated::heat));
  a.item = static_cast<std::uint32_t>(Simulated::behind_last);
  EXPECT_FALSE(w.act(a).done);
  a = dust(true);
  a.values[0] = 0.5;
  EXPECT_FALSE(w.act(a).done);
}

// While the servo runs on, cuts and undo between them.
TEST(Simulate, InRealTimeAsInTheReplay) {
  const test::ScratchFolder scratch;
  const RehearsalOptions o = options(scratch / "s.oss");
  Rehearsal r(bar(), drill(), o, {});
  const auto wait_for = [&](std::uint64_t tick) {
    while (r.running() && r.latest().tick < tick) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  };
  r.start();
  wait_for(300);
  r.act(dust(true));
  r.act(heat(true));
  while (r.running() && !(r.simulates(Simulated::dust) && r.simulates(Simulated::heat)))
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  r.act(SceneAction::saw({{2, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1}));
  wait_for(1700);
  r.act(kUndo);
  r.act(heat(false));
  r.act(dust(false));
  r.act(dust(true));
  while (r.running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  const RehearsalSummary s = r.stop();
  EXPECT_FALSE(s.refused());
  Found live;
  r.look([&](const World&, SceneReaders& readers) { live = found(readers); });
  EXPECT_FALSE(live.dust.empty());
  EXPECT_EQ(live.heat_j, 0);
  if (s.ticks_not_followed > 0) GTEST_SKIP() << "the machine did not keep up: dust lies elsewhere";
  expect_same(live, o.session_file);
}

// Another's session, repeated here: begun at the same tick, told from its first.
TEST(Simulate, ACopyElsewhereHasTheSame) {
  const test::ScratchFolder scratch;
  RehearsalOptions o = options(scratch / "host.oss");
  o.actions = {at(700, dust(true)), at(1500, SceneAction::saw({{2, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1})),
               at(2200, heat(true)), at(2700, kUndo)};
  const Found host = run(o);
  class Told final : public Device {
   public:
    explicit Told(DeviceSample& sample) : sample_(sample) {}
    DeviceSample read(std::uint64_t, double, Vec3) noexcept override { return sample_; }

   private:
    DeviceSample& sample_;
  };
  DeviceSample sample;
  Rehearsal copy(bar(), std::make_unique<Told>(sample), options(scratch / "guest.oss"), {});
  const SessionReader session(o.session_file);
  auto parts = session.parts();
  std::vector<SceneAction> due;
  while (const SessionPart* const p = parts.next()) {
    due.insert(due.end(), p->actions.begin(), p->actions.end());
    for (const TickRecord& t : p->ticks) {
      std::vector<SceneAction> now;
      std::erase_if(due, [&](const SceneAction& a) {
        if (a.tick <= t.tick) now.push_back(a);
        return a.tick <= t.tick;
      });
      sample = t.device;
      copy.step_elsewhere(now);
    }
  }
  copy.end_elsewhere(due);
  EXPECT_EQ(copy.stop().bone_hash, host.summary.bone_hash);
  Found guest;
  copy.look([&](const World&, SceneReaders& readers) { guest = found(readers); });
  EXPECT_EQ(guest.dust, host.dust);
  EXPECT_EQ(guest.heat_j, host.heat_j);
  EXPECT_GT(guest.heat_j, 0);
  expect_same(guest, scratch / "guest.oss");
}

// Who joins a scene late, or has lost what it was told, has what the scene has.
TEST(Simulate, WhoLostTheActionFollowsTheScene) {
  World w = bar();
  SceneReaders readers(w, {.dust_by_action = true, .heat_by_action = true}, 1000, {});
  EXPECT_EQ(readers.dust, nullptr);
  w.simulate(Simulated::dust, true);
  readers.simulation().resync(w);
  EXPECT_NE(readers.dust, nullptr);
  EXPECT_EQ(readers.heat, nullptr);
  // Its action is told all the same, and changes nothing.
  DustReader* const dust_reader = readers.dust.get();
  readers.simulation().action(dust(true));
  EXPECT_EQ(readers.dust.get(), dust_reader);
  w.simulate(Simulated::dust, false);
  readers.simulation().resync(w);
  EXPECT_EQ(readers.dust, nullptr);
  const SceneReaders fixed(w, {.dust = true}, 1000, {});
  EXPECT_NE(fixed.dust, nullptr);
}

// Review goes to and fro over such a session; what goes on from it begins with its bone.
TEST(Simulate, ReviewAndResumeKnowItsBone) {
  const test::ScratchFolder scratch;
  RehearsalOptions o = options(scratch / "s.oss");
  o.actions = {at(1400, dust(true)), at(2600, kUndo), at(3300, dust(false))};
  const Found live = run(o);
  const SessionReader session(o.session_file);
  SessionPlayer player(session, bar());
  const std::string end = player.scene().world()->hash();
  EXPECT_EQ(end, live.summary.bone_hash);
  player.go_to(0.5);
  EXPECT_NE(player.scene().world()->hash(), end);
  player.go_to(player.end_s());
  EXPECT_EQ(player.scene().world()->hash(), end);
  World resumed = bar();
  apply_recorded(session, resumed);
  EXPECT_EQ(resumed.hash(), end);
  // A session that goes on from there begins as it is asked to, whatever that one ended with.
  RehearsalOptions next = options(scratch / "next.oss");
  Rehearsal r(std::move(resumed), drill(), next, {});
  EXPECT_FALSE(r.simulates(Simulated::dust));
}

}  // namespace
}  // namespace osteo
