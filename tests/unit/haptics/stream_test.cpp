// Readers that come and go while the servo publishes.
#include "osteo/simulation/haptics/stream.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "osteo/core/base/error.h"
#include "osteo/simulation/haptics/servo.h"
#include "osteo/simulation/haptics/simulated_device.h"
#include "slab.h"

namespace osteo {
namespace {

// What it has got since the last time: ticks in a row, each with its changes.
struct Followed {
  std::uint64_t next = StreamReader::kNone, ticks = 0, wrong = 0;
  void drain(StreamReader& r) {
    TickRecord record;
    std::array<VoxelChange, 8> changes;
    while (r.ticks.pop({&record, 1}) == 1) {
      if (next == StreamReader::kNone) next = r.first_tick.load();
      // A hole only where the ring was full and says so.
      wrong += record.tick < next || (record.tick > next && r.dropped.load() == 0) ? 1 : 0;
      next = record.tick + 1;
      ++ticks;
      wrong += r.changes.pop(std::span(changes).first(record.voxels_changed)) != record.voxels_changed ? 1 : 0;
      for (std::uint32_t c = 0; c < record.voxels_changed; ++c) wrong += changes[c].voxel != record.tick + c ? 1 : 0;
    }
    SceneAction action;
    while (r.actions.pop({&action, 1}) == 1) wrong += action.is(ActionKind::undo) ? 0 : 1;
  }
};

TEST(Stream, ReadersJoinAndLeaveAThousandTimesAndNobodyElseLosesAnything) {
  Stream stream;
  StreamReader& stays = stream.add_reader(1 << 12, 1 << 14);
  std::atomic<bool> stop{false};
  std::atomic<std::uint64_t> published{0};
  std::thread servo([&] {
    std::array<VoxelChange, 8> changes;
    for (std::uint64_t t = 0; !stop; ++t) {
      // So that nothing may be lost, of neither ring: who follows ticks without a pause looks at no action meanwhile.
      while (!stop && (stays.ticks.room() < 2 || stays.actions.room() < 2)) std::this_thread::yield();
      if (t % 3 == 0) {
        SceneAction a = SceneAction::plain(ActionKind::undo);
        a.tick = t;
        stream.publish(a);
      }
      TickRecord record;
      record.tick = t;
      record.voxels_changed = static_cast<std::uint32_t>(t % 8);
      for (std::uint32_t c = 0; c < record.voxels_changed; ++c) changes[c] = {static_cast<VoxelKey>(t + c), 0.5F, 1.0F};
      stream.publish(record, std::span(changes).first(record.voxels_changed));
      published = t + 1;
    }
  });
  std::thread others[2];
  std::atomic<std::uint64_t> wrong{0}, reported{0};
  for (std::thread& other : others) {
    other = std::thread([&] {
      for (int n = 0; n < 1000; ++n) {
        StreamReader& r = stream.add_reader(1 << 10, 1 << 12);
        Followed mine;
        // Most leave after a moment, whatever they got. Every eighth stays until it got something, so that some have on
        // a busy machine too.
        const bool patient = n % 8 == 0;
        const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
        for (int looks = 0; (looks < 50 || patient) && mine.ticks == 0; ++looks) {
          if (looks > 50 && std::chrono::steady_clock::now() > end) break;
          std::this_thread::yield();
          mine.drain(r);
        }
        wrong += mine.wrong;
        reported += mine.ticks > 0 ? 1 : 0;
        stream.remove_reader(r);
      }
    });
  }
  Followed first;
  std::atomic<int> left{2};
  std::thread waits([&] {
    for (std::thread& other : others) other.join();
    stop = true;
  });
  while (!stop) first.drain(stays);
  waits.join();
  servo.join();
  first.drain(stays);
  EXPECT_EQ(first.wrong, 0u);
  EXPECT_EQ(first.ticks, published);
  EXPECT_EQ(stays.dropped, 0u);
  EXPECT_EQ(stays.actions_dropped, 0u);
  EXPECT_EQ(wrong, 0u);
  EXPECT_GE(reported, 250u);
}

TEST(Stream, HasRoomForSoManyReadersAndForOthersWhenTheyLeave) {
  Stream stream;
  std::vector<StreamReader*> readers;
  for (std::size_t n = 0; n < Stream::kMaxReaders; ++n) readers.push_back(&stream.add_reader(16, 16));
  EXPECT_THROW(stream.add_reader(16, 16), Error);
  stream.remove_reader(*readers[3]);
  StreamReader& another = stream.add_reader(16, 16);
  TickRecord record;
  record.tick = 77;
  stream.publish(record, {});
  EXPECT_EQ(another.first_tick, 77u);
  EXPECT_EQ(another.ticks.pop({&record, 1}), 1u);
  EXPECT_EQ(readers[0]->ticks.pop({&record, 1}), 1u);
}

// Bone is taken, then not for a while: a stroke.
TEST(Servo, TellsWhenAStrokeEnds) {
  BrickGrid bone = test::slab(0.5);
  HapticSetup setup;
  setup.device = SpringHand::traits();
  HapticRenderer renderer(setup, bone, {}, 1e-3);
  Strokes s;
  s.axis = {0, 0, 1};
  // Down, up for 0.2 s (the same stroke), down again, up.
  s.waypoints = {{0, {0, 0, 6}, true},     {0.3, {0, 0, 1.7}, true}, {0.5, {0, 0, 1.5}, true},
                 {0.55, {0, 0, 6}, true},  {0.65, {0, 0, 6}, true},  {0.7, {0, 0, 1.5}, true},
                 {1.0, {0, 0, 1.2}, true}, {1.05, {0, 0, 6}, false}, {2, {0, 0, 6}, false}};
  ScriptedDevice device(s, 1000);
  Stream stream;
  StreamReader& reader = stream.add_reader();
  Servo servo(renderer, device, stream, 1000);
  std::uint64_t last_removal = 0, longest_pause = 0;
  std::vector<std::uint64_t> ends;
  while (servo.step(0)) {
    TickRecord record;
    ASSERT_EQ(reader.ticks.pop({&record, 1}), 1u);
    VoxelChange c;
    while (reader.changes.pop({&c, 1}) == 1) {
      EXPECT_LT(c.density, c.before);
    }
    if (record.voxels_changed > 0) {
      if (last_removal > 0) longest_pause = std::max(longest_pause, record.tick - last_removal);
      last_removal = record.tick;
    }
    SceneAction a;
    while (reader.actions.pop({&a, 1}) == 1) {
      ASSERT_TRUE(a.is(ActionKind::stroke));
      EXPECT_EQ(a.tick, record.tick);
      ends.push_back(a.tick);
    }
  }
  EXPECT_GT(longest_pause, 100u);
  EXPECT_LT(longest_pause, 300u);
  ASSERT_EQ(ends.size(), 1u);
  EXPECT_EQ(ends[0], last_removal + 301);
}

}  // namespace
}  // namespace osteo
