// Readers of a rehearsal: who joins and leaves, who reads a file, and strokes that are taken back.
#include "osteo/session/scene/reader.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <thread>

#include "bar.h"
#include "hole_script.h"
#include "osteo/session/recording/session_reader.h"
#include "osteo/session/scene/rehearsal.h"
#include "rewrite_session.h"
#include "scratch.h"

namespace osteo {
namespace {

// Holes in the bar's upper face.
Script holes(int count) {
  return test::holes(count, -10, 4.6);
}

SceneAction at(std::uint64_t tick, SceneAction a) {
  a.tick = tick;
  return a;
}

RehearsalOptions options(const std::filesystem::path& file) {
  RehearsalOptions o;
  o.session_file = file;
  o.follow = {true, true, true};
  o.haptics.device = SpringHand::traits();
  return o;
}

const SceneAction kUndo = SceneAction::plain(ActionKind::undo);

// The page on readers (docs/developer/readers.md) tells how to write one; this is its example: how long the burr
// pressed harder than it should.
class PressureScore final : public Reader {
 public:
  PressureScore(double most_n, double rate_hz) : most_n_(most_n), rate_hz_(rate_hz) {}
  void tick(const TickRecord& record, std::span<const VoxelChange> changes) override {
    ticks_ += static_cast<double>(record.normal_force_n) > most_n_ ? 1 : 0;
    for (const VoxelChange& c : changes) removed_ += static_cast<double>(c.before - c.density);
  }
  [[nodiscard]] double seconds() const { return static_cast<double>(ticks_) / rate_hz_; }
  [[nodiscard]] double removed() const { return removed_; }

 private:
  double most_n_, rate_hz_, removed_ = 0;
  std::uint64_t ticks_ = 0;
};

TEST(Readers, AScoreComesOutOfAFileAsItDidLive) {
  const test::ScratchFolder scratch;
  const World world(test::bar(0.5, 0.2));
  RehearsalOptions o = options(scratch / "score.oss");
  o.actions = {at(700, SceneAction::saw({{2, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1})), at(1700, SceneAction::split(20)),
               at(2700, kUndo)};
  Rehearsal r(world.copy(), std::make_unique<ScriptedDevice>(holes(4), 1000), o, {});
  PressureScore live(0.5, 1000);
  SurfaceReader surface(world, {});
  r.add_reader(live);
  r.add_reader(surface);
  const RehearsalSummary s = r.run_to_end({});
  EXPECT_GT(live.seconds(), 0.2);
  EXPECT_NEAR(live.removed() * 0.125, s.removed_mm3, 1e-3);
  EXPECT_EQ(surface.hash(), s.surface_hash);
  PressureScore again(0.5, 1000), other(1.0, 1000);
  PiecesReader pieces(world);
  std::vector<Reader*> readers{&again, &other, &pieces};
  const ReplayResult replayed = replay(SessionReader(o.session_file), world.copy(), {}, {}, readers);
  EXPECT_TRUE(replayed.identical) << replayed.difference;
  EXPECT_EQ(again.seconds(), live.seconds());
  EXPECT_EQ(again.removed(), live.removed());
  EXPECT_LT(other.seconds(), live.seconds());
  ASSERT_EQ(pieces.large_pieces().size(), s.pieces.size());
  for (std::size_t p = 0; p < s.pieces.size(); ++p) EXPECT_EQ(pieces.large_pieces()[p].mass, s.pieces[p].mass);
}

// Counts what it is told, and what it should not be.
class Witness final : public Reader {
 public:
  void resync(const World& world) override {
    ++resyncs;
    bodies = world.bodies().size();
  }
  void scene_changed(const World& world, const World::Effect& /*effect*/) override { bodies = world.bodies().size(); }
  void tick(const TickRecord& record, std::span<const VoxelChange> /*changes*/) override {
    wrong += last && record.tick != *last + 1 ? 1 : 0;
    wrong += gone ? 1 : 0;
    last = record.tick;
  }
  std::optional<std::uint64_t> last;
  std::size_t bodies = 0;
  std::atomic<bool> gone{false};
  int resyncs = 0, wrong = 0;
};

TEST(Readers, JoinAndLeaveAThousandTimesWhileOthersLoseNothing) {
  const test::ScratchFolder scratch;
  const World world(test::bar(0.5, 0.2));
  RehearsalOptions o = options(scratch / "join.oss");
  o.actions = {at(500, SceneAction::saw({{2, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1})), at(900, SceneAction::split(20)),
               at(1200, SceneAction::move(1, {{}, {0, 0, 1}})), at(1500, kUndo), at(1900, kUndo)};
  Rehearsal r(world.copy(), std::make_unique<ScriptedDevice>(holes(3), 1000), o, {});
  Witness stays;
  r.add_reader(stays);
  r.start();
  int wrong = 0, reported = 0, joins = 0, streams = 0;
  std::thread own([&] {
    // Ends of the stream itself, each read in this thread.
    for (; streams < 1000; ++streams) {
      StreamReader& end = r.stream().add_reader(1 << 8, 1 << 10);
      TickRecord record;
      end.ticks.pop({&record, 1});
      r.stream().remove_reader(end);
    }
  });
  std::unique_ptr<SurfaceReader> late;
  while (joins < 1000) {
    Witness w;
    r.add_reader(w);
    std::this_thread::sleep_for(std::chrono::microseconds(500));
    r.remove_reader(w);
    w.gone = true;
    if (++joins == 600) {  // and one that stays
      r.look([&](const World& now, SceneReaders&) { late = std::make_unique<SurfaceReader>(now, Context{}); });
      r.add_reader(*late);
    }
    wrong += w.wrong + (w.resyncs == 1 && w.bodies > 0 ? 0 : 1);
    reported += w.last ? 1 : 0;
  }
  own.join();
  while (r.running()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  const RehearsalSummary s = r.stop();
  EXPECT_EQ(joins, 1000);
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(reported, 50);
  EXPECT_EQ(stays.wrong, 0);
  EXPECT_EQ(stays.last, s.ticks - 1);
  EXPECT_EQ(stays.resyncs, 1);
  EXPECT_EQ(stays.bodies, s.bodies);
  EXPECT_EQ(s.ticks_not_followed, 0u);
  EXPECT_EQ(s.ticks_not_recorded, 0u);
  EXPECT_EQ(late->hash(), s.surface_hash);
  const ReplayResult again = replay(SessionReader(o.session_file), world.copy(), {}, {});
  EXPECT_TRUE(again.identical) << again.difference;
  EXPECT_EQ(again.bone_hash, s.bone_hash);
}

// A picture that takes longer than a ring lasts: surfaces catch up, and undo, counts and summary are as without it.
TEST(Readers, APictureOfManySecondsTakesNoUndoAway) {
  class Counter final : public Reader {
   public:
    void tick(const TickRecord& record, std::span<const VoxelChange>) override {
      removed_mm3 += static_cast<double>(record.removed_mm3);
    }
    double removed_mm3 = 0;
  };
  const std::string whole = test::bar(0.5, 0.2).hash();
  for (const int hands : {1, 2}) {
    const double rate = 36000.0 / hands;  // so that a third of a second is more than the ring holds
    const auto bone_after = [&](bool slow, int undos) {
      RehearsalOptions o;
      o.rate_hz = rate;
      o.haptics.device = SpringHand::traits();
      std::vector<std::unique_ptr<Device>> devices;
      for (int h = 0; h < hands; ++h) {
        Script hole = holes(1);
        for (auto& w : hole.waypoints) {
          w.t_s /= 3;
          w.at_mm.x += 12.0 * h;
        }
        devices.push_back(std::make_unique<ScriptedDevice>(hole, rate));
        if (h > 0) o.haptics.more_devices.push_back(SpringHand::traits());
      }
      Rehearsal r(World(test::bar(0.5, 0.2)), std::move(devices), o, {});
      Counter counter;
      r.add_counter(counter);
      if (slow) {
        r.look([&](const World&, SceneReaders&) {
          r.start();  // within, so that not one tick is followed before the end, however late a thread gets its turn
          while (r.running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        });
      }
      for (int n = 0; n < undos; ++n) r.act(kUndo);
      const RehearsalSummary s = slow ? r.stop() : r.run_to_end({});
      EXPECT_EQ(s.ticks_not_followed > 1000, slow) << s.ticks_not_followed << " of " << s.ticks;
      EXPECT_FALSE(s.refused());
      EXPECT_TRUE(s.warnings.empty());
      EXPECT_EQ(r.trouble(), "");
      EXPECT_NEAR(counter.removed_mm3, s.removed_mm3, 1e-9);
      EXPECT_GT(s.removed_mm3, 0.1);
      return s.bone_hash;
    };
    EXPECT_NE(bone_after(false, 0), whole);
    EXPECT_EQ(bone_after(false, 1), whole);
    EXPECT_EQ(bone_after(true, 1), whole);
  }
}

// The keeper itself kept from its work for longer than its ring lasts, which nothing but a machine at its end does.
TEST(Readers, WhereStrokesAreLostAllTheSameItIsTold) {
  class Sleeper final : public Reader {
   public:
    void tick(const TickRecord&, std::span<const VoxelChange>) override {
      while (rehearsal->running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    Rehearsal* rehearsal = nullptr;
  };
  RehearsalOptions o;
  o.rate_hz = 12000;
  o.haptics.device = SpringHand::traits();
  std::vector<std::unique_ptr<Device>> devices;
  for (int h = 0; h < 4; ++h) {  // so that the ring is full soon
    devices.push_back(std::make_unique<ScriptedDevice>(test::holes(1, -10.0 + 4 * h, 4.6), o.rate_hz));
    if (h > 0) o.haptics.more_devices.push_back(SpringHand::traits());
  }
  Rehearsal r(World(test::bar(0.5, 0.2)), std::move(devices), o, {});
  Sleeper sleeper;
  sleeper.rehearsal = &r;
  r.add_counter(sleeper);
  r.start();
  while (r.running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  r.act(kUndo);
  const RehearsalSummary s = r.stop();
  EXPECT_NE(r.trouble().find("undo history lost"), std::string::npos);
  ASSERT_EQ(s.warnings.size(), 1u);
  EXPECT_EQ(s.warnings.front(), r.trouble());
  ASSERT_TRUE(s.refused());
  EXPECT_NE(s.bone_hash, test::bar(0.5, 0.2).hash()) << "nothing else was taken back in its place";
}

// A reader that joins behind a split, with a sucker at work: it is right from there on.
TEST(Readers, ALateReaderIsRightFromThereOn) {
  World world(test::bar(0.5, 0.2));
  HapticSetup setup;
  setup.device = SpringHand::traits();
  ScriptedDevice device(holes(4), 1000);
  Stream stream;
  StreamReader& reader = stream.add_reader();
  Operation operation(std::move(world), setup, {}, device, stream, 1000);
  ReaderDispatcher dispatcher(reader, operation.world());
  dispatcher.add(operation.strokes(), false);
  // Made before anything was done, they join later all the same.
  SceneReaders late(operation.world(), {true, true, true}, 1000, {});
  double removed = 0;
  for (std::uint64_t t = 0; device.active(t); ++t) {
    const auto act = [&](const SceneAction& a) {
      dispatcher.drain();
      ASSERT_TRUE(operation.act(a, [&](const World::Effect& e) { dispatcher.scene_changed(e); }).done);
    };
    if (t == 100) act(SceneAction::suction({-6, 0, 4}, 6, 200));
    if (t == 900) act(SceneAction::saw({{2, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1}));
    if (t == 950) act(SceneAction::split(20));
    if (t == 1000) {
      dispatcher.drain();
      for (Reader* const r : {static_cast<Reader*>(late.surface.get()), static_cast<Reader*>(late.pieces.get()),
                              static_cast<Reader*>(late.dust.get())})
        dispatcher.add(*r);
      EXPECT_EQ(late.dust->dust().totals().added_mm3, 0);
      removed = operation.removed_mm3();
    }
    if (t == 2900) act(kUndo);  // of the third hole
    if (t == 2950) act(kUndo);  // and of the second
    if (t == 2990) act(kUndo);  // and of the split, which it never saw
    operation.step(0);
    if (t % 64 == 0) dispatcher.drain();
  }
  operation.finish();
  dispatcher.drain();
  dispatcher.end(operation.ticks());
  const SceneReaders fresh(operation.world(), {true, true, true}, 1000, {});
  EXPECT_EQ(operation.world().bodies().size(), 1u);
  EXPECT_EQ(late.surface_hash(), fresh.surface_hash());
  ASSERT_EQ(late.large_pieces().size(), fresh.large_pieces().size());
  for (std::size_t p = 0; p < fresh.large_pieces().size(); ++p)
    EXPECT_EQ(late.large_pieces()[p].voxels, fresh.large_pieces()[p].voxels);
  EXPECT_GT(late.dust->dust().totals().sucked_mm3, 0) << "it was told of the sucker that was there before it";
  EXPECT_NEAR(late.dust->dust().totals().added_mm3, operation.removed_mm3() - removed, 1e-3);
}

// Holes, a cut, a split and a move between them, and everything back, live and without a clock; the recording gives the
// same, both ways. Whoever holds a lock takes what it can in its time; what is left comes later, in its order.
TEST(Readers, ALittleAtATimeIsTheSame) {
  World world(test::bar(0.5, 0.2));
  HapticSetup setup;
  setup.device = SpringHand::traits();
  ScriptedDevice device(holes(1), 1000);
  Stream stream;
  StreamReader &first = stream.add_reader(), &second = stream.add_reader();
  Operation operation(std::move(world), setup, {}, device, stream, 1000);
  ReaderDispatcher whole(first, operation.world()), parts(second, operation.world());
  class Order final : public Reader {
   public:
    void action(const SceneAction& a) override { reported.push_back({a.tick, true}); }
    void tick(const TickRecord& r, std::span<const VoxelChange> c) override {
      reported.push_back({r.tick, false}), changes += c.size();
    }
    std::vector<std::pair<std::uint64_t, bool>> reported;
    std::size_t changes = 0;
  } at_once, by_and_by;
  whole.add(at_once, false);
  parts.add(by_and_by, false);
  std::uint64_t t = 0;
  for (; t < 700 && device.active(t); ++t) {
    if (t % 50 == 10) {
      ASSERT_TRUE(operation.act(SceneAction::suction({0, 0, double(t)}, 5, 200), [](const World::Effect&) {}).done);
    }
    operation.step(0);
  }
  const std::size_t taken = parts.drain(0);
  EXPECT_GT(taken, 0u);
  EXPECT_LT(taken, t / 2) << "some are left";
  while (parts.drain(0) > 0) {
  }
  whole.drain();
  EXPECT_EQ(by_and_by.reported, at_once.reported);
  EXPECT_EQ(by_and_by.changes, at_once.changes);
  EXPECT_EQ(at_once.reported.size(), t + 14);
}

TEST(Strokes, AreTakenBackLiveAndInAReplay) {
  const World world(test::bar(0.5, 0.2));
  // Holes end at 0.65 s of each second, strokes 0.3 s later.
  const std::vector<SceneAction> actions = {
      at(800, kUndo),                                                    // the first hole, whose stroke goes on still
      at(1990, SceneAction::saw({{2, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1})),  //
      at(2400, SceneAction::move(0, {{}, {0, 0, 0.2}})),                 // in the middle of the third hole: two strokes
      at(3400, kUndo),                   // in the middle of the fourth: what it took up to now
      at(3900, SceneAction::split(20)),  //
      at(4990, kUndo),                   // the fifth
      at(5700, kUndo),
      at(5800, kUndo),
      at(5810, kUndo),
      at(5820, kUndo),  // the sixth, split, what was left of the fourth, ...
      at(5830, kUndo),
      at(5840, kUndo),
      at(5850, kUndo),
      at(5860, kUndo),  // ... back to the first
      at(5870, kUndo),
      at(5880, kUndo),
      at(5890, kUndo),  // in real time a stroke may have come apart; else nothing is left
  };
  for (const bool by_the_clock : {false, true}) {
    const test::ScratchFolder scratch;
    RehearsalOptions o = options(scratch / "strokes.oss");
    o.actions = actions;
    Rehearsal r(world.copy(), std::make_unique<ScriptedDevice>(holes(6), 1000), o, {});
    RehearsalSummary s;
    if (by_the_clock) {
      r.start();
      while (r.running()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
      s = r.stop();
    } else {
      s = r.run_to_end({});
    }
    // In real time nothing is removed while a scene is prepared, on a busy machine for the length of whole holes.
    EXPECT_GT(s.removed_mm3, by_the_clock ? 0.0 : 2.0);
    EXPECT_EQ(s.bone_hash, world.hash()) << "all of it was taken back, to the bit";
    EXPECT_EQ(s.gone_mm3, 0) << "though " << s.removed_mm3 << " were drilled";
    EXPECT_EQ(s.surface_hash, SurfaceReader(world, {}).hash());
    EXPECT_EQ(s.bodies, 1u);
    ASSERT_TRUE(s.dust);
    EXPECT_NEAR(s.dust->added_mm3, s.removed_mm3 + s.sawn_mm3 + s.crumbs_mm3, 1e-3) << "what was drilled stays dust";
    const Session session = read_session(o.session_file);
    std::size_t strokes = 0;
    for (const RecordedAction& a : session.actions) strokes += a.action.is(ActionKind::stroke) ? 1 : 0;
    EXPECT_GE(strokes, by_the_clock ? 1u : 4u);
    const ReplayResult again = replay(SessionReader(o.session_file), world.copy(), {}, {});
    EXPECT_TRUE(again.identical) << again.difference << (by_the_clock ? " in real time" : "");
    EXPECT_EQ(again.bone_hash, s.bone_hash);
    World applied = world.copy();
    apply_recorded(SessionReader(o.session_file), applied);
    EXPECT_EQ(applied.hash(), s.bone_hash);
    // Another end of a stroke would be noticed.
    bool changed = false;
    test::rewrite_session(o.session_file, scratch / "other.oss", [&](SessionBatch& batch) {
      for (SceneAction& a : batch.actions) {
        if (a.is(ActionKind::stroke) && !std::exchange(changed, true)) ++a.tick;
      }
    });
    const ReplayResult other = replay(SessionReader(scratch / "other.oss"), world.copy(), {}, {});
    EXPECT_NE(other.difference.find("stroke"), std::string::npos) << other.difference;
  }
}

// Strokes in a session that goes on from another can be taken back too.
TEST(Strokes, OfTheSessionBeforeAreKnown) {
  const World world(test::bar(0.5, 0.2));
  const test::ScratchFolder scratch;
  RehearsalOptions o = options(scratch / "first.oss");
  Rehearsal first(world.copy(), std::make_unique<ScriptedDevice>(holes(2), 1000), o, {});
  const RehearsalSummary s = first.run_to_end({});
  World resumed = world.copy();
  apply_recorded(SessionReader(o.session_file), resumed);
  EXPECT_EQ(resumed.hash(), s.bone_hash);
  EXPECT_EQ(resumed.undo_steps(), 2u);
  const World start = resumed.copy();
  o.session_file = scratch / "second.oss";
  o.actions = {at(10, kUndo), at(20, kUndo), at(30, kUndo)};
  Rehearsal second(std::move(resumed), std::make_unique<ScriptedDevice>(holes(1), 1000), o, {});
  const RehearsalSummary back = second.run_to_end({});
  ASSERT_EQ(back.notes.size(), 1u);  // the third finds nothing
  EXPECT_FALSE(back.notes[0].done);
  const ReplayResult again = replay(SessionReader(o.session_file), start.copy(), {}, {});
  EXPECT_TRUE(again.identical) << again.difference;
  // One hole is left: the one drilled in the second session.
  EXPECT_NEAR(world.volume_mm3() - again.world->volume_mm3(), back.removed_mm3, 1e-3);
}

}  // namespace
}  // namespace osteo
