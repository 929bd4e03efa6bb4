#include "osteo/simulation/bone/world.h"

#include <gtest/gtest.h>

#include <malloc.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cmath>
#include <numbers>
#include <random>

#include "bar.h"
#include "osteo/core/base/error.h"
#include "osteo/geometry/mesh/mesh_info.h"
#include "osteo/simulation/bone/live_surface.h"
#include "osteo/simulation/bone/plates.h"

namespace osteo {

inline namespace simulation {  // where World's friend is
struct WorldProbe {
  static std::uint32_t& next_brick(World& w) { return w.next_brick_; }
  static std::uint32_t& next_body(World& w) { return w.next_body_; }
};
}  // namespace simulation

namespace {

using test::bar;

const SawCut kMiddle{{2, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1.0};

TEST(World, SawSplitMoveAndBackToTheBit) {
  World w(bar(0.5, 0.4));
  const std::string whole = w.hash();
  const double volume = w.volume_mm3();
  EXPECT_FALSE(w.act(SceneAction::split(1)).done);
  auto sawn = w.act(SceneAction::saw(kMiddle));
  ASSERT_TRUE(sawn.done);
  double dust = 0;
  for (const auto& [v, d] : sawn.dust) dust += static_cast<double>(d) * 0.125;
  EXPECT_NEAR(dust, 80, 3);
  EXPECT_NEAR(volume - w.volume_mm3(), dust, 1e-3);
  const auto split = w.act(SceneAction::split(1));
  ASSERT_TRUE(split.done);
  ASSERT_EQ(w.bodies().size(), 2u);
  EXPECT_NEAR(w.bodies()[0].body->bone.sum() * 0.125, 16.5 * 80, 30);
  EXPECT_NEAR(w.bodies()[1].body->bone.sum() * 0.125, 12.5 * 80, 30);
  // Every voxel of the stream has one owner.
  for (const auto& b : w.bodies()) EXPECT_EQ(w.owner(b.body->name_of(0)), &b);
  const auto away = rotation_about({5, 1, 2}, normalized({1, 1, 0}), 0.3);
  ASSERT_TRUE(w.act(SceneAction::move(1, away)).done);
  EXPECT_NE(w.hash(), whole);
  EXPECT_EQ(w.undo_steps(), 3u);
  ASSERT_TRUE(w.act(SceneAction::plain(ActionKind::undo)).done);
  EXPECT_EQ(w.bodies()[1].world_from_body.rotation, Mat3{});
  ASSERT_TRUE(w.act(SceneAction::plain(ActionKind::undo)).done);
  EXPECT_EQ(w.bodies().size(), 1u);
  ASSERT_TRUE(w.act(SceneAction::plain(ActionKind::undo)).done);
  EXPECT_EQ(w.hash(), whole);
  EXPECT_FALSE(w.act(SceneAction::plain(ActionKind::undo)).done);
}

// Where nobody else holds the body that is given back to, it is gone as soon as the first voxel is: its memory is
// overwritten here to see whether anything still reads it (as the address sanitizer sees it too).
TEST(World, UndoReadsNothingThatItGaveBack) {
  World w(bar(0.25, 0.4));
  const std::string whole = w.hash();
  ASSERT_TRUE(w.act(SceneAction::saw(kMiddle)).done);
  ASSERT_TRUE(w.act(SceneAction::split(1)).done);
  mallopt(M_PERTURB, 0x5a);
  const bool both =
      w.act(SceneAction::plain(ActionKind::undo)).done && w.act(SceneAction::plain(ActionKind::undo)).done;
  mallopt(M_PERTURB, 0);
  EXPECT_TRUE(both);
  EXPECT_EQ(w.hash(), whole);
}

// Bricks of `now` that lie where one of `before` does and are the same memory.
std::size_t shared_bricks(const BrickGrid& now, const BrickGrid& before) {
  std::size_t shared = 0;
  for (std::uint32_t b = 0; b < now.brick_count(); ++b) {
    const Ijk o = now.brick_coordinate(b);
    shared += now.shares_brick(b, before, before.find_brick(o.i, o.j, o.k)) ? 1 : 0;
  }
  return shared;
}

TEST(World, ActionsCopyOnlyTheBricksThatTheyChangeAndNeverWriteOldOnes) {
  World w(bar(0.25, 0.4));
  const auto old = w.bodies()[0].body;
  const std::string was = old->bone.hash();
  const std::size_t bricks = old->bone.brick_count();
  const auto sawn = w.act(SceneAction::saw(kMiddle));
  const auto& after_saw = w.bodies()[0].body->bone;
  ASSERT_EQ(sawn.changed.size(), 1u);
  EXPECT_EQ(shared_bricks(after_saw, old->bone), bricks - sawn.changed[0].bricks.size());
  EXPECT_LT(sawn.changed[0].bricks.size(), bricks / 4);
  EXPECT_EQ(old->bone.hash(), was);

  const auto whole = w.bodies()[0].body;
  const std::string before_split = whole->bone.hash();
  ASSERT_TRUE(w.act(SceneAction::split(1)).done);
  ASSERT_EQ(w.bodies().size(), 2u);
  BrickGrid &first = w.bodies()[0].body->bone, &second = w.bodies()[1].body->bone;
  EXPECT_GT(shared_bricks(first, whole->bone) + shared_bricks(second, whole->bone), bricks * 3 / 4);
  EXPECT_EQ(whole->bone.hash(), before_split);
  // No brick has two living owners: what is drilled in one piece cannot be felt in the other.
  EXPECT_EQ(shared_bricks(second, first), 0u);

  ASSERT_TRUE(w.act(SceneAction::plain(ActionKind::undo)).done);
  EXPECT_EQ(w.bodies()[0].body->bone.hash(), before_split);
  EXPECT_GT(shared_bricks(w.bodies()[0].body->bone, whole->bone), bricks * 3 / 4);
  // A copy of the world has everything for itself.
  const World copy = w.copy();
  EXPECT_EQ(shared_bricks(copy.bodies()[0].body->bone, w.bodies()[0].body->bone), 0u);
  ASSERT_TRUE(w.act(SceneAction::plain(ActionKind::undo)).done);
  EXPECT_EQ(w.bodies()[0].body->bone.hash(), was);
}

// The servo and others read the bone that is there by plain loads meanwhile: even a value that was there already may
// not be written again.
TEST(World, ActionsWriteNothingWhereOthersRead) {
  World w(bar(0.25, 0.4));
  const auto old = w.bodies()[0].body;  // keeps the block that all its bricks were made in
  const float* const first = old->bone.values_of_brick(0);
  const float* const end =
      old->bone.values_of_brick(static_cast<std::uint32_t>(old->bone.brick_count()) - 1) + BrickGrid::kVoxels;
  ASSERT_EQ(end - first, static_cast<std::ptrdiff_t>(old->bone.brick_count() * BrickGrid::kVoxels));
  const auto page = static_cast<std::uintptr_t>(::sysconf(_SC_PAGESIZE));
  const std::uintptr_t from = (reinterpret_cast<std::uintptr_t>(first) + page - 1) / page * page;
  const std::uintptr_t to = reinterpret_cast<std::uintptr_t>(end) / page * page;
  ASSERT_GT(to - from, 100 * page);
  ASSERT_EQ(::mprotect(reinterpret_cast<void*>(from), to - from, PROT_READ), 0);
  // Kerfs as narrow as that leave bricks near both parts which are one part's after all.
  const SceneAction did[] = {SceneAction::saw({{2, 0, 0}, {1, 0, 0}, {0, 0, 1}, 0.6}),
                             SceneAction::split(1),
                             SceneAction::plain(ActionKind::undo),
                             SceneAction::split(1),
                             SceneAction::saw({{-4, 0, 0}, {1, 0, 0}, {0, 0, 1}, 0.6}),
                             SceneAction::split(1)};
  for (const SceneAction& a : did) EXPECT_TRUE(w.act(a).done) << name_of(a);
  while (w.act(SceneAction::plain(ActionKind::undo)).done) {
  }
  ASSERT_EQ(::mprotect(reinterpret_cast<void*>(from), to - from, PROT_READ | PROT_WRITE), 0);
  EXPECT_EQ(w.hash(), World(bar(0.25, 0.4)).hash());
}

TEST(World, MovesOfDifferentPiecesAreTakenBackOneByOne) {
  World w(bar(0.5, 0));
  for (const double x : {-5.0, 5.0}) w.act(SceneAction::saw({{x, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1}));
  w.act(SceneAction::split(1));
  ASSERT_EQ(w.bodies().size(), 3u);
  const auto shift = [&](std::uint32_t id) { return w.find(id)->world_from_body.shift_mm.y; };
  const auto drag = [&](std::uint32_t id, double from, double to) {
    for (int s = 0; s <= 4; ++s)
      ASSERT_TRUE(w.act(SceneAction::move(id, {{}, {0, from + (to - from) * s / 4, 0}})).done);
  };
  const auto undo = [&] { return w.act(SceneAction::plain(ActionKind::undo)).done; };
  drag(1, 0, 10);
  drag(0, 0, 20);
  drag(1, 10, 30);
  ASSERT_EQ(w.undo_steps(), 6u);
  ASSERT_TRUE(undo());
  EXPECT_EQ(shift(1), 10);
  EXPECT_EQ(shift(0), 20);
  ASSERT_TRUE(undo());
  EXPECT_EQ(shift(1), 10);
  EXPECT_EQ(shift(0), 0);
  ASSERT_TRUE(undo());
  EXPECT_EQ(shift(1), 0);
  // The same for the screws of two distractors.
  const auto distractor = static_cast<std::uint32_t>(plate_index("distractor"));
  ASSERT_TRUE(w.act(SceneAction::attach(distractor, {{}, {-5, 0, 4}}, 0, 1)).done);
  ASSERT_TRUE(w.act(SceneAction::attach(distractor, {{}, {5, 0, 4}}, 0, 2)).done);
  const std::size_t before = w.undo_steps();
  for (const double mm : {1.0, 2.0, 3.0}) ASSERT_TRUE(w.act(SceneAction::open(1, mm)).done);
  for (const double mm : {1.0, 2.0}) ASSERT_TRUE(w.act(SceneAction::open(2, mm)).done);
  ASSERT_EQ(w.undo_steps(), before + 2);
  ASSERT_TRUE(undo());
  EXPECT_EQ(w.fixtures()[1].opening_mm, 0);
  EXPECT_EQ(w.fixtures()[0].opening_mm, 3);
  ASSERT_TRUE(undo());
  EXPECT_EQ(w.fixtures()[0].opening_mm, 0);
}

TEST(World, NamesAreCountedAsTheyAreGivenAndARefusalTakesNone) {
  World w(bar(0.5, 0));
  ASSERT_TRUE(w.act(SceneAction::saw(kMiddle)).done);
  const auto bricks = static_cast<std::uint32_t>(w.bodies()[0].body->bone.brick_count());
  World enough = w.copy();
  ASSERT_TRUE(enough.act(SceneAction::split(1)).done);
  const std::uint32_t piece = WorldProbe::next_brick(enough) - bricks;
  ASSERT_LT(piece, bricks);
  // All but one of the names that it takes.
  const std::string before = w.hash();
  WorldProbe::next_brick(w) = BrickGrid::kMaxBricks - piece + 1;
  const auto refused = w.act(SceneAction::split(1));
  EXPECT_FALSE(refused.done);
  EXPECT_NE(refused.message.find("names"), std::string::npos);
  EXPECT_EQ(w.hash(), before);
  EXPECT_EQ(WorldProbe::next_brick(w), BrickGrid::kMaxBricks - piece + 1);
  EXPECT_EQ(WorldProbe::next_body(w), 1u);
  EXPECT_EQ(w.undo_steps(), 1u);
  // The very last ones.
  WorldProbe::next_brick(w) = BrickGrid::kMaxBricks - piece;
  ASSERT_TRUE(w.act(SceneAction::split(1)).done);
  EXPECT_EQ(w.bodies()[1].body->id, 1u);
  const VoxelKey last = w.bodies()[1].body->name_of(piece * BrickGrid::kVoxels - 1);
  EXPECT_NE(last, BrickGrid::kNone);
  EXPECT_EQ(w.owner(last), &w.bodies()[1]);
}

TEST(World, WhatWasDrilledSinceStaysDrilledWhenTakenBack) {
  World w(bar(0.5, 0));
  w.act(SceneAction::saw(kMiddle));
  w.act(SceneAction::split(1));
  Body& piece = *w.bodies()[1].body;
  VoxelKey solid = 0;
  while (piece.bone.value(solid) < 1) ++solid;
  const Ijk c = piece.bone.coordinate(solid);
  piece.bone.set(solid, 0);
  w.act(SceneAction::plain(ActionKind::undo));
  w.act(SceneAction::plain(ActionKind::undo));
  EXPECT_EQ(w.bodies()[0].body->bone.at(c.i, c.j, c.k), 0);
  EXPECT_NEAR(w.volume_mm3(), bar(0.5, 0).sum() * 0.125 - 0.125, 1e-3);
}

TEST(World, APieceIsSplitAgainAndSawnWhereItLies) {
  World w(bar(0.5, 0));
  w.act(SceneAction::saw(kMiddle));
  w.act(SceneAction::split(1));
  // Turned about z by a right angle and moved: its length now lies along y.
  w.act(SceneAction::move(1, RigidTransform{{}, {0, 40, 0}} * rotation_about({}, {0, 0, 1}, std::numbers::pi / 2)));
  // x from 2.5 to 15 became y from 42.5 to 55.
  ASSERT_TRUE(w.act(SceneAction::saw({{0, 48, 0}, {0, 1, 0}, {0, 0, 1}, 1}, 1)).done);
  const auto split = w.act(SceneAction::split(1));
  ASSERT_TRUE(split.done);
  ASSERT_EQ(w.bodies().size(), 3u);
  EXPECT_EQ(split.made[0].from, 1u);
  EXPECT_NEAR(w.bodies()[2].body->bone.sum() * 0.125, 5.0 * 80, 20);
  EXPECT_EQ(w.bodies()[2].world_from_body.shift_mm, w.bodies()[1].world_from_body.shift_mm);
  while (w.undo_steps() > 0) ASSERT_TRUE(w.act(SceneAction::plain(ActionKind::undo)).done);
  EXPECT_EQ(w.hash(), World(bar(0.5, 0)).hash());
}

// What the follower keeps of a piece, made from what it knew of the whole, is what it would be made again.
TEST(World, LabelsAndSurfaceOfAPieceEqualNewOnes) {
  const auto surface_of = [](const BrickGrid& b) { return surface_hash(surface_nets(b).mesh); };
  const auto lit_as_if_new = [](LiveSurface& s) {
    s.settle();
    LiveSurface fresh(s.bone(), {});
    fresh.shade({});
    for (std::uint32_t b = 0; b < s.bone().brick_count(); ++b) {
      const auto &x = s.patch(b).vertices, &y = fresh.patch(b).vertices;
      for (std::size_t v = 0; v < std::min(x.size(), y.size()); ++v) {
        if (x[v].normal != y[v].normal) return false;
      }
    }
    return true;
  };
  for (const double turn : {0.0, 0.6}) {
    World w(bar(0.25, turn));
    LiveComponents labels(w.bodies()[0].body->bone);
    LiveSurface surface(w.bodies()[0].body->bone, {});
    surface.shade({});
    for (const double x : {-7.0, 6.0}) {
      const std::shared_ptr<Body> before = w.bodies()[0].body;
      auto e = w.act(SceneAction::saw({{x, 0, 0}, {1, 0.2, 0}, {0, 0, 1}, 0.8}));
      const auto follow = [&] {
        labels.rebind(w.bodies()[0].body->bone);
        surface.rebind(w.bodies()[0].body->bone);
        for (const std::uint32_t b : e.changed[0].bricks) {
          labels.mark_brick(b);
          surface.mark_brick(b);
        }
        labels.update();
        surface.update();
      };
      follow();
      const std::shared_ptr<Body> sawn = w.bodies()[0].body;
      e = w.act(SceneAction::split(1), [&](std::uint32_t id) { return id == 0 ? &labels : nullptr; });
      ASSERT_EQ(e.made.size(), 1u);
      const BrickGrid& piece = w.find(e.made[0].body)->body->bone;
      int copied = 0;
      for (const auto u : e.made[0].origin.unchanged) copied += u;
      EXPECT_GT(copied, 0);
      const LiveComponents piece_labels(piece, labels, e.made[0].origin), again(piece);
      ASSERT_EQ(piece_labels.components().size(), again.components().size());
      for (VoxelKey v = 0; v < piece.brick_count() * 512; ++v)
        ASSERT_EQ(piece_labels.component_of(v), again.component_of(v));
      LiveSurface piece_surface(piece, surface, e.made[0].origin);
      EXPECT_EQ(surface_hash(piece_surface.joined().mesh), surface_of(piece));
      EXPECT_TRUE(lit_as_if_new(piece_surface));
      follow();
      EXPECT_TRUE(lit_as_if_new(surface));
      EXPECT_EQ(surface_hash(surface.joined().mesh), surface_of(w.bodies()[0].body->bone));
      EXPECT_EQ(labels.components().size(), 1u);
    }
  }
}

TEST(World, PlatesJoinPiecesAndADistractorOpens) {
  World w(bar(0.5, 0));
  w.act(SceneAction::saw(kMiddle));
  w.act(SceneAction::split(1));
  const auto distractor = static_cast<std::uint32_t>(plate_index("distractor")),
             mini = static_cast<std::uint32_t>(plate_index("miniplate-4"));
  const RigidTransform on_top{{}, {2, 0, 4}};
  EXPECT_FALSE(w.act(SceneAction::open(1, 5)).done);
  ASSERT_TRUE(w.act(SceneAction::attach(distractor, on_top, 0, 1)).done);
  ASSERT_TRUE(w.act(SceneAction::open(1, 7)).done);
  EXPECT_NEAR(w.bodies()[1].world_from_body.shift_mm.x, 7, 1e-12);
  const auto too_far = w.act(SceneAction::open(1, 99));
  ASSERT_TRUE(too_far.done);
  EXPECT_EQ(too_far.message, "opened to 20 mm: it goes no further");
  EXPECT_NEAR(w.bodies()[1].world_from_body.shift_mm.x, 20, 1e-12);
  ASSERT_TRUE(w.act(SceneAction::open(1, 6)).done);
  // Another plate across the gap holds it; then moving one moves both.
  ASSERT_TRUE(w.act(SceneAction::attach(mini, RigidTransform{{}, {5, 3, 4}}, 0, 1)).done);
  const auto stuck = w.act(SceneAction::open(1, 8));
  EXPECT_FALSE(stuck.done);
  EXPECT_NE(stuck.message.find("another plate"), std::string::npos);
  ASSERT_TRUE(w.act(SceneAction::move(1, RigidTransform{{}, {6, 10, 0}})).done);
  EXPECT_NEAR(w.bodies()[0].world_from_body.shift_mm.y, 10, 1e-12);
  ASSERT_TRUE(w.act(SceneAction::detach(1)).done);
  ASSERT_TRUE(w.act(SceneAction::detach(2)).done);
  ASSERT_TRUE(w.act(SceneAction::move(1, RigidTransform{{}, {6, 20, 0}})).done);
  EXPECT_NEAR(w.bodies()[0].world_from_body.shift_mm.y, 10, 1e-12);
  // Undo: the move; the plates come back; and where everything was.
  for (int i = 0; i < 3; ++i) w.act(SceneAction::plain(ActionKind::undo));
  EXPECT_EQ(w.fixtures().size(), 2u);
  while (w.undo_steps() > 0) w.act(SceneAction::plain(ActionKind::undo));
  EXPECT_EQ(w.hash(), World(bar(0.5, 0)).hash());
}

TEST(World, RefusesWhatMakesNoSense) {
  World w(bar(1, 0));
  const std::string before = w.hash();
  RigidTransform mirrored;
  mirrored.rotation.column[0] = {-1, 0, 0};
  SceneAction nan = SceneAction::open(1, NAN), unknown = SceneAction::plain(ActionKind::undo);
  unknown.kind = 77;
  for (const SceneAction& a : {SceneAction::move(5, {}), SceneAction::move(0, mirrored), SceneAction::attach(99, {}, 0),
                               SceneAction::attach(0, {}, 0, 0), SceneAction::attach(0, {}, 0, 9),
                               SceneAction::detach(3), SceneAction::saw({{500, 0, 0}, {1, 0, 0}}),
                               SceneAction::saw({{0, 0, 0}, {0, 0, 0}}), SceneAction::split(1), nan, unknown}) {
    const auto e = w.act(a);
    EXPECT_FALSE(e.done) << a.kind;
    EXPECT_FALSE(e.message.empty());
  }
  EXPECT_EQ(w.hash(), before);
}

TEST(World, APlateIsFixedOnlyWhereBoneIsBelowIt) {
  World w(bar(0.5, 0));
  w.act(SceneAction::saw(kMiddle));
  w.act(SceneAction::split(1));
  const auto mini = static_cast<std::uint32_t>(plate_index("midface-4"));
  const std::string before = w.hash();
  const auto refused = [&](const RigidTransform& pose, std::uint32_t body, std::uint32_t other = SceneAction::kNobody) {
    const auto e = w.act(SceneAction::attach(mini, pose, body, other));
    return e.done ? std::string("fixed") : e.message;
  };
  EXPECT_NE(refused({{}, {900, 0, 4}}, 0).find("not on piece 0"), std::string::npos);
  EXPECT_NE(refused({{}, {2, 0, 9.5}}, 0, 1).find("not on piece 0"), std::string::npos);  // 5.5 mm above
  EXPECT_NE(refused({{}, {-11, 0, 4}}, 1).find("not on piece 1"), std::string::npos);     // on the other piece
  EXPECT_NE(refused({{}, {-11, 0, 4}}, 0, 1).find("not on piece 1"), std::string::npos);
  EXPECT_NE(refused(RigidTransform{{}, {2, 0, 6}} * rotation_about({}, {1, 0, 0}, std::numbers::pi), 0).find("not on"),
            std::string::npos);  // its back to the bone
  EXPECT_EQ(w.fixtures().size(), 0u);
  EXPECT_EQ(w.hash(), before);
  EXPECT_EQ(refused({{}, {2, 0, 8.5}}, 0, 1), "fixed");  // 4.5 mm above
  // Where a piece lies now counts, not where it was cut.
  w.act(SceneAction::plain(ActionKind::undo));
  w.act(SceneAction::move(1, {{}, {0, 100, 0}}));
  EXPECT_NE(refused({{}, {2, 0, 4}}, 0, 1).find("not on piece 1"), std::string::npos);
  EXPECT_EQ(refused({{}, {9, 100, 4}}, 1), "fixed");
}

TEST(World, SuckerAndWaterReachAsFarAsMakesSense) {
  World w(bar(1, 0));
  for (const double r : {0.0, -3.0, 150.0, 1500.0}) {
    EXPECT_FALSE(w.act(SceneAction::suction({}, r, 60)).done) << r;
    EXPECT_FALSE(w.act(SceneAction::irrigate({}, r, 0.5)).done) << r;
  }
  EXPECT_TRUE(w.act(SceneAction::suction({}, SceneAction::kMaxReachMm, 60)).done);
  EXPECT_TRUE(w.act(SceneAction::suction({}, 0, 0)).done);  // away
}

TEST(World, CrumbsBecomeDustAndNothingIsLost) {
  World w(bar(0.5, 0));
  for (int c = 0; c < 9; ++c) w.act(SceneAction::saw({{-12.0 + 3 * c, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1}));
  const double sawn = w.volume_mm3();
  const auto e = w.act(SceneAction::split(165));
  EXPECT_EQ(w.bodies().size(), 2u);
  double dust = 0;
  for (const auto& [v, d] : e.dust) dust += static_cast<double>(d) * 0.125;
  EXPECT_NEAR(dust, 8 * 160, 40);
  EXPECT_NEAR(w.volume_mm3() + dust, sawn, 1e-2);
}

TEST(Plates, AreClosedAndOfTheirSize) {
  for (const PlateModel& p : plate_library()) {
    EXPECT_TRUE(is_closed(soup_of(p.mesh))) << p.name;
    Vec3 lo{1e9, 1e9, 1e9}, hi = lo * -1;
    for (const auto& q : p.mesh.points_mm)
      for (std::size_t a = 0; a < 3; ++a) {
        lo[a] = std::min(lo[a], static_cast<double>(q[a]));
        hi[a] = std::max(hi[a], static_cast<double>(q[a]));
      }
    EXPECT_NEAR(lo.z, 0, 0.05) << p.name;
    if (p.most_opening_mm == 0) {
      EXPECT_NEAR(hi.z, p.thickness_mm, 0.05) << p.name;
      EXPECT_NEAR(lo.x + hi.x, 0, 0.02);
    } else {
      EXPECT_TRUE(is_closed(soup_of(p.moving)));
    }
    for (const int count : {100, 2000}) {
      const auto samples = sample_plate(p, count, 0.1);
      EXPECT_NEAR(static_cast<double>(samples.size()), count, 0.15 * count) << p.name;
      double under = 0, all = 0, flat = 0;
      Vec3 mean{};
      for (const auto& s : samples) {
        all += s.area_mm2;
        if (s.outwards.z < -0.9) under += s.area_mm2;
        if (s.outwards.z < -0.9) flat = std::max(flat, std::abs(s.at_mm.z + 0.1));
        mean += s.outwards * s.area_mm2;
      }
      EXPECT_LT(length(mean), 0.15 * all) << p.name;                // a closed surface
      EXPECT_TRUE(p.most_opening_mm > 0 || flat < 0.12) << p.name;  // but for the rounding of its edges
      EXPECT_GT(under, 0.15 * all);
    }
  }
}

// Against planes: how far below each point of a plate the bone's flat face is, level and tilted, also sunk in; and
// whose it is.
TEST(Plates, GapsToAFlatFace) {
  for (const double h : {0.25, 0.5}) {
    World w(bar(h, 0.3));
    w.act(SceneAction::saw({{1, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1.0}));
    w.act(SceneAction::split(1));
    const PlateModel& plate = plate_library()[static_cast<std::size_t>(plate_index("miniplate-4"))];
    for (const double tilt : {0.0, 0.1}) {
      for (const double gap : {0.7, 0.0, -0.4}) {
        const RigidTransform pose = RigidTransform{{}, {1, 0, 4 + gap}} * rotation_about({}, {0, 1, 0}, tilt);
        double worst = 0, sum = 0;
        int met = 0, none = 0;
        for (const PlateGap& g : plate_gaps(w, plate, pose, 0, 400, 5)) {
          const Vec3 p = pose(g.at_mm);
          // Where the screw's line meets the plane z = 4.
          const double exact = (p.z - 4) / std::cos(tilt);
          const Vec3 foot = p - pose.rotation.column[2] * exact;
          if (std::abs(foot.y) > 4.5 || std::abs(foot.x) > 14 || std::abs(foot.x - 1) < 1.2 || exact < -0.9)
            continue;  // edges, the cut
          if (g.body == SceneAction::kNobody) {
            ++none;
            continue;
          }
          ++met;
          worst = std::max(worst, std::abs(g.gap_mm - exact));
          sum += std::abs(g.gap_mm - exact);
          EXPECT_EQ(w.find(g.body) != nullptr, true);
        }
        EXPECT_GT(met, 150);
        EXPECT_EQ(none, 0);
        EXPECT_LT(sum / met, 0.1 * h) << h << ' ' << tilt << ' ' << gap;
        EXPECT_LT(worst, 0.35 * h) << h << ' ' << tilt << ' ' << gap;
      }
    }
    const auto both = bodies_under(w, plate, {{}, {1, 0, 4.3}});
    EXPECT_EQ(both.size(), 2u);
    EXPECT_EQ(bodies_under(w, plate, {{}, {1, 0, 8}}).size(), 0u);
    const auto one =
        bodies_under(w, plate_library()[static_cast<std::size_t>(plate_index("midface-4"))], {{}, {-11, 0, 4.3}});
    EXPECT_EQ(one.size(), 1u);
  }
}

TEST(World, ARegionOfInterestTakesThePlaceOfTheCoarseBone) {
  BrickGrid coarse = bar(0.5, 0);
  Frame f = coarse.frame();
  // 8 mm: 16 coarse voxels, 40 of 0.2 mm.
  const Vec3 corner = f.world_from_index({31.5, 31.5, 31.5});
  f.spacing_mm = {0.2, 0.2, 0.2};
  f.dims = {40, 40, 40};
  f.origin_mm = corner + Vec3{0.1, 0.1, 0.1};
  BrickGrid fine = BrickGrid::dense(f);
  for (VoxelKey v = 0; v < 125 * 512; ++v) {
    const Ijk c = fine.coordinate(v);
    const Vec3 p = f.world_from_index({double(c.i), double(c.j), double(c.k)});
    const double d = std::min({15 - std::abs(p.x), 5 - std::abs(p.y), 4 - std::abs(p.z)});
    fine.set(v, static_cast<float>(std::clamp(d / 0.2 + 0.5, 0.0, 1.0)));
  }
  World w(BrickGrid(coarse), nullptr);
  w.add_region(BrickGrid(fine));
  EXPECT_NEAR(w.volume_mm3(), coarse.sum() * 0.125, 2);
  EXPECT_FALSE(w.act(SceneAction::split(1)).done);
  w.act(SceneAction::move(0, RigidTransform{{}, {1, 2, 3}}));
  EXPECT_EQ(w.bodies()[1].world_from_body.shift_mm, (Vec3{1, 2, 3}));
  const auto refused = [&](World& bad, const Frame& frame) -> std::string {
    const std::string before = bad.hash();
    try {
      bad.add_region(BrickGrid::dense(frame));
    } catch (const Error& e) {
      EXPECT_EQ(bad.hash(), before);
      EXPECT_EQ(e.code(), ExitCode::usage);
      return e.what();
    }
    return "taken";
  };
  // A coarse voxel is 0.5 mm: whole ones and a hundredth off are taken, two hundredths and more are not, along each
  // axis and either way.
  for (std::size_t a = 0; a < 3; ++a) {
    for (const double share : {-0.4, -0.02, 0.02, 0.1, 0.4, 0.5}) {
      World bad(BrickGrid(coarse), nullptr);
      Frame off = f;
      off.origin_mm[a] += share * 0.5;
      EXPECT_NE(refused(bad, off).find("cuts through voxels"), std::string::npos) << a << ' ' << share;
    }
    for (const double share : {-0.005, 0.005, 1.0, -3.0}) {
      World good(BrickGrid(coarse), nullptr);
      Frame on = f;
      on.origin_mm[a] += share * 0.5;
      EXPECT_EQ(refused(good, on), "taken") << a << ' ' << share;
    }
    // One face on voxels, the other not.
    World bad(BrickGrid(coarse), nullptr);
    Frame longer = f;
    longer.dims[a] += 1;
    EXPECT_NE(refused(bad, longer).find("cuts through voxels"), std::string::npos);
  }
  World bad(BrickGrid(coarse), nullptr);
  Frame turned = f;
  turned.direction = rotation_about({}, {0, 0, 1}, 0.01).rotation;
  EXPECT_NE(refused(bad, turned).find("axes"), std::string::npos);
  EXPECT_NE(refused(w, f).find("there is one already"), std::string::npos);
  WorldProbe::next_brick(bad) = BrickGrid::kMaxBricks - 124;
  try {
    bad.add_region(BrickGrid::dense(f));
    FAIL() << "names given twice";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::resources);
  }
}

}  // namespace
}  // namespace osteo
