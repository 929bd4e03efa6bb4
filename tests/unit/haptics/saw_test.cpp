// A saw that cuts by force and time, in a cutting guide and without one.
#include "osteo/simulation/haptics/saw_slot.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>

#include "bar.h"
#include "osteo/geometry/grid/brick_places.h"
#include "osteo/simulation/haptics/device.h"
#include "osteo/simulation/haptics/renderer.h"
#include "solid.h"

namespace osteo {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;
const int kSaw = instrument_index("saw 25 mm");
const CuttingGuide kGuide{{2, 0, 0}, {1, 0, 0}, 3};

DeviceSample held(Vec3 x, Vec3 axis, int tool = kSaw, bool pedal = true) {
  DeviceSample s;
  s.position_mm = to_floats(x);
  s.axis = to_floats(normalized(axis));
  s.pedal = pedal ? 255 : 0;
  s.tool = static_cast<std::uint8_t>(tool);
  return s;
}
HapticSetup setup() {
  HapticSetup s;
  s.device = SpringHand::traits();
  return s;
}

// What a saw does to a bar of 30 x 10 x 8 mm that it is led down through: the blade lies along y, the hand is where
// `hand` says.
struct Cut {
  World world{test::bar(0.25, 0.4)};
  double removed_mm3 = 0, middle_mm = 0, spread_mm = 0, farthest_mm = 0, most_n = 0, shown_off_mm = 0, seconds = 0;
  std::vector<TickRecord> records;
  std::map<VoxelKey, double> lost;  // share of each voxel

  explicit Cut(const CuttingGuide& guide, const std::function<DeviceSample(double t_s, double z_mm)>& hand,
               double mm_per_s = 1, double most_s = 1e9) {
    EXPECT_TRUE(world.act(SceneAction::cutting_guide(guide)).done);
    const HapticSetup s = setup();
    HapticScene scene = HapticScene::of(world, s);
    HapticRenderer r(s, {}, 1e-3);
    r.show(&scene);
    const BrickGrid& bone = world.bodies().front().body->bone;
    const double voxel = bone.frame().voxel_volume_mm3();
    double sum = 0, squares = 0;
    seconds = std::min(most_s, 10.4 / mm_per_s);
    for (int t = 0; t < seconds * 1000; ++t) {
      const double t_s = t / 1000.0, z = 5.2 - mm_per_s * t_s;
      const HapticRenderer::HandStep step = r.step(hand(t_s, z));
      for (const VoxelChange& c : step.changes) {
        const double gone = static_cast<double>(c.before - c.density) * voxel,
                     x = place_of_voxel_mm(bone, c.voxel).x - kGuide.at_mm.x;
        removed_mm3 += gone;
        sum += gone * x;
        squares += gone * x * x;
        lost[c.voxel] += gone / voxel;
      }
      const Vec3 tip = from_floats(step.record.device.position_mm) + from_floats(step.record.shown_offset_mm);
      if (t > 300) shown_off_mm = std::max(shown_off_mm, std::abs(tip.x - kGuide.at_mm.x));
      most_n = std::max(most_n, static_cast<double>(step.record.normal_force_n));
      records.push_back(step.record);
    }
    for (const auto& [name, gone] : lost) {
      if (gone > 0.1) farthest_mm = std::max(farthest_mm, std::abs(place_of_voxel_mm(bone, name).x - kGuide.at_mm.x));
    }
    middle_mm = sum / removed_mm3;
    spread_mm = std::sqrt(squares / removed_mm3 - middle_mm * middle_mm);
  }
  std::size_t pieces() {
    EXPECT_TRUE(world.act(SceneAction::plain(ActionKind::hold)).done);
    static_cast<void>(world.act(SceneAction::split(5)));
    return world.bodies().size();
  }
};

DeviceSample steady(double, double z) {
  return held({2, -12, z}, {0, 1, 0});
}
// An unsteady hand: 1.5 mm to and fro across the plane, 12 degrees askew, and 0.4 mm off.
DeviceSample unsteady(double t, double z) {
  return held({2.4 + 1.5 * std::sin(kTurn * 0.9 * t), -12, z}, {0.21 * std::sin(kTurn * 0.6 * t + 1), 1, 0.05});
}

TEST(HandSaw, CutsAStraightKerfByForceAndTime) {
  Cut c({}, steady);
  // The section is 10 x 8 mm, the blade 1 mm thick.
  EXPECT_NEAR(c.removed_mm3 / 80, 1.0, 0.05);
  EXPECT_NEAR(c.middle_mm, 0, 0.02);
  EXPECT_NEAR(c.spread_mm, 1 / std::sqrt(12.0), 0.05);
  EXPECT_GT(c.farthest_mm, 0.4);
  EXPECT_LT(c.farthest_mm, 0.5 + 0.25);
  EXPECT_EQ(c.pieces(), 2U);
  for (const TickRecord& r : c.records) EXPECT_EQ(r.flags & kInSlot, 0U);
  // Twice as fast it presses harder for the same bone.
  EXPECT_GT(Cut({}, steady, 2).most_n, 1.5 * c.most_n);
}

TEST(HandSaw, TheGuideMakesAnUnsteadyHandsCutAStraightOne) {
  Cut free({}, unsteady), led(kGuide, unsteady);
  EXPECT_GT(free.spread_mm, 3 * led.spread_mm);
  EXPECT_NEAR(led.removed_mm3 / 80, 1.0, 0.1);
  EXPECT_NEAR(led.middle_mm, 0, 0.05);
  EXPECT_NEAR(led.spread_mm, 1 / std::sqrt(12.0), 0.06);
  EXPECT_LT(led.farthest_mm, 0.5 + 0.3);
  EXPECT_GT(free.farthest_mm, 1.5);
  EXPECT_EQ(led.pieces(), 2U);
  // The blade is shown where it cuts, and the hand is pulled there.
  EXPECT_LT(led.shown_off_mm, 0.3);
  double against = 0;
  for (std::size_t t = 300; t < led.records.size(); ++t) {
    const TickRecord& r = led.records[t];
    ASSERT_NE(r.flags & kInSlot, 0U) << t;
    const double off = static_cast<double>(r.device.position_mm[0]) - 2;
    if (std::abs(off) > 0.5 && static_cast<double>(r.force_n[0]) * off > 0) ++against;
    EXPECT_NEAR(tool_axis(r, led.world.cutting_guide()).x, 0, 1e-6);
  }
  EXPECT_LT(against, 0.02 * static_cast<double>(led.records.size())) << "the spring pulls towards the plane";
}

// A guide far away, or with another instrument in the hand, changes no bit.
TEST(HandSaw, AGuideThatHoldsNothingIsNothing) {
  const auto same_bits = [](const Cut& a, const Cut& b) {
    ASSERT_EQ(a.records.size(), b.records.size());
    for (std::size_t t = 0; t < a.records.size(); ++t) {
      ASSERT_EQ(a.records[t].force_n, b.records[t].force_n) << t;
      ASSERT_EQ(a.records[t].removed_mm3, b.records[t].removed_mm3) << t;
      ASSERT_EQ(a.records[t].flags, b.records[t].flags) << t;
    }
  };
  same_bits(Cut({}, steady, 2, 1.5), Cut({{2, 0, 40}, {0, 0, 1}, 3}, steady, 2, 1.5));
  const auto drill = [](double t, double z) {
    DeviceSample s = unsteady(t, z);
    s.tool = static_cast<std::uint8_t>(burr_index(BurrKind::cutting, 2));
    return s;
  };
  same_bits(Cut({}, drill, 2, 1.5), Cut(kGuide, drill, 2, 1.5));
}

// In and out with hysteresis, and never with a jump.
TEST(HandSaw, SlipsInAndOutWithoutAJump) {
  SawSlot slot;
  Vec3 last_at, last_axis{0, 1, 0};
  int in = 0, turned = 0;
  bool was = false;
  for (int t = 0; t < 6000; ++t) {
    // From 20 mm away through the plane and out at the other side.
    Vec3 at{2 + 20 - t / 150.0, 0, 0}, axis = normalized({0.3, 1, 0});
    const double hand_off = at.x - 2;
    const bool now = slot.step(kGuide, true, at, axis, 1e-3);
    if (t > 0) {
      EXPECT_LT(length(at - last_at), 0.15) << t;
      EXPECT_LT(length(axis - last_axis), 0.02) << t;
    }
    if (now && !was) {
      EXPECT_NEAR(hand_off, kGuide.within_mm, 0.05);
      ++in;
    }
    if (!now && was) {
      EXPECT_NEAR(hand_off, -SawSlot::kLeaveTimes * kGuide.within_mm, 1.2);
      ++turned;
    }
    const Vec3 pull = slot.force_n(4, 8);
    EXPECT_TRUE(!now || pull.x * hand_off <= 0) << t;
    EXPECT_LE(length(pull), 8 + 1e-9);
    was = now;
    last_at = at;
    last_axis = axis;
  }
  EXPECT_EQ(in, 1);
  EXPECT_EQ(turned, 1);
  // Too steep to slip in; and what is no saw never does.
  SawSlot other;
  Vec3 at{2, 0, 0}, axis = normalized({1, 1, 0}), before = axis;
  EXPECT_FALSE(other.step(kGuide, true, at, axis, 1e-3));
  axis = {0, 1, 0};
  EXPECT_FALSE(other.step(kGuide, false, at, axis, 1e-3));
  EXPECT_EQ(axis, (Vec3{0, 1, 0}));
  static_cast<void>(before);
  // Taken away while the saw is in it: the hand is let go of gently.
  for (int t = 0; t < 300; ++t) other.step(kGuide, true, at = {3, 0, 0}, axis, 1e-3);
  EXPECT_NEAR(other.force_n(4, 8).x, -4, 1e-9);
  double last = -4;
  for (int t = 0; t < 200; ++t) {
    static_cast<void>(other.step({}, true, at = {3, 0, 0}, axis, 1e-3));
    EXPECT_LE(std::abs(other.force_n(4, 8).x - last), 0.05);
    last = other.force_n(4, 8).x;
  }
  EXPECT_EQ(last, 0);
}

// A slot with play, by its closed form: as the hand has it where the faces let it; else as far over as they let it.
TEST(HandSaw, ASlotWithPlayLetsTheBladeLieBetweenItsFaces) {
  // 8 mm high, 20 mm long, 0.2 mm of play; its middle is 6 mm above the plane's place in bone.
  const CuttingGuide printed{{2, 0, 6}, {1, 0, 0}, 3, 0.2, {0, 0, 8}, 20};
  struct Case {
    Vec3 at, axis;
    double off, slope;  // of the tip; in mm a mm along the plane
    const char* what;
  };
  const auto leaning = [](double slope, Vec3 along) { return normalized(along + Vec3{slope, 0, 0}); };
  const Vec3 down{0, 0, -1}, across{0, 1, 0};
  const std::vector<Case> cases{
      {{2.05, 0, 0}, down, 0.05, 0, "straight down, within the play"},
      {{2.7, 0, 0}, down, 0.1, 0, "straight down, at a face"},
      {{1.2, 0, -5}, down, -0.1, 0, "at the other face, deeper"},
      // Over at both ends of the faces: 0.2 mm over 8 mm, and on in that line below them.
      {{2.9, 0, 0}, leaning(0.2, down), 0.1 + 2 * 0.025, 0.025, "leaning, above its tip between the faces"},
      // Far below them the hand is so far over that both ends are at the other face.
      {{3.5, 0, -10}, leaning(0.2, down), -0.1, 0, "leaning, both ends at one face"},
      {{4.4, 0, -10}, leaning(0.2, down), 12 * 0.0125, 0.0125, "leaning, one end in the middle"},
      {{-0.4, 0, -10}, leaning(-0.2, down), -12 * 0.0125, -0.0125, "the other way"},
      {{2.03, 0, 2}, leaning(0.01, down), 0.03, 0.01, "a little, within the play"},
      // Along the slot it is 20 mm long.
      {{4, 10, 0}, leaning(0.2, across), 0.1, 0.01, "along the slot, at its end"},
      {{2.0, 0, 0}, leaning(0.2, across), 0, 0.01, "along the slot, in its middle"},
      {{2.0, 0, 0}, leaning(-0.2, across), 0, -0.01, "along the slot, the other way"},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.what);
    SawSlot slot;
    Vec3 at, axis;
    for (int t = 0; t < 200; ++t) EXPECT_TRUE(slot.step(printed, true, at = c.at, axis = c.axis, 1e-3));
    EXPECT_NEAR(at.x - 2, c.off, 1e-12);
    EXPECT_NEAR(axis.x / std::sqrt(1 - axis.x * axis.x), c.slope, 1e-12);
    EXPECT_EQ(at.y, c.at.y);
    EXPECT_EQ(at.z, c.at.z);
    EXPECT_NEAR(slot.force_n(4, 100).x, 4 * (c.off - (c.at.x - 2)), 1e-9);
  }
  // Turned anywhere, with the same play in each direction of the plane.
  const CuttingGuide square{{2, 0, 6}, {1, 0, 0}, 3, 0.2, {0, 0, 8}, 8};
  EXPECT_NEAR(square.reach_mm(normalized({0, 1, 1})), 4 * std::numbers::sqrt2, 1e-12);
  EXPECT_NEAR(square.reach_mm({0, -1, 0}), 4, 1e-12);
}

// How far the plane through the removed bone is off in the bar's middle, and tilted.
struct Plane {
  double off_mm = 0, tilt_deg = 0;
};
// Regression of x over y and z.
Plane plane_of(const Cut& c) {
  const BrickGrid& bone = c.world.bodies().front().body->bone;
  double all = 0, yy = 0, zz = 0, yz = 0, xy = 0, xz = 0;
  Vec3 mean;
  for (const auto& [name, share] : c.lost) {
    all += share;
    mean += place_of_voxel_mm(bone, name) * share;
  }
  mean = mean * (1 / all);
  for (const auto& [name, share] : c.lost) {
    const Vec3 d = place_of_voxel_mm(bone, name) - mean;
    yy += share * d.y * d.y;
    zz += share * d.z * d.z;
    yz += share * d.y * d.z;
    xy += share * d.x * d.y;
    xz += share * d.x * d.z;
  }
  const double det = yy * zz - yz * yz, sy = (xy * zz - xz * yz) / det, sz = (xz * yy - xy * yz) / det;
  return {mean.x - sy * mean.y - sz * mean.z - kGuide.at_mm.x, std::atan(std::hypot(sy, sz)) * 360 / kTurn};
}

// The unsteady hand with the blade upright, to and fro along the slot while it goes down; and one that always leans to
// one side, which play cannot average out.
DeviceSample upright(double t, double z) {
  return held({2.4 + 1.5 * std::sin(kTurn * 0.9 * t), 7 * std::sin(kTurn * 0.5 * t), z},
              {0.21 * std::sin(kTurn * 0.6 * t + 1), 0.05, -1});
}
DeviceSample leaning(double t, double z) {
  return held({2.4 + 0.3 * std::sin(kTurn * 0.9 * t), 7 * std::sin(kTurn * 0.5 * t), z}, {0.21, 0, -1});
}

// What play costs. Its bound: half of it, and what it leaves of a slope from the slot's middle to the bone's.
TEST(HandSaw, PlayCostsWhatItsClosedFormSays) {
  const auto slot = [](double play) { return CuttingGuide{{2, 0, 9}, {1, 0, 0}, 3, play, {0, 0, 8}, 16}; };
  std::printf("hand      guide        removed/section  off mm  tilt deg\n");
  const auto row = [](const char* hand, const char* guide, const Cut& c) {
    const Plane p = plane_of(c);
    std::printf("%-9s %-12s %14.3f %8.3f %8.2f\n", hand, guide, c.removed_mm3 / 80, p.off_mm, p.tilt_deg);
    return p;
  };
  const Cut free({}, upright, 1);
  row("upright", "none", free);
  EXPECT_GT(free.removed_mm3 / 80, 1.4);
  for (const double play : {0.0, 0.1, 0.3}) {
    const double most_mm = play / 2 + play / 8 * 9, most_deg = std::atan(play / 8) * 360 / kTurn;
    for (const auto& [name, hand] : {std::pair{"upright", &upright}, std::pair{"leaning", &leaning}}) {
      if (play != 0.1 && (hand == &upright) != (play == 0)) continue;  // these say all
      const Cut c(slot(play), hand, 0.5);
      const Plane p = row(name, ("play " + std::to_string(play)).substr(0, 8).c_str(), c);
      EXPECT_LT(std::abs(p.off_mm), most_mm + 0.03) << name << play;
      EXPECT_LT(p.tilt_deg, most_deg + 0.4) << name << play;
      EXPECT_LT(c.removed_mm3 / 80, 1.1 + 2 * most_mm) << name << play;
      // A hand that leans to one side gets all of it.
      if (play > 0.2 && name == std::string("leaning")) {
        EXPECT_GT(p.off_mm, 0.2 * most_mm);
        EXPECT_GT(p.tilt_deg, 0.5 * most_deg);
      }
    }
  }
}

// Behind the blade the chuck comes down on bone that slopes across the plane, and is held by it: it stops the saw, and
// does not slide down there, for the slot holds the blade. Without a slot it slides.
TEST(HandSaw, ItsChuckOnASlopeLeavesTheBladeInItsSlot) {
  const auto slope = [](Vec3 p) { return p.y > 11 && p.z < 0.7 * (p.x - 2); };
  struct Case {
    bool guided;
    int law;
  };
  for (const auto [guided, law] : {Case{false, 5}, Case{true, 4}, Case{true, 5}}) {
    World world(test::solid(0.5, 22, slope, {}, 2));
    if (guided) {
      ASSERT_TRUE(world.act(SceneAction::cutting_guide(kGuide)).done);
    }
    HapticSetup s = setup();
    s.params.effects.held_shaft = true;
    s.params.guard.law = law;
    HapticScene scene = HapticScene::of(world, s);
    HapticRenderer r(s, {}, 1e-3);
    r.show(&scene);
    double off_mm = 0, lowest_mm = 9;
    std::uint32_t flags = 0;
    for (int t = 0; t < 4000; ++t) {
      const double z = 8 - std::min(10.0, t * 5e-3);  // 5 mm/s, then held
      const TickRecord record = r.step(held({2, -14, z}, {0, 1, 0}, kSaw, false)).record;
      flags |= record.flags;
      const Vec3 tip = from_floats(record.device.position_mm) + from_floats(record.shown_offset_mm);
      off_mm = std::max(off_mm, std::abs(tip.x - 2));
      lowest_mm = std::min(lowest_mm, tip.z);
    }
    EXPECT_NE(flags & kShaftContact, 0U);
    EXPECT_EQ((flags & kInSlot) != 0, guided);
    if (guided && law > 4) {
      EXPECT_LT(off_mm, 0.02);
      // A cylinder of 1.5 mm on a slope of 35 degrees.
      EXPECT_NEAR(lowest_mm, 1.5 * std::hypot(1, 0.7), 0.3);
    } else {
      EXPECT_GT(off_mm, 0.5);  // in its slot too, as sessions of before repeat it
    }
  }
}

TEST(HandSaw, AGuideIsCheckedBeforeItIsThere) {
  World w(test::bar(0.5, 0.4));
  EXPECT_FALSE(w.act(SceneAction::cutting_guide({{}, {1, 0, 0}, -1})).done);
  EXPECT_FALSE(w.act(SceneAction::cutting_guide({{}, {1, 0, 0}, 11})).done);
  EXPECT_FALSE(w.act(SceneAction::cutting_guide({{}, {0, 0, 0}, 2})).done);
  // A slot with play has faces, in its plane.
  EXPECT_FALSE(w.act(SceneAction::cutting_guide({{}, {1, 0, 0}, 2, 0.1})).done);
  EXPECT_FALSE(w.act(SceneAction::cutting_guide({{}, {1, 0, 0}, 2, 0.1, {8, 0, 0}, 20})).done);
  EXPECT_FALSE(w.act(SceneAction::cutting_guide({{}, {1, 0, 0}, 2, 0.1, {0, 0, 8}, 0})).done);
  EXPECT_FALSE(w.act(SceneAction::cutting_guide({{}, {1, 0, 0}, 2, 9, {0, 0, 8}, 20})).done);
  EXPECT_FALSE(w.act(SceneAction::cutting_guide({{}, {1, 0, 0}, 2, -0.1, {0, 0, 8}, 20})).done);
  EXPECT_FALSE(w.act(SceneAction::cutting_guide({{}, {1, 0, 0}, 2}, kMaxHands)).done);
  EXPECT_FALSE(w.cutting_guide().on());
  ASSERT_TRUE(w.act(SceneAction::cutting_guide({{1, 2, 3}, {0, 0, 5}, 2}, 1)).done);
  EXPECT_FALSE(w.cutting_guide(0).on());
  EXPECT_EQ(w.cutting_guide(1), (CuttingGuide{{1, 2, 3}, {0, 0, 1}, 2}));
  const CuttingGuide printed{{1, 2, 3}, {0, 0, 1}, 2, 0.1, {8, 0, 0}, 20};
  ASSERT_TRUE(w.act(SceneAction::cutting_guide(printed, 1)).done);
  EXPECT_EQ(w.cutting_guide(1), printed);
  ASSERT_TRUE(w.act(SceneAction::cutting_guide({}, 1)).done);
  EXPECT_FALSE(w.cutting_guide(1).on());
}

}  // namespace
}  // namespace osteo
