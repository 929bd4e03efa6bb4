// Scenes that are operated on: in real time and without it, and the same again from the stream.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <thread>

#include "bar.h"
#include "osteo/session/recording/session_file.h"
#include "osteo/session/scene/rehearsal.h"
#include "osteo/simulation/bone/plates.h"
#include "scratch.h"

namespace osteo {
namespace {

// Circles on the bar's upper face (z = 4), at x.
Script strokes(double x, double seconds) {
  Script s;
  s.axis = {0, 0.3, 0.95};
  s.waypoints.push_back({0, {x, 0, 8}, true});
  for (double t = 0.3; t < seconds - 0.2; t += 0.05)
    s.waypoints.push_back({t, {x + 2 * std::cos(9 * t), 2 * std::sin(9 * t), 5.4 - 0.5 * t}, true});
  s.waypoints.push_back({seconds, {x, 0, 9}, false});
  return s;
}

std::vector<SceneAction> at_ticks(std::vector<std::pair<std::uint64_t, SceneAction>> list) {
  std::vector<SceneAction> actions;
  for (auto& [tick, a] : list) {
    a.tick = tick;
    actions.push_back(a);
  }
  return actions;
}

const SawCut kCut{{-4, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1.0};

// Sawn, taken apart, the drilled piece carried away under the burr and back, plated, opened, undone.
std::vector<SceneAction> everything() {
  const auto mini = static_cast<std::uint32_t>(plate_index("miniplate-4")),
             distractor = static_cast<std::uint32_t>(plate_index("distractor"));
  return at_ticks(
      {{200, SceneAction::suction({4, 0, 5}, 3, 40)},
       {400, SceneAction::saw(kCut)},
       {500, SceneAction::split(20)},
       {600, SceneAction::move(0, RigidTransform{{}, {0.5, 0, 0.3}} * rotation_about({5, 0, 0}, {0, 0, 1}, 0.2))},
       {700, SceneAction::attach(mini, {{}, {-4, 0, 4}}, 0, 1)},
       {800, SceneAction::move(1, {{}, {0.2, 0.1, 0}})},
       {900, SceneAction::detach(1)},
       {901, SceneAction::attach(distractor, {{}, {-4, 0, 4}}, 0, 1)},
       {1000, SceneAction::open(2, 3)},
       {1100, SceneAction::irrigate({4, 0, 5}, 5, 2)},
       {1200, SceneAction::plain(ActionKind::undo)},  // what was drilled since the distractor was opened
       {1300, SceneAction::saw({{9, 0, 0}, {1, 0, 0}, {0, 0, 1}, 0.7}, 0)},
       {1301, SceneAction::split(20)},
       {1401, SceneAction::grip(mini)},
       {1450, SceneAction::plain(ActionKind::undo)},  // what was drilled since the split,
       {1460,
        SceneAction::plain(ActionKind::undo)},  // and the split: with a plate in the hand nothing is drilled between
       {1600, SceneAction::grip(SceneAction::kNobody)}});
}

RehearsalOptions options(const std::filesystem::path& file, ContactMethod method) {
  RehearsalOptions o;
  o.session_file = file;
  o.follow = {true, true, true};
  o.haptics.device = SpringHand::traits();
  o.haptics.params.contact.method = method;
  o.actions = everything();
  return o;
}

TEST(Operation, EverythingComesOutTheSameFromTheStream) {
  for (const ContactMethod method :
       {ContactMethod::overlap, ContactMethod::proxy, ContactMethod::volume, ContactMethod::rays}) {
    for (const bool by_the_clock : {false, true}) {
      const test::ScratchFolder scratch;
      const auto file = scratch / "all.oss";
      World world(test::bar(0.5, 0.3));
      const World start = world.copy();
      Rehearsal r(std::move(world), std::make_unique<ScriptedDevice>(strokes(4, 2), 1000), options(file, method), {});
      RehearsalSummary s;
      if (by_the_clock) {
        r.start();
        while (r.running()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
        s = r.stop();
      } else {
        s = r.run_to_end({});
      }
      EXPECT_EQ(r.take_refusal(), "");
      EXPECT_GT(s.removed_mm3,
                by_the_clock ? 0.0 : 2);  // a busy machine takes its time to saw, and nothing is drilled meanwhile
      EXPECT_NEAR(s.sawn_mm3 + s.crumbs_mm3, 80 + 56, 12);
      ASSERT_TRUE(s.dust);
      const Dust::Totals& d = *s.dust;
      EXPECT_NEAR(d.added_mm3, s.removed_mm3 + s.sawn_mm3 + s.crumbs_mm3, 1e-3);
      EXPECT_NEAR(d.added_mm3, d.present_mm3 + d.slurry_mm3 + d.sucked_mm3 + d.fallen_mm3, 1e-9);
      EXPECT_GT(d.sucked_mm3, 0);
      EXPECT_EQ(s.bodies, 2u);
      const Session session = read_session(file);
      EXPECT_GE(session.actions.size(), everything().size());
      const ReplayResult again = replay(SessionReader(file), start.copy(), {}, {});
      EXPECT_TRUE(again.identical) << again.difference << (by_the_clock ? " in real time" : "");
      // What undo gave back is not gone; nor is what was moved.
      const auto bone_mm3 = [](const World& world) {
        double mm3 = 0;
        for (const PlacedBody& b : world.bodies()) mm3 += b.body->bone.sum() * 0.5 * 0.5 * 0.5;
        return mm3;
      };
      EXPECT_NEAR(s.gone_mm3, bone_mm3(start) - bone_mm3(*again.world), 1e-6);
      EXPECT_GT(s.gone_mm3, 60);
      EXPECT_LT(s.gone_mm3, s.removed_mm3 + s.sawn_mm3 + s.crumbs_mm3 + 1e-3);
      EXPECT_TRUE(again.complete);
      EXPECT_EQ(again.bone_hash, s.bone_hash);
    }
  }
}

TEST(Operation, NothingIsRemovedWhileTheSceneIsPrepared) {
  const test::ScratchFolder scratch;
  const auto file = scratch / "hold.oss";
  World world(test::bar(0.25, 0));
  Rehearsal r(std::move(world), std::make_unique<ScriptedDevice>(strokes(4, 2), 1000),
              options(file, ContactMethod::overlap), {});
  r.start();
  while (r.running()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  r.stop();
  const Session session = read_session(file);
  bool held = false;
  std::size_t next = 0, held_ticks = 0;
  for (const TickRecord& t : session.ticks) {
    for (; next < session.actions.size() && session.actions[next].action.tick == t.tick; ++next) {
      if (session.actions[next].action.is(ActionKind::hold))
        held = true;
      else if (session.actions[next].action.is(ActionKind::saw) || session.actions[next].action.is(ActionKind::split) ||
               session.actions[next].action.is(ActionKind::undo) || session.actions[next].action.is(ActionKind::attach))
        held = false;
    }
    EXPECT_EQ((t.flags & kHeld) != 0, held) << t.tick;
    if (!held) continue;
    ++held_ticks;
    EXPECT_EQ(t.voxels_changed, 0u);
  }
  EXPECT_GT(held_ticks, 3u);
}

// The same strokes on bone that was cut but not moved remove the same and feel nearly the same: nobody notices that it
// is two pieces.
TEST(Operation, ACutThatNobodyOpenedIsNotFelt) {
  for (const bool split : {false, true}) {
    static std::vector<float> whole_force;
    static double whole_removed = 0;
    BrickGrid bone = test::bar(0.5, 0);
    World world(std::move(bone));
    if (split) {
      // Without kerf: taken apart along a plane that leaves every voxel to one side.
      BrickGrid left = test::bar(0.5, 0);
      BrickGrid right(left);
      for (VoxelKey v = 0; v < left.brick_count() * 512; ++v)
        (left.frame().world_from_index({double(left.coordinate(v).i), 0, 0}).x < 4 ? right : left).set(v, 0);
      world = World(std::move(left));
      HapticSetup setup;
      setup.device = SpringHand::traits();
      setup.params.effects.vibration = false;
      HapticRenderer renderer(setup, {}, 1e-3);
      Body second;
      second.id = 1;
      second.first_brick = static_cast<std::uint32_t>(right.brick_count());
      second.bone = std::move(right);
      HapticScene scene = HapticScene::of(world, renderer.setup());
      scene.add(std::make_shared<TouchedBone>(std::make_shared<Body>(std::move(second))), {}, renderer.setup());
      renderer.show(&scene);
      ScriptedDevice device(strokes(4, 2), 1000);
      Vec3 force{};
      double removed = 0, worst = 0;
      std::size_t t = 0;
      for (; device.active(t); ++t) {
        const auto [record, changes] = renderer.step(device.read(t, 1e-3, force));
        force = from_floats(record.force_n);
        removed += static_cast<double>(record.removed_mm3);
        worst = std::max(worst, std::abs(static_cast<double>(whole_force[t]) - length(force)));
      }
      EXPECT_NEAR(removed / whole_removed, 1, 0.03);
      EXPECT_LT(worst, 0.25);  // of up to 3 N, while drilling: the paths differ a little once bone has gone
    } else {
      HapticSetup setup;
      setup.device = SpringHand::traits();
      setup.params.effects.vibration = false;
      HapticRenderer renderer(setup, world.bodies()[0].body->bone, {}, 1e-3);
      ScriptedDevice device(strokes(4, 2), 1000);
      Vec3 force{};
      for (std::size_t t = 0; device.active(t); ++t) {
        const auto [record, changes] = renderer.step(device.read(t, 1e-3, force));
        force = from_floats(record.force_n);
        whole_force.push_back(static_cast<float>(length(force)));
        whole_removed += static_cast<double>(record.removed_mm3);
      }
    }
  }
}

// A piece that was carried away feels where it is as it felt where it was.
TEST(Operation, ForceGoesWithThePiece) {
  World world(test::bar(0.5, 0));
  const RigidTransform away = RigidTransform{{}, {30, -20, 5}} * rotation_about({1, 2, 3}, normalized({1, -1, 2}), 1.1);
  HapticSetup setup;
  setup.device = SpringHand::traits();
  setup.params.guard.max_rate_n_per_s = 1e9;
  HapticRenderer here(setup, {}, 1e-3), there(setup, {}, 1e-3);
  HapticScene scene = HapticScene::of(world, here.setup());
  World moved = world.copy();
  moved.act(SceneAction::move(0, away));
  HapticScene scene2 = HapticScene::of(moved, there.setup());
  here.show(&scene);
  there.show(&scene2);
  for (int t = 0; t < 200; ++t) {
    DeviceSample a, b;
    const Vec3 at{2 + 0.01 * t, 0.5, 5.9 - 0.004 * t}, axis = normalized({0.2, 0.1, 1});
    a.position_mm = to_floats(at);
    a.axis = to_floats(axis);
    b.position_mm = to_floats(away(at));
    b.axis = to_floats(away.rotation * axis);
    const Vec3 f = from_floats(here.step(a).record.force_n), g = from_floats(there.step(b).record.force_n);
    EXPECT_LT(length(away.rotation * f - g), 2e-3 + 2e-3 * length(f)) << t;
  }
}

// A burr that slides from coarse into fine bone and out again, over a flat face: nothing to feel where they meet.
TEST(Operation, TheBorderOfARegionIsNotFelt) {
  const auto fill = [](BrickGrid& g) {
    for (VoxelKey v = 0; v < g.brick_count() * BrickGrid::kVoxels; ++v) {
      const Ijk c = g.coordinate(v);
      const double z = g.frame().world_from_index({double(c.i), double(c.j), double(c.k)}).z;
      g.set(v, static_cast<float>(std::clamp(0.5 - z / g.frame().spacing_mm.x, 0.0, 1.0)));
    }
  };
  Frame f;
  f.dims = {96, 48, 32};
  f.spacing_mm = {0.5, 0.5, 0.5};
  f.origin_mm = {-23.75, -11.75, -9.6};  // the face cuts voxels
  BrickGrid coarse = BrickGrid::dense(f);
  fill(coarse);
  Frame g = f;
  g.spacing_mm = {0.2, 0.2, 0.2};
  g.dims = {80, 80, 60};  // 16 x 16 x 12 mm
  g.origin_mm = f.world_from_index({15.5, 7.5, 7.5}) + Vec3{0.1, 0.1, 0.1};
  BrickGrid fine = BrickGrid::dense(g);
  fill(fine);
  for (VoxelKey v = 0; v < fine.brick_count() * BrickGrid::kVoxels; ++v) {
    if (fine.coordinate(v).k >= 60) fine.set(v, 0);
  }
  World world(std::move(coarse));
  world.add_region(std::move(fine));
  HapticSetup setup;
  setup.device = SpringHand::traits();
  setup.params.effects.shaft = false;
  HapticRenderer renderer(setup, {}, 1e-3);
  HapticScene scene = HapticScene::of(world, renderer.setup());
  renderer.show(&scene);
  double least = 1e9, most = 0, sideways = 0;
  for (int t = 0; t < 4000; ++t) {
    DeviceSample s;
    s.tool = static_cast<std::uint8_t>(burr_index(BurrKind::cutting, 6));
    // x from -20 to 4: over the border at -16, and along it at an angle.
    s.position_mm = to_floats({-20 + 0.006 * t, -4 + 0.001 * t, 3 - 0.6});
    s.axis = {0, 0, 1};
    renderer.step(s);
    const ContactResult& c = renderer.contact();
    if (t < 50) continue;
    least = std::min(least, c.force_n.z);
    most = std::max(most, c.force_n.z);
    sideways = std::max(sideways, std::hypot(c.force_n.x, c.force_n.y));
  }
  EXPECT_GT(least, 1.5);
  EXPECT_LT(most - least, 0.03 * most) << least << " to " << most;
  EXPECT_LT(sideways, 0.03 * most);
}

// Two structures in the bar: the strokes go through one, called nerve, and near the other.
Labels two_in_the_bar() {
  Labels labels;
  labels.frame.dims = {48, 40, 48};
  labels.frame.spacing_mm = {0.25, 0.25, 0.25};
  labels.frame.origin_mm = {-6, -5, -6};
  const auto v = make_voxels<std::uint8_t>(labels.frame.voxel_count());
  std::size_t n = 0;
  for (int k = 0; k < 48; ++k)
    for (int j = 0; j < 40; ++j)
      for (int i = 0; i < 48; ++i, ++n) {
        const Vec3 p = labels.frame.world_from_index({double(i), double(j), double(k)});
        v[n] = std::hypot(p.y, p.z - 3.8) < 0.6 ? 2 : std::hypot(p.x, p.z + 1) < 0.6 ? 9 : 0;
      }
  labels.voxels = v;
  labels.structures = {{2, "nerve", {}}};
  return labels;
}

// What the summary tells follows from the stream alone.
TEST(Rehearsal, TellsOfEveryStructureAndAReplayAgrees) {
  Anatomy anatomy;
  anatomy.structures = std::make_shared<const StructureMap>(two_in_the_bar());
  const test::ScratchFolder scratch;
  RehearsalOptions options;
  options.haptics.device = SpringHand::traits();
  options.haptics.structures = anatomy.structures->hash();
  options.anatomy = anatomy;
  options.session_file = scratch / "stream.oss";
  const World world(test::bar(0.5, 0.2));
  Rehearsal rehearsal(world.copy(), std::make_unique<ScriptedDevice>(strokes(0, 2), 1000), options, {});
  const RehearsalSummary s = rehearsal.run_to_end({});
  const Session session = read_session(options.session_file);
  // Counted once more from the records, for the nerve: it is always the nearest.
  StructureEvents nerve{1e9, 0, 0};
  for (const TickRecord& t : session.ticks) {
    if (t.structure != 2) continue;
    nerve.least_clearance_mm = std::min(nerve.least_clearance_mm, static_cast<double>(t.clearance_mm));
    nerve.ticks_touched += (t.flags & kStructureTouched) != 0 ? 1 : 0;
    nerve.ticks_injured += (t.flags & kStructureInjured) != 0 ? 1 : 0;
  }
  ASSERT_EQ(s.structures.size(), 2u);
  EXPECT_GT(s.structures.at(2).ticks_injured, 50u);
  EXPECT_EQ(s.structures.at(2).ticks_touched, nerve.ticks_touched);
  EXPECT_EQ(s.structures.at(2).ticks_injured, nerve.ticks_injured);
  EXPECT_NEAR(s.structures.at(2).least_clearance_mm, nerve.least_clearance_mm, 1e-6);
  EXPECT_EQ(s.structures.at(9).ticks_touched, 0u);
  EXPECT_GT(s.structures.at(9).least_clearance_mm, 0.2);
  EXPECT_LT(s.structures.at(9).least_clearance_mm, 5);
  const ReplayResult again = replay(SessionReader(options.session_file), world.copy(), anatomy, {});
  EXPECT_TRUE(again.identical) << again.difference;
  ASSERT_EQ(again.structures.size(), 2u);
  for (const auto& [value, e] : s.structures) {
    EXPECT_EQ(again.structures.at(value).least_clearance_mm, e.least_clearance_mm);
    EXPECT_EQ(again.structures.at(value).ticks_touched, e.ticks_touched);
    EXPECT_EQ(again.structures.at(value).ticks_injured, e.ticks_injured);
  }
}

// The same strokes in an operation that opens what they go through: nobody is warned of it, of the other as before.
TEST(Rehearsal, WhatTheOperationOpensIsNotAtRisk) {
  const test::ScratchFolder scratch;
  const World world(test::bar(0.5, 0.2));
  const auto rehearsed = [&](const std::vector<std::string>& opened, const std::string& file) {
    RehearsalOptions options;
    options.haptics.device = SpringHand::traits();
    options.anatomy.structures = std::make_shared<const StructureMap>(two_in_the_bar(), 8, Context(), opened);
    options.haptics.structures = options.anatomy.structures->hash();
    options.haptics.opened = opened;
    options.session_file = scratch / file;
    Rehearsal rehearsal(world.copy(), std::make_unique<ScriptedDevice>(strokes(0, 2), 1000), options, {});
    RehearsalSummary s = rehearsal.run_to_end({});
    const ReplayResult again = replay(SessionReader(options.session_file), world.copy(), options.anatomy, {});
    EXPECT_TRUE(again.identical) << again.difference;
    EXPECT_EQ(read_session(options.session_file).header.haptics.opened, opened);
    return s;
  };
  const RehearsalSummary usual = rehearsed({}, "usual.oss"), s = rehearsed({"nerve", "no such cells"}, "opened.oss");
  EXPECT_EQ(s.bone_hash, usual.bone_hash) << "only who is warned differs";
  EXPECT_FALSE(usual.structure_cuts.empty());
  EXPECT_TRUE(s.structure_cuts.empty());
  ASSERT_EQ(s.structures.size(), 1u);
  EXPECT_EQ(s.structures.at(9).least_clearance_mm, usual.structures.at(9).least_clearance_mm);
  for (const TickRecord& t : read_session(scratch / "opened.oss").ticks) {
    ASSERT_EQ(t.flags & (kStructureTouched | kStructureInjured), 0u);
    ASSERT_NE(t.structure, 2u);
  }
  // As another operation would see it a session cannot be run again.
  Anatomy other;
  other.structures = std::make_shared<const StructureMap>(two_in_the_bar());
  EXPECT_THROW(static_cast<void>(replay(SessionReader(scratch / "opened.oss"), world.copy(), other, {})), Error);
}

TEST(Operation, APlateRestsOnBone) {
  for (const char* name : {"miniplate-4", "reconstruction-8", "distractor"}) {
    World world(test::bar(0.5, 0.2));
    world.act(SceneAction::grip(static_cast<std::uint32_t>(plate_index(name))));
    HapticSetup setup;
    setup.device = SpringHand::traits();
    HapticRenderer renderer(setup, {}, 1e-3);
    HapticScene scene = HapticScene::of(world, renderer.setup());
    renderer.show(&scene);
    SpringHand hand;
    Vec3 force{};
    TickRecord last;
    // Pressed down by a hand whose goal is 2 mm below the face; samples stand out by a tenth of a millimetre.
    for (int t = 0; t < 1500; ++t) {
      HandGoal goal;
      goal.position_mm = {1, 0, 8 - std::min(6.0, t * 0.01)};
      last = renderer.step(hand.step(goal, 1e-3, force)).record;
      force = from_floats(last.force_n);
      EXPECT_EQ(last.voxels_changed, 0u);
    }
    EXPECT_NEAR(force.z, 1.6, 0.5) << name;  // 0.8 N/mm of the hand
    EXPECT_LT(std::hypot(force.x, force.y), 0.3) << name;
    EXPECT_NEAR(last.device.position_mm[2], 4 - last.depth_mm + 0.1F, 0.3) << name;
    EXPECT_TRUE((last.flags & kPlateInHand) != 0);
    EXPECT_LT(std::hypot(last.torque_n_mm[0], last.torque_n_mm[1]), 3) << name;
  }
}

// Deeper than the bone is thick, edge on, far away, broken poses: bounded, and nothing that is not a number.
TEST(Operation, APlateAnywhere) {
  World world(test::bar(0.5, 0.2));
  world.act(SceneAction::saw({{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, 7.0}));  // shells of half a millimetre are left
  world.act(SceneAction::grip(static_cast<std::uint32_t>(plate_index("reconstruction-8"))));
  HapticSetup setup;
  setup.device = SpringHand::traits();
  HapticRenderer renderer(setup, {}, 1e-3);
  HapticScene scene = HapticScene::of(world, renderer.setup());
  renderer.show(&scene);
  for (int t = 0; t < 3000; ++t) {
    DeviceSample s;
    s.position_mm = {static_cast<float>(20 * std::sin(0.01 * t)), static_cast<float>(6 * std::sin(0.013 * t)),
                     static_cast<float>(5 * std::sin(0.007 * t))};
    s.axis = to_floats(normalized({std::sin(0.003 * t), std::cos(0.005 * t), std::sin(0.011 * t) - 0.2}));
    if (t % 400 == 399) s.position_mm[0] = NAN;
    if (t % 700 == 699) s.position_mm[0] = 1e30F;
    const auto record = renderer.step(s).record;
    const double force = length(from_floats(record.force_n));
    EXPECT_TRUE(std::isfinite(force));
    EXPECT_LE(force, setup.params.guard.max_force_n * 1.001);
    EXPECT_TRUE(std::isfinite(length(from_floats(record.torque_n_mm))));
  }
}

}  // namespace
}  // namespace osteo
