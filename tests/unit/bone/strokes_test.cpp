// Undo of what the burr took, between all that is done to a scene besides.
#include <gtest/gtest.h>

#include <random>

#include "bar.h"
#include "osteo/simulation/bone/world.h"

namespace osteo {
namespace {

constexpr auto kUndo = ActionKind::undo;

// As a servo would: densities fall, the stream tells of it.
void drill(World& w, std::mt19937& random, std::size_t voxels) {
  for (std::size_t n = 0; n < voxels; ++n) {
    const PlacedBody& body = w.bodies()[random() % w.bodies().size()];
    BrickGrid& bone = body.body->bone;
    const VoxelKey v = random() % static_cast<std::uint32_t>(bone.brick_count() * BrickGrid::kVoxels);
    const float before = bone.value(v), after = before * static_cast<float>(random() % 3) / 3;
    if (after == before) continue;
    bone.set(v, after);
    const VoxelChange change{body.body->name_of(v), after, before};
    w.notify({&change, 1});
  }
}

void done(World& w, const SceneAction& a) {
  if (w.act(a).done) w.notify(a);
}

TEST(Strokes, AreTakenBackBetweenAllElseInEveryOrderToTheBit) {
  // Every sequence of five steps out of five kinds, then back step by step.
  std::size_t undone = 0;
  for (int order = 0; order < 5 * 5 * 5 * 5 * 5; order += 3) {
    std::mt19937 random(static_cast<unsigned>(order));
    World w(test::bar(1, 0.4));
    std::vector<std::string> hashes{w.hash()};
    std::size_t steps = 0;
    int code = order;
    double place = -8;
    for (int n = 0; n < 5; ++n, code /= 5) {
      switch (code % 5) {
        case 0:
          drill(w, random, 3000);
          w.notify(SceneAction::plain(ActionKind::stroke));
          break;
        case 1:
          done(w, SceneAction::saw({{place += 4, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1.5}));
          break;
        case 2:
          done(w, SceneAction::split(1));
          break;
        case 3:
          done(w, SceneAction::move(w.bodies().back().body->id, {{}, {0, 0.5 * n, 1}}));
          break;
        case 4:
          drill(w, random, 1000);  // goes on until something else is done
          break;
      }
      // A step more, or (rejected, or the same piece moved on, or the stroke went on) the last one became another.
      if (w.undo_steps() == steps) {
        hashes.back() = w.hash();
      } else {
        ASSERT_EQ(w.undo_steps(), steps + 1);
        hashes.push_back(w.hash());
        ++steps;
      }
    }
    for (; steps > 0; --steps) {
      ASSERT_EQ(w.hash(), hashes[steps]) << order << " with " << steps << " steps";
      ASSERT_TRUE(w.act(SceneAction::plain(kUndo)).done);
      ASSERT_EQ(w.undo_steps(), steps - 1);
      ++undone;
    }
    ASSERT_EQ(w.hash(), hashes[0]) << order;
    EXPECT_FALSE(w.act(SceneAction::plain(kUndo)).done);
  }
  EXPECT_GT(undone, 2000u);
}

// The servo takes up a move later than the world was moved: what it drilled meanwhile comes before the move, as the
// stream says.
TEST(Strokes, TheStreamTellsWhatCameFirst) {
  std::mt19937 random(1);
  World live(test::bar(1, 0));
  World later = live.copy();
  const SceneAction first = SceneAction::move(0, {{}, {1, 0, 0}}), second = SceneAction::move(0, {{}, {2, 0, 0}});
  const auto both = [&](const VoxelChange& c, bool write) {
    if (write) later.bodies()[0].body->bone.set(c.voxel, c.density);
    later.notify({&c, 1});
  };
  BrickGrid& bone = live.bodies()[0].body->bone;
  std::vector<VoxelChange> changes;
  for (VoxelKey v = 0; v < bone.brick_count() * BrickGrid::kVoxels && changes.size() < 2; ++v) {
    if (bone.value(v) == 1) changes.push_back({v, 0.25F, 1});
  }
  ASSERT_EQ(changes.size(), 2u);
  for (const VoxelChange& c : changes) bone.set(c.voxel, c.density);
  // Live: moved twice before anything is heard; then move, stroke, move.
  live.act(first);
  live.act(second);
  live.notify({&changes[0], 1});
  live.notify(first);
  live.notify({&changes[1], 1});
  live.notify(second);
  // The same from a recording.
  both(changes[0], true);
  later.act(first);
  later.notify(first);
  both(changes[1], true);
  later.act(second);
  later.notify(second);
  ASSERT_EQ(live.hash(), later.hash());
  ASSERT_EQ(live.undo_steps(), 4u);
  for (std::size_t steps = 4; steps > 0; --steps) {
    ASSERT_EQ(later.undo_steps(), steps);
    ASSERT_TRUE(live.act(SceneAction::plain(kUndo)).done);
    ASSERT_TRUE(later.act(SceneAction::plain(kUndo)).done);
    EXPECT_EQ(live.hash(), later.hash()) << steps;
  }
  EXPECT_EQ(live.bodies()[0].body->bone.value(changes[0].voxel), 1.0F);
  EXPECT_EQ(live.hash(), World(test::bar(1, 0)).hash());
}

// Neither more nor other than a replay, which knows all: rather nothing.
TEST(Strokes, WhatWasMissedIsNotTakenBack) {
  std::mt19937 random(2);
  World w(test::bar(1, 0));
  const SceneAction ended = SceneAction::plain(ActionKind::stroke), undo = SceneAction::plain(kUndo);
  const SceneAction move = SceneAction::move(0, {{}, {1, 0, 0}}), on = SceneAction::move(0, {{}, {2, 0, 0}});
  drill(w, random, 1000);
  w.notify(ended);
  done(w, move);
  w.forget();
  EXPECT_EQ(w.undo_steps(), 0u);
  const World::Effect refused = w.act(undo);
  EXPECT_FALSE(refused.done);
  EXPECT_NE(refused.message.find("no longer known"), std::string::npos) << refused.message;
  // A move that may go on one that was missed, and the end of a stroke: not known whole.
  done(w, on);
  EXPECT_FALSE(w.act(undo).done);
  drill(w, random, 1000);
  EXPECT_FALSE(w.act(undo).done);
  w.notify(ended);
  EXPECT_FALSE(w.act(undo).done);
  // From here on all is known again.
  const std::string before = w.hash();
  drill(w, random, 1000);
  w.notify(ended);
  EXPECT_NE(w.hash(), before);
  EXPECT_EQ(w.undo_steps(), 1u);
  ASSERT_TRUE(w.act(undo).done);
  EXPECT_EQ(w.hash(), before);
  EXPECT_FALSE(w.act(undo).done);
  // So it is behind a cut, whatever was missed before.
  w.forget();
  done(w, SceneAction::saw({{2, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1.5}));
  ASSERT_TRUE(w.act(undo).done);
  EXPECT_EQ(w.hash(), before);
}

TEST(Strokes, MemoryIsBounded) {
  World w(test::bar(0.25, 0));
  BrickGrid& bone = w.bodies()[0].body->bone;
  const auto voxels = static_cast<std::uint32_t>(bone.brick_count() * BrickGrid::kVoxels);
  ASSERT_GT(voxels, 1000000u);
  // Half a million voxels a stroke, 6 MB: ten of them are known, then the oldest goes.
  constexpr std::uint32_t kVoxels = 500000;
  const std::size_t most = World::kMaxStrokeBytes / (12 * kVoxels);
  std::vector<VoxelChange> changes(kVoxels);
  std::vector<std::string> hashes;
  done(w, SceneAction::move(0, {{}, {1, 0, 0}}));
  for (std::uint32_t n = 0; n < most + 3; ++n) {
    hashes.push_back(w.hash());
    for (std::uint32_t i = 0; i < kVoxels; ++i) {
      const VoxelKey v = (n * 131071 + i) % voxels;
      changes[i] = {v, bone.value(v) * 0.5F, bone.value(v)};
      bone.set(v, changes[i].density);
    }
    w.notify(changes);
    w.notify(SceneAction::plain(ActionKind::stroke));
    EXPECT_EQ(w.undo_steps(), n + 1 <= most ? n + 2 : most);
  }
  for (std::size_t n = 0; n < most; ++n) {
    ASSERT_TRUE(w.act(SceneAction::plain(kUndo)).done);
    EXPECT_EQ(w.hash(), hashes[most + 2 - n]);
  }
  EXPECT_NE(w.act(SceneAction::plain(kUndo)).message.find("no longer known"), std::string::npos);
}

}  // namespace
}  // namespace osteo
