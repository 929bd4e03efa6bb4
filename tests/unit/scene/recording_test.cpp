// Rehearsals whose disk, machine or user does not wait: nothing lost that was not told.
#include <gtest/gtest.h>
#include <pthread.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <condition_variable>
#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <new>
#include <nlohmann/json.hpp>
#include <thread>

#include "bar.h"
#include "osteo/core/base/files.h"
#include "osteo/session/scene/rehearsal.h"
#include "osteo/session/scene/session_folder.h"
#include "rewrite_session.h"
#include "stalling_disk.h"

// Sanitizers have an allocator of their own.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define OSTEO_OWN_ALLOCATOR
#endif

namespace {

// Memory that runs out in one thread.
std::atomic<bool> follower_starves{false};
[[maybe_unused]] bool in_follower() {
  char name[16] = {};
  ::pthread_getname_np(::pthread_self(), name, sizeof name);
  return std::string_view(name) == "osteo-follower";
}

}  // namespace

#ifdef OSTEO_OWN_ALLOCATOR
void* operator new(std::size_t bytes) {
  if (follower_starves.load(std::memory_order_relaxed) && in_follower()) throw std::bad_alloc();
  if (void* const p = std::malloc(bytes > 0 ? bytes : 1)) return p;
  throw std::bad_alloc();
}
void operator delete(void* p) noexcept {
  std::free(p);
}
void operator delete(void* p, std::size_t) noexcept {
  std::free(p);
}
void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept {
  return std::malloc(bytes > 0 ? bytes : 1);
}
void operator delete(void* p, const std::nothrow_t&) noexcept {
  std::free(p);
}
#endif

namespace osteo {
namespace {

fs::path fresh(const std::string& name) {
  const auto path = fs::temp_directory_path() / ("osteo-recording-" + std::to_string(::getpid()) + "-" + name);
  fs::remove_all(path);
  return path;
}

Script strokes(double seconds) {
  Script s;
  s.axis = {0, 0.3, 0.95};
  s.waypoints.push_back({0, {4, 0, 6}, true});
  for (double t = 0.05; t < seconds - 0.02; t += 0.05)
    s.waypoints.push_back({t, {4 + 2 * std::cos(9 * t), 2 * std::sin(9 * t), 5.4 - 0.5 * t}, true});
  s.waypoints.push_back({seconds, {4, 0, 9}, false});
  return s;
}

RehearsalOptions options(const fs::path& file) {
  RehearsalOptions o;
  o.session_file = file;
  o.follow = {true, true, true};
  o.haptics.device = SpringHand::traits();
  return o;
}

SceneAction at(std::uint64_t tick, SceneAction a) {
  a.tick = tick;
  return a;
}
const SawCut kCut{{-4, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1.0};

// Due before the follower's thread runs, and in the last tick.
TEST(Recording, NoActionIsLostByTheClock) {
  World world(test::bar(1, 0));
  for (int start = 0; start < 40; ++start) {
    const auto file = fresh("start.oss");
    RehearsalOptions o = options(file);
    o.follow = {false, true, true};
    o.actions = {at(0, SceneAction::saw(kCut)), at(0, SceneAction::move(0, {{}, {0, 0, 1}})),
                 at(29, SceneAction::suction({}, 1, 1))};
    Rehearsal r(world.copy(), std::make_unique<ScriptedDevice>(strokes(0.03), 1000), o, {});
    r.start();
    while (r.running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const RehearsalSummary summary = r.stop();
    EXPECT_EQ(r.take_refusal(), "");
    EXPECT_NEAR(summary.dust->added_mm3, summary.removed_mm3 + summary.sawn_mm3 + summary.crumbs_mm3, 1e-3)
        << "what is sawn last becomes dust too";
    const Session s = read_session(file);
    std::size_t done = 0;
    for (const RecordedAction& a : s.actions)
      done += a.action.is(ActionKind::saw) || a.action.is(ActionKind::move) || a.action.is(ActionKind::suction) ? 1 : 0;
    ASSERT_EQ(done, 3u) << "start " << start;
    const ReplayResult again = replay(SessionReader(file), world.copy(), {}, {});
    ASSERT_TRUE(again.identical) << again.difference;
    fs::remove(file);
  }
}

// What was posted and never taken up by a tick is reported by the stream all the same (Servo::finish).
TEST(Recording, TheLastActionIsRecorded) {
  const auto file = fresh("last.oss");
  World world(test::bar(1, 0));
  const World start = world.copy();
  DeviceSample still;
  still.position_mm = {0, 0, 50};
  ReplayDevice device(std::vector<DeviceSample>(10, still));
  Stream stream;
  Recorder recorder(stream.add_reader(), file, {.program_version = "test", .bone_hash = world.hash()});
  Operation operation(std::move(world), {}, {}, device, stream, 1000);
  for (int t = 0; t < 10; ++t) operation.step(0);
  ASSERT_TRUE(operation.act(SceneAction::saw(kCut)).done);
  EXPECT_FALSE(operation.step(0)) << "no tick comes any more";
  operation.finish();
  recorder.finish({10, operation.world().hash(), "", 0, {}, 0, 0});
  const Session s = read_session(file);
  ASSERT_EQ(s.actions.size(), 1u);
  EXPECT_EQ(s.actions[0].action.tick, 10u);
  World again = start.copy();
  apply_recorded(SessionReader(file), again);
  EXPECT_EQ(again.hash(), operation.world().hash());
  EXPECT_NE(again.hash(), start.hash());
  fs::remove(file);
}

// A servo whose disk stalls while it drills and while the bone is taken apart.
TEST(Recording, AGapIsReplayedUpToItAndBoneBehindItIsKnown) {
  const auto file = fresh("gap.oss");
  World world(test::bar(0.5, 0.3));
  const World start = world.copy();
  HapticSetup setup;
  setup.device = SpringHand::traits();
  ScriptedDevice device(strokes(2), 1000);
  Stream stream;
  StreamReader& reader = stream.add_reader(Recorder::kTickCapacity);
  test::Disk disk;
  SessionHeader header;
  header.program_version = "test";
  header.bone_hash = world.hash();
  header.haptics = setup;
  auto recorder = std::make_unique<Recorder>(reader, std::make_unique<test::StallingSink>(disk, file), header, 8 << 10);
  Operation operation(std::move(world), setup, {}, device, stream, 1000);
  recorder->start();
  bool closed = false;
  const auto taken = [&] {
    while (reader.ticks.room() < Recorder::kTickCapacity || (!closed && recorder->status().waiting_bytes > 0))
      std::this_thread::sleep_for(std::chrono::microseconds(200));
  };
  ReaderDispatcher dispatcher(stream.add_reader(), operation.world());
  dispatcher.add(operation.strokes(), false);
  const auto act = [&](const SceneAction& a) {
    dispatcher.drain();
    ASSERT_TRUE(operation.act(a).done);
  };
  for (std::uint64_t t = 0; t < 2000; ++t) {
    if (t == 200) act(SceneAction::saw(kCut));
    if (t == 1000) act(SceneAction::split(20));
    if (t == 1100) act(SceneAction::move(1, {{}, {0.2, 0.1, 0}}));
    // What was drilled since the move, and nothing else: known in the gap too.
    if (t == 1300) act(SceneAction::plain(ActionKind::undo));
    if (t == 500 || t == 1400) {
      taken();
      disk.stall(closed = t == 500);
      taken();
    }
    ASSERT_TRUE(operation.step(0));
    if (t % 20 == 0) taken();
  }
  operation.finish();
  const World& end = operation.world();
  const SurfaceReader surface(end, {});
  recorder->finish({2000, end.hash(), surface.hash(), operation.removed_mm3(), {}, 0, 0});
  recorder.reset();
  const Session s = read_session(file);
  ASSERT_EQ(s.gaps.size(), 1u);
  EXPECT_GE(s.gaps[0].first_tick, 500u);
  EXPECT_LT(s.gaps[0].first_tick, 1000u);
  EXPECT_LE(s.gaps[0].first_tick + s.gaps[0].ticks, 1500u);
  ASSERT_EQ(s.actions.size(), 4u);
  EXPECT_EQ(end.bodies().size(), 2u);
  EXPECT_EQ(end.bodies()[1].world_from_body.shift_mm, (Vec3{0.2, 0.1, 0}));
  double removed = 0;
  for (const TickRecord& t : s.ticks) removed += static_cast<double>(t.removed_mm3);
  ReplayResult r = replay(SessionReader(file), start.copy(), {}, {});
  EXPECT_TRUE(r.identical) << r.difference;
  EXPECT_TRUE(r.complete);
  EXPECT_EQ(r.ticks_repeated, s.gaps[0].first_tick);
  EXPECT_EQ(r.ticks, s.ticks.size());
  EXPECT_EQ(r.losses.size(), 1u);
  EXPECT_EQ(r.bone_hash, end.hash());
  EXPECT_EQ(r.surface_hash, surface.hash());
  EXPECT_NEAR(r.removed_mm3, removed, 1e-9);
  World resumed = start.copy();
  apply_recorded(SessionReader(file), resumed);
  EXPECT_EQ(resumed.hash(), end.hash());
  // It would notice: another pose before the gap, another density behind it.
  const auto other = fresh("other.oss");
  test::rewrite_session(file, other, [](SessionBatch& batch) {
    for (TickRecord& t : batch.ticks) t.device.position_mm[2] -= t.tick == 400 ? 0.5F : 0;
  });
  const ReplayResult moved = replay(SessionReader(other), start.copy(), {}, {});
  EXPECT_NE(moved.difference.find("tick 400 came out differently"), std::string::npos) << moved.difference;
  EXPECT_EQ(moved.difference_since_s, 0);
  const VoxelChange last = s.changes.back();
  test::rewrite_session(file, other, [&](SessionBatch& batch) {
    for (VoxelChange& c : batch.changes) c.density += c.voxel == last.voxel ? 0.125F : 0;
  });
  EXPECT_FALSE(replay(SessionReader(other), start.copy(), {}, {}).identical);
  fs::remove(other);
  fs::remove(file);
}

// The follower did not come to run: what it keeps up is right again, dust is all there.
TEST(Recording, AFollowerThatLostTicksCatchesUpWithTheBone) {
  for (const bool apart : {false, true}) {
    World world(test::bar(0.5, 0.3));
    HapticSetup setup;
    setup.device = SpringHand::traits();
    ScriptedDevice device(strokes(2), 1000);
    Stream stream;
    StreamReader& reader = stream.add_reader(128, 1 << 21);
    const double before = world.volume_mm3();
    Operation operation(std::move(world), setup, {}, device, stream, 1000);
    ReaderDispatcher dispatcher(reader, operation.world());
    SceneReaders readers(operation.world(), {true, true, true}, 1000, {});
    readers.add_to(dispatcher);
    const auto act = [&](const SceneAction& a) {
      dispatcher.drain();
      ASSERT_TRUE(operation.act(a, [&](const World::Effect& e) { dispatcher.scene_changed(e); }).done);
    };
    for (std::uint64_t t = 0; t < 2000; ++t) {
      const bool asleep = (t > 300 && t < 1500) || t > 1800;
      if (t == 100) act(SceneAction::saw(kCut));
      if (t == 290 && apart) act(SceneAction::split(20));
      if (t == 1600) act(SceneAction::suction({4, 0, 4}, 2, 1));
      ASSERT_TRUE(operation.step(0));
      if (!asleep && t % 16 == 0) dispatcher.drain();
    }
    operation.finish();
    dispatcher.drain();
    dispatcher.end(2000);
    EXPECT_GT(dispatcher.ticks_lost(), 1000u);
    EXPECT_EQ(dispatcher.ticks_lost(), reader.dropped.load());
    const SceneReaders fresh_one(operation.world(), {true, true, false}, 1000, {});
    EXPECT_EQ(readers.surface_hash(), fresh_one.surface_hash());
    EXPECT_EQ(readers.large_pieces().size(), fresh_one.large_pieces().size());
    EXPECT_GT(operation.removed_mm3(), 2);
    const Dust::Totals d = readers.dust->dust().totals();
    EXPECT_NEAR(d.added_mm3, before - operation.world().volume_mm3(), 1e-2);
    EXPECT_NEAR(d.added_mm3, operation.removed_mm3() + readers.tools.sawn_mm3() + readers.tools.crumbs_mm3(), 1e-2);
    EXPECT_NEAR(d.added_mm3, d.present_mm3 + d.slurry_mm3 + d.sucked_mm3 + d.fallen_mm3, 1e-9);
  }
}

// Stopped by a signal: the session is closed, and may be asked again.
TEST(Recording, AnInterruptedRunIsClosed) {
  const auto file = fresh("interrupted.oss");
  World world(test::bar(1, 0));
  const World start = world.copy();
  std::atomic<bool> cancel{true};
  Context context;
  context.set_cancel_flag(&cancel);
  Rehearsal r(std::move(world), std::make_unique<ScriptedDevice>(strokes(2), 1000), options(file), {});
  const RehearsalSummary s = r.run_to_end(context);
  EXPECT_TRUE(s.interrupted);
  EXPECT_EQ(s.ticks, 64u);
  EXPECT_EQ(r.stop().bone_hash, s.bone_hash) << "ending it again is the same end";
  const Session session = read_session(file);
  ASSERT_TRUE(session.end);
  EXPECT_EQ(session.end->ticks, 64u);
  EXPECT_EQ(session.torn_bytes, 0u);
  EXPECT_TRUE(replay(SessionReader(file), start.copy(), {}, {}).identical);
  fs::remove(file);
}

// Out of memory in the follower's thread: the program goes on, the session is closed, stop() tells.
TEST(Recording, WhatTheFollowersThreadThrowsIsHandedOver) {
#ifndef OSTEO_OWN_ALLOCATOR
  GTEST_SKIP() << "sanitizers have an allocator of their own";
#endif
  const auto file = fresh("starved.oss");
  World world(test::bar(0.5, 0.3));
  const World start = world.copy();
  {
    Rehearsal r(std::move(world), std::make_unique<ScriptedDevice>(strokes(600), 1000), options(file), {});
    r.start();
    while (r.removed_mm3() < 0.5 && r.running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    follower_starves = true;
    while (r.running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));  // its end ends the rehearsal
    follower_starves = false;
    EXPECT_THROW(r.stop(), std::bad_alloc);
  }
  const Session s = read_session(file);
  ASSERT_TRUE(s.end);
  EXPECT_EQ(s.end->ticks, s.ticks.size());
  const ReplayResult again = replay(SessionReader(file), start.copy(), {}, {});
  EXPECT_TRUE(again.identical) << again.difference;
  fs::remove(file);
}

TEST(Recording, TheSummaryTellsOfEveryReader) {
  const fs::path folder = fresh("summary");
  fs::create_directories(folder);
  RehearsalSummary s;
  s.ticks = 1000;
  s.ticks_not_recorded = 70;
  s.gaps = {{100, 70, false}};
  s.ticks_not_followed = 5;
  s.notes_not_recorded = 3;
  const auto j = nlohmann::json::parse(write_summary({folder, {}, {}}, s, 1000, "burr"));
  EXPECT_EQ(j["ticks_lost_by_readers"], 75);
  EXPECT_EQ(j["ticks_not_recorded"], 70);
  EXPECT_EQ(j["gaps"][0]["first_tick"], 100);
  EXPECT_EQ(j["ticks_not_followed"], 5);
  EXPECT_EQ(j["notes_not_recorded"], 3);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace osteo
