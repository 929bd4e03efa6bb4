// The recorder in front of disks that stall, fill up and fail.
#include <gtest/gtest.h>
#include <unistd.h>

#include <condition_variable>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <random>
#include <thread>

#include "osteo/core/base/files.h"
#include "osteo/session/recording/recorder.h"
#include "osteo/session/recording/session_reader.h"
#include "stalling_disk.h"

namespace osteo {
namespace {

fs::path fresh(const std::string& name) {
  const auto p = fs::temp_directory_path() / ("osteo-recorder-" + std::to_string(::getpid()) + "-" + name);
  fs::remove_all(p);
  return p;
}

SessionHeader header() {
  SessionHeader h;
  h.program_version = "test";
  h.bone_hash = "abc";
  return h;
}

using test::Disk;
using test::StallingSink;

// A servo that drills: each tick changes voxels, and takes an action now and then.
class Servo {
 public:
  explicit Servo(StreamReader& reader) : reader_(reader) {}
  void run(std::uint64_t ticks, std::size_t changes_a_tick) {
    std::vector<VoxelChange> changes(changes_a_tick);
    for (std::uint64_t n = 0; n < ticks; ++n, ++next) {
      for (auto& c : changes) {
        c = {static_cast<VoxelKey>(random_() % 50000), static_cast<float>(random_() % 1000) / 1000};
        bone[c.voxel] = c.density;
      }
      if (next % 5000 == 4999) {
        SceneAction a = next % 2 == 0 ? SceneAction::plain(ActionKind::undo)
                                      : SceneAction::suction({1, 2, 3}, 4, static_cast<double>(next));
        a.tick = next;
        while (!reader_.actions.push(a)) std::this_thread::sleep_for(std::chrono::microseconds(200));
        ++actions;
      }
      TickRecord t;
      t.tick = next;
      t.voxels_changed = static_cast<std::uint32_t>(changes_a_tick);
      t.removed_mm3 = static_cast<float>(next % 100);
      // The servo would drop what the ring has no room for; here the recorder's first thread is waited for, the disk
      // never.
      while (reader_.ticks.room() < 1 || !reader_.changes.push(changes))
        std::this_thread::sleep_for(std::chrono::microseconds(200));
      reader_.ticks.push(t);
    }
  }
  void wait_until_taken() const {
    while (reader_.ticks.room() < Recorder::kTickCapacity) std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  std::uint64_t next = 0, actions = 0;
  std::map<VoxelKey, float> bone;

 private:
  StreamReader& reader_;
  std::mt19937 random_{5};
};

void expect_same_bone(const Session& s, const std::map<VoxelKey, float>& bone) {
  std::map<VoxelKey, float> got;
  for (const VoxelChange& c : s.changes) got[c.voxel] = c.density;
  EXPECT_EQ(got.size(), bone.size());
  std::size_t wrong = 0;
  for (const auto& [voxel, density] : bone) wrong += got[voxel] == density ? 0 : 1;
  EXPECT_EQ(wrong, 0u);
}

TEST(Recorder, AMinuteOfStallingDiskLosesNothing) {
  const auto path = fresh("minute");
  Disk disk;
  StreamReader reader(Recorder::kTickCapacity, 1 << 21);
  Servo servo(reader);
  {
    Recorder recorder(reader, std::make_unique<StallingSink>(disk, path), header());
    recorder.start();
    servo.run(1000, 60);
    disk.stall(true);
    servo.run(60000, 60);  // 60 s at 1 kHz: 36 MB before they are compressed
    servo.wait_until_taken();
    EXPECT_GT(recorder.status().waiting_bytes, 8u << 20);
    EXPECT_LT(recorder.status().waiting_bytes, Recorder::kMaxWaitingBytes);
    EXPECT_GT(recorder.status().behind_s, 0);
    EXPECT_EQ(recorder.status().ticks_lost, 0u);
    disk.stall(false);
    servo.run(1000, 60);
    recorder.finish({servo.next, "bone", "surface", 1, {}, 0, 0});
    EXPECT_FALSE(recorder.status().failure);
    EXPECT_EQ(recorder.status().waiting_bytes, 0u);
  }
  const Session s = read_session(path);
  EXPECT_EQ(s.ticks.size(), 62000u);
  EXPECT_TRUE(s.gaps.empty());
  EXPECT_EQ(s.actions.size(), servo.actions);
  ASSERT_TRUE(s.end);
  EXPECT_EQ(s.end->ticks_lost, 0u);
  expect_same_bone(s, servo.bone);
  fs::remove(path);
}

TEST(Recorder, ALongerStallIsAGapThatIsCountedAndBoneBehindItIsRight) {
  const auto path = fresh("gap");
  Disk disk;
  StreamReader reader(Recorder::kTickCapacity, 1 << 21);
  Servo servo(reader);
  std::vector<RecordingGap> gaps;
  constexpr std::size_t kMax = 1 << 20;
  {
    Recorder recorder(reader, std::make_unique<StallingSink>(disk, path), header(), kMax);
    recorder.start();
    for (int stall = 0; stall < 2; ++stall) {
      servo.run(2000, 40);
      servo.wait_until_taken();
      disk.stall(true);
      servo.run(stall == 0 ? 300000 : 60000, 4);  // 300 s at 1 kHz
      servo.wait_until_taken();
      EXPECT_GT(recorder.status().ticks_lost, 1000u);
      EXPECT_LT(recorder.status().waiting_bytes, kMax + (1 << 18)) << "memory is bounded";
      disk.stall(false);
      while (recorder.status().waiting_bytes > 0) std::this_thread::sleep_for(std::chrono::microseconds(200));
      servo.run(3000, 40);
    }
    recorder.finish({servo.next, "bone", "surface", 1, {}, 0, 0});
    gaps = recorder.gaps();
    EXPECT_EQ(gaps.size(), 2u);
  }
  const Session s = read_session(path);
  ASSERT_EQ(s.gaps.size(), 2u);
  std::uint64_t lost = 0;
  for (std::size_t g = 0; g < 2; ++g) {
    EXPECT_EQ(s.gaps[g].first_tick, gaps[g].first_tick);
    EXPECT_EQ(s.gaps[g].ticks, gaps[g].ticks);
    EXPECT_FALSE(s.gaps[g].bone_lost);
    const auto behind =
        std::find_if(s.ticks.begin(), s.ticks.end(), [&](const TickRecord& t) { return t.tick > gaps[g].first_tick; });
    ASSERT_TRUE(behind != s.ticks.end() && behind != s.ticks.begin());
    EXPECT_EQ(behind->tick, gaps[g].first_tick + gaps[g].ticks);
    EXPECT_EQ(std::prev(behind)->tick + 1, gaps[g].first_tick);
    lost += gaps[g].ticks;
  }
  EXPECT_EQ(s.ticks.size() + lost, servo.next);
  EXPECT_EQ(s.end->ticks_lost, lost);
  EXPECT_EQ(s.ticks.back().tick, servo.next - 1);
  EXPECT_EQ(s.actions.size(), servo.actions) << "what was done is kept";
  EXPECT_EQ(s.bone_known_until(), nullptr);
  expect_same_bone(s, servo.bone);
  const auto lines = losses(s);
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_NE(lines[0].find("ticks " + std::to_string(gaps[0].first_tick) + " to "), std::string::npos) << lines[0];
  fs::remove(path);
}

// Changes in a gap stand before the actions that they came before, where that matters.
TEST(Recorder, ActionsInAGapKeepTheirPlaceAmongChangesOfBone) {
  const auto path = fresh("order");
  Disk disk;
  StreamReader reader(1 << 10, 1 << 12);
  {
    SessionHeader slow = header();
    slow.rate_hz = 10;  // a frame each tick
    Recorder recorder(reader, std::make_unique<StallingSink>(disk, path), slow, 1 << 10);
    recorder.start();
    disk.stall(true);
    const auto tick = [&](std::uint64_t n, float density) {
      TickRecord t;
      t.tick = n;
      t.voxels_changed = 1;
      reader.changes.push(VoxelChange{7, density});
      reader.ticks.push(t);
      while (reader.ticks.room() < 1 << 10) std::this_thread::sleep_for(std::chrono::microseconds(200));
    };
    for (std::uint64_t n = 0; n < 50; ++n) tick(n, 0.9F);
    SceneAction split = SceneAction::split(3);
    split.tick = 50;
    reader.actions.push(split);
    tick(50, 0.2F);
    disk.stall(false);
    while (recorder.status().waiting_bytes > 0) std::this_thread::sleep_for(std::chrono::microseconds(200));
    for (std::uint64_t n = 51; n < 60; ++n) tick(n, 0.1F);
    recorder.finish({60, "", "", 0, {}, 0, 0});
  }
  const Session s = read_session(path);
  ASSERT_EQ(s.gaps.size(), 1u);
  ASSERT_EQ(s.actions.size(), 1u);
  ASSERT_GT(s.actions[0].changes_before, 0u);
  EXPECT_EQ(s.changes[s.actions[0].changes_before - 1].density, 0.9F);
  ASSERT_GT(s.changes.size(), s.actions[0].changes_before);
  EXPECT_EQ(s.changes[s.actions[0].changes_before].density, 0.2F);
  fs::remove(path);
}

// Its own thread did not come to run, and the ring was full.
TEST(Recorder, WhatTheRingHadNoRoomForIsAGapAndBoneIsWrittenAtTheEnd) {
  const auto path = fresh("ring");
  Stream stream;
  StreamReader& reader = stream.add_reader(64, 1 << 10);
  std::map<VoxelKey, float> bone;
  const auto run = [&](std::uint64_t from, std::uint64_t to) {
    for (std::uint64_t n = from; n < to; ++n) {
      const VoxelChange c{static_cast<VoxelKey>(n), 0.5F};
      bone[c.voxel] = c.density;
      TickRecord t;
      t.tick = n;
      t.voxels_changed = 1;
      stream.publish(t, {&c, 1});
    }
  };
  {
    Recorder recorder(reader, path, header());
    run(0, 40);
    recorder.drain();
    run(40, 200);  // 64 of them fit
    recorder.drain();
    run(200, 230);
    recorder.drain();
    run(230, 330);  // the last are lost, and no tick tells
    recorder.finish({330, "", "", 0, {}, 0, 0}, [&](std::vector<VoxelChange>& all) {
      for (const auto& [voxel, density] : bone) all.push_back({voxel, density});
    });
    EXPECT_EQ(recorder.status().ticks_lost, 96u + 36u);
  }
  const Session s = read_session(path);
  ASSERT_EQ(s.gaps.size(), 2u);
  EXPECT_EQ(s.gaps[0].first_tick, 104u);
  EXPECT_EQ(s.gaps[0].ticks, 96u);
  EXPECT_TRUE(s.gaps[0].bone_lost);
  EXPECT_EQ(s.gaps[1].first_tick, 294u);
  EXPECT_EQ(s.gaps[1].ticks, 36u);
  EXPECT_EQ(s.ticks.size(), 330u - 96 - 36);
  expect_same_bone(s, bone);
  EXPECT_EQ(s.bone_known_until(), nullptr);
  Session killed = s;
  killed.end.reset();
  EXPECT_EQ(killed.bone_known_until(), &killed.gaps[0]) << "without its end nobody knows";
  fs::remove(path);
}

class FullDisk final : public SessionSink {
 public:
  FullDisk(std::size_t room, bool odd, std::unique_ptr<SessionSink> file)
      : room_(room), odd_(odd), file_(std::move(file)) {}
  void write(std::span<const std::byte> bytes) override {
    if (bytes.size() > room_) {
      if (odd_) throw std::runtime_error("something unforeseen");
      throw Error(ExitCode::cannot_write, "No space left on device");
    }
    room_ -= bytes.size();
    file_->write(bytes);
  }
  void sync() override { file_->sync(); }

 private:
  std::size_t room_;
  bool odd_;
  std::unique_ptr<SessionSink> file_;
};

TEST(Recorder, AFullDiskIsToldAtOnceAndRemembered) {
  for (const bool by_thread : {true, false}) {
    for (const bool odd : {true, false}) {
      const auto path = fresh("full");
      StreamReader reader(Recorder::kTickCapacity, 1 << 21);
      Servo servo(reader);
      {
        Recorder recorder(reader, std::make_unique<FullDisk>(100000, odd, session_file(path)), header());
        if (by_thread) recorder.start();
        servo.run(200, 10);
        if (!by_thread) recorder.drain();
        while (by_thread && recorder.status().waiting_bytes > 0)
          std::this_thread::sleep_for(std::chrono::microseconds(200));
        EXPECT_FALSE(recorder.status().failure);
        // While it runs, long before anybody closes it; the ring is emptied all the same.
        for (int n = 0; n < 400; ++n) {
          servo.run(50, 100);
          if (!by_thread) recorder.drain();
        }
        while (by_thread && !recorder.status().failure) std::this_thread::sleep_for(std::chrono::microseconds(200));
        ASSERT_TRUE(recorder.status().failure);
        EXPECT_NE(std::string(recorder.status().failure->what()).find(odd ? "unforeseen" : "No space left"),
                  std::string::npos);
        recorder.stop();
        recorder.finish({servo.next, "", "", 0, {}, 0, 0});
        EXPECT_TRUE(recorder.status().failure);
      }
      const Session s = read_session(path);
      // Its thread may come to the first ticks together with later ones that find no room.
      EXPECT_GE(s.ticks.size(), by_thread ? 1u : 200u);
      EXPECT_LT(s.ticks.size(), servo.next);
      EXPECT_FALSE(s.end) << "a session that failed is not closed";
      fs::remove(path);
    }
  }
}

TEST(Recorder, EndsOnce) {
  const auto path = fresh("once");
  StreamReader reader(1 << 10, 1 << 12);
  {
    Recorder recorder(reader, path, header());
    TickRecord t;
    reader.ticks.push(t);
    recorder.finish({1, "bone", "", 0, {}, 0, 0});
    const auto bytes = recorder.bytes();
    recorder.finish({1, "other", "", 0, {}, 0, 0});
    recorder.stop();
    EXPECT_EQ(recorder.bytes(), bytes);
  }
  EXPECT_EQ(read_session(path).end->bone_hash, "bone");
  fs::remove(path);
}

// From several threads, while ticks are recorded.
TEST(Recorder, NotesKeepTheirOrderAndWhatFindsNoRoomIsCounted) {
  const auto path = fresh("notes");
  Disk disk;
  StreamReader reader(Recorder::kTickCapacity, 1 << 21);
  Servo servo(reader);
  {
    Recorder recorder(reader, std::make_unique<StallingSink>(disk, path), header());
    recorder.start();
    std::vector<std::thread> threads;
    for (int t = 0; t < 3; ++t) {
      threads.emplace_back([&recorder, t] {
        for (int n = 0; n < 500; ++n)
          recorder.note({static_cast<std::uint64_t>(n), "thread " + std::to_string(t), std::to_string(n)});
      });
    }
    servo.run(3000, 5);
    for (auto& t : threads) t.join();
    recorder.note({1, "odd", "no \"JSON\" \xff\n at all"});
    recorder.note({2, "long", std::string(Recorder::kLongestNote + 1, '1')});
    servo.wait_until_taken();
    EXPECT_EQ(recorder.status().notes_lost, 1u);
    recorder.finish({servo.next, "", "", 0, {}, 0, 0});
    recorder.note({3, "late", "1"});
    EXPECT_EQ(recorder.status().notes_lost, 2u);
  }
  const Session s = read_session(path);
  ASSERT_EQ(s.notes.size(), 1501u);
  std::map<std::string, int> next;
  for (const Note& n : s.notes) {
    if (n.kind == "odd") {
      EXPECT_EQ(n.json.substr(0, 15), "\"no \\\"JSON\\\" \xef\xbf") << n.json;
      continue;
    }
    EXPECT_EQ(n.json, std::to_string(next[n.kind]++)) << n.kind;
  }
  EXPECT_EQ(next["thread 0"], 500);
  EXPECT_EQ(s.ticks.size(), 3000u);
  ASSERT_TRUE(s.end);
  EXPECT_EQ(s.end->notes_lost, 1u);
  fs::remove(path);
}

// While nothing can be written notes wait, as many as there is room for.
TEST(Recorder, NotesWaitWhileTheDiskStalls) {
  const auto path = fresh("patient");
  StreamReader reader(Recorder::kTickCapacity, 1 << 21);
  Servo servo(reader);
  {
    Recorder recorder(reader, path, header());
    for (std::size_t n = 0; n < Recorder::kMaxNotes + 7; ++n) recorder.note({n, "n", "{}"});
    EXPECT_EQ(recorder.status().notes_lost, 7u);
    servo.run(250, 1);
    recorder.drain();
    recorder.note({250, "n", "{}"});
    EXPECT_EQ(recorder.status().notes_lost, 7u) << "there is room again";
    recorder.finish({servo.next, "", "", 0, {}, 0, 0});
  }
  EXPECT_EQ(read_session(path).notes.size(), Recorder::kMaxNotes + 1);
  fs::remove(path);
}

// What a checkpoint holds is what came before it, the shortest way; and each action that looks at bone finds the bone
// it found.
TEST(SessionFile, CheckpointsHoldTheSameSceneInLess) {
  const auto path = fresh("checkpoints");
  SessionHeader h = header();
  h.rate_hz = 10;  // a checkpoint each 600 ticks
  std::mt19937 random(4);
  {
    SessionWriter w(path, h);
    for (std::uint64_t t = 0; t < 2000; ++t) {
      SessionBatch b;
      b.ticks.resize(1);
      b.ticks[0].tick = t;
      for (int c = 0; c < 5; ++c)
        b.changes.push_back({static_cast<VoxelKey>(random() % 50), static_cast<float>(random() % 100)});
      if (t % 7 == 3) b.actions.push_back(SceneAction::plain(ActionKind::soft_push));
      if (t % 100 == 50) b.actions.push_back(SceneAction::move(static_cast<std::uint32_t>(t), {}));
      if (t % 150 == 70) b.actions.insert(b.actions.begin(), SceneAction::split(static_cast<double>(t)));
      for (SceneAction& a : b.actions) a.tick = t;
      w.append(b);
    }
    w.finish({2000, "", "", 0, {}, 0, 0});
  }
  const SessionReader reader(path);
  // Bone, and what each split found.
  struct Scene {
    std::map<VoxelKey, float> bone;
    std::map<double, std::map<VoxelKey, float>> found;
    std::vector<std::uint32_t> moves;
    std::size_t changes = 0;
    void take(const SessionPart& p) {
      for (const SceneAction& a : p.actions) {
        if (a.is(ActionKind::split)) found[a.values[0]] = bone;
        if (a.is(ActionKind::move)) moves.push_back(a.body);
        EXPECT_FALSE(p.checkpoint);
      }
      for (const VoxelChange& c : p.changes) bone[c.voxel] = c.density;
      changes += p.changes.size();
    }
  };
  Scene all, shorter;
  auto parts = reader.parts(), checkpoints = reader.checkpoints();
  std::vector<std::uint64_t> marks;
  while (const SessionPart* const p = parts.next()) {
    all.take(*p);
    if (!p->checkpoint) continue;
    marks.push_back(*p->checkpoint);
    for (const SessionPart* q = checkpoints.next(); q != nullptr; q = checkpoints.next()) {
      if (q->checkpoint) {
        EXPECT_EQ(*q->checkpoint, marks.back());
        break;
      }
      for (const SceneAction& a : q->actions)
        EXPECT_FALSE(a.is(ActionKind::soft_push)) << "nothing of the scene follows from it";
      shorter.take(*q);
    }
    EXPECT_EQ(shorter.bone, all.bone);
    EXPECT_EQ(shorter.found, all.found);
    EXPECT_EQ(shorter.moves, all.moves);
  }
  EXPECT_EQ(marks, (std::vector<std::uint64_t>{600, 1200, 1800, 2000}));
  EXPECT_LT(shorter.changes * 5, all.changes);  // 33 steps, each of which parts what came before from what comes behind
  // Any time: the same as everything up to there.
  for (const std::uint64_t tick : {0, 1, 599, 600, 601, 1199, 1250, 1999, 2000, 5000}) {
    std::uint64_t reached = 0;
    Scene seen, full;
    auto short_way = reader.scene_at(tick, reached);
    while (const SessionPart* const p = short_way.next()) seen.take(*p);
    EXPECT_EQ(reached, std::min<std::uint64_t>(tick, 2000));
    auto again = reader.parts();
    std::uint64_t next = 0;
    while (const SessionPart* const p = again.next()) {
      if (!p->ticks.empty()) next = p->ticks.back().tick + 1;
      const bool later = !p->actions.empty() && p->actions.front().tick >= reached;
      if (!later && next <= reached) full.take(*p);
    }
    EXPECT_EQ(seen.bone, full.bone) << tick;
    EXPECT_EQ(seen.found, full.found) << tick;
    EXPECT_EQ(seen.moves, full.moves) << tick;
  }
  // Killed in the middle of a checkpoint, or right behind it: it is not used, and nothing is missing.
  const std::string whole = read_text(path);
  const auto cut = fresh("cut-checkpoint");
  std::size_t cuts = 0;
  for (std::size_t at = 0; at < whole.size();) {
    std::uint32_t head[8];
    std::memcpy(head, whole.data() + at, sizeof head);
    at += sizeof head + head[2];
    if (head[1] != 4) continue;
    ++cuts;
    std::ofstream(cut, std::ios::binary) << whole.substr(0, at);
    const SessionReader shorter_file(cut);
    Scene seen, full;
    std::uint64_t reached = 0;
    auto short_way = shorter_file.scene_at(~std::uint64_t{0}, reached);
    while (const SessionPart* const p = short_way.next()) seen.take(*p);
    auto again = shorter_file.parts();
    while (const SessionPart* const p = again.next()) full.take(*p);
    EXPECT_EQ(seen.bone, full.bone);
    EXPECT_EQ(seen.moves, full.moves);
  }
  EXPECT_GT(cuts, 10u);
  fs::remove(cut);
  fs::remove(path);
}

// --- files that are damaged ---

struct Parts {
  std::string bytes;
  std::vector<std::pair<std::size_t, std::uint32_t>> frames;  // place and type
};
Parts small_session() {
  const auto path = fresh("small");
  {
    SessionWriter w(path, header());
    for (std::uint64_t b = 0; b < 3; ++b) {
      std::vector<TickRecord> ticks(4);
      for (std::size_t i = 0; i < 4; ++i) {
        ticks[i].tick = b * 4 + i;
        ticks[i].voxels_changed = 1;
      }
      w.append({{}, ticks, {{static_cast<VoxelKey>(b), 0.5F}}, {}});
      SceneAction a = SceneAction::split(static_cast<double>(b));
      a.tick = b * 4 + 4;
      w.append({{a}, {}, {}, {}});
    }
    w.append(RecordingGap{12, 5, false});
    std::vector<TickRecord> ticks(1);
    ticks[0].tick = 17;
    w.append({{}, ticks, {}, {}});
    w.finish({18, "bone", "surface", 1, {}, 0, 0});
  }
  Parts p{read_text(path), {}};
  for (std::size_t at = 0; at < p.bytes.size();) {
    std::uint32_t head[8];
    std::memcpy(head, p.bytes.data() + at, sizeof head);
    p.frames.emplace_back(at, head[1]);
    at += sizeof head + head[2];
  }
  fs::remove(path);
  return p;
}

// Every bit of the file, one at a time: rejected, or told.
TEST(SessionFile, NoFlippedBitIsOverlooked) {
  const Parts whole = small_session();
  const auto path = fresh("flips");
  std::size_t refused = 0, reported = 0, kept = 0;
  for (std::size_t at = 0; at < whole.bytes.size(); at += at < whole.frames[1].first ? 29 : 1) {  // of the header some
    for (int bit = static_cast<int>(at % 3); bit < 8; bit += 3) {
      std::string bytes = whole.bytes;
      bytes[at] = static_cast<char>(bytes[at] ^ (1 << bit));
      std::ofstream(path, std::ios::binary) << bytes;
      try {
        const Session s = read_session(path);
        ASSERT_GT(s.torn_bytes, 0u) << "byte " << at << " bit " << bit;
        ASSERT_FALSE(losses(s).empty());
        ASSERT_GE(at, whole.frames.back().first) << "only damage to the last frame looks like a cut";
        ++reported;
      } catch (const Error& e) {
        ASSERT_EQ(e.code(), ExitCode::corrupt);
        ++refused;
        if (at < whole.frames[1].first) continue;  // without its header nothing can be read
        const Session s = read_session(path, Damage::keep);
        ASSERT_TRUE(s.damaged());
        ASSERT_TRUE(s.end) << "frames behind it are read";
        ++kept;
      }
    }
  }
  EXPECT_GT(refused, reported);
  EXPECT_GT(kept, 500u);
  fs::remove(path);
}

TEST(SessionFile, FramesBehindDamageAreFoundAgain) {
  const Parts whole = small_session();
  const auto path = fresh("resync");
  // The magic of the second frame of ticks: those and nothing else are missing.
  std::size_t ticks_frames = 0;
  for (std::size_t f = 0; f < whole.frames.size(); ++f) {
    const auto [at, type] = whole.frames[f];
    if (type != 2 || ++ticks_frames != 3) continue;  // ticks, action, ticks
    std::string bytes = whole.bytes;
    bytes[at] = static_cast<char>(bytes[at] ^ 0x40);
    std::ofstream(path, std::ios::binary) << bytes;
    const Session s = read_session(path, Damage::keep);
    ASSERT_EQ(s.gaps.size(), 2u);
    EXPECT_EQ(s.gaps[0].at_byte, at);
    EXPECT_EQ(s.gaps[0].bytes, whole.frames[f + 1].first - at);
    EXPECT_EQ(s.gaps[0].first_tick, 4u);
    EXPECT_EQ(s.gaps[0].ticks, 4u);
    EXPECT_EQ(s.ticks[3].tick, 3u);
    EXPECT_EQ(s.bone_known_until(), &s.gaps[0]);
    ASSERT_EQ(s.ticks.size(), 9u);
    EXPECT_EQ(s.ticks[4].tick, 8u);
    EXPECT_EQ(s.actions.size(), 3u);
    try {
      static_cast<void>(read_session(path));
      FAIL();
    } catch (const Error& e) {
      EXPECT_NE(std::string(e.what()).find("damaged at byte " + std::to_string(at)), std::string::npos) << e.what();
      EXPECT_NE(std::string(e.what()).find("ticks 4 to 7 missing"), std::string::npos) << e.what();
    }
  }
  // Frames that are gone without a trace.
  std::string bytes = whole.bytes;
  bytes.erase(whole.frames[1].first, whole.frames[2].first - whole.frames[1].first);
  std::ofstream(path, std::ios::binary) << bytes;
  EXPECT_THROW(static_cast<void>(read_session(path, Damage::keep)), Error);
  fs::remove(path);
}

}  // namespace
}  // namespace osteo
