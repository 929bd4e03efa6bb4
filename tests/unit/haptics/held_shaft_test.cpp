// A shaft stays on the side of bone where it is: against closed forms, and in the servo's step.
#include "osteo/simulation/haptics/detail/held_shaft.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "osteo/simulation/haptics/renderer.h"
#include "osteo/simulation/haptics/simulated_device.h"
#include "solid.h"

namespace osteo {
namespace {

constexpr double kRadius = 1.175;
const RoundCone kShaft{2, 60, kRadius, kRadius};
const double kVoxels[] = {0.2, 0.3, 0.5, 0.9};

// Straight from place to place, at a speed; where the shaft is at the end.
struct Mover {
  const BrickGrid& bone;
  Vec3 axis;
  RoundCone shape = kShaft;
  HeldShaft held = {};
  Vec3 at = {}, offset = {};
  int most = 0;
  double most_jump = 0;  // of the offset in a tick, beyond twice what the hand moved
  bool begun = false;

  Vec3 go(Vec3 to, double mm_per_s, double hz = 1000) {
    const Vec3 from = begun ? at : to;
    begun = true;
    const int n = std::max(1, static_cast<int>(std::ceil(length(to - from) / mm_per_s * hz)));
    for (int i = 1; i <= n; ++i) {
      at = from + (to - from) * (static_cast<double>(i) / n);
      const HeldShaft::Body body{&bone};
      const auto a = held.follow({&body, 1}, shape, 0.5 * bone.frame().spacing_mm.x, at, axis);
      most = std::max(most, a.evaluations);
      most_jump = std::max(most_jump, length(a.offset_mm - offset) - 2 * length(to - from) / n);
      offset = a.offset_mm;
      EXPECT_TRUE(std::isfinite(dot(offset, offset)));
    }
    return at + offset;
  }
};

// A plate of some thickness, x > 0, off the borders of voxels; the shaft stands across it and comes from the side. Its
// whole thickness is bone on both sides of a shaft that is in it, so that pushes cancel there.
TEST(HeldShaft, StopsAtTheRimOfAPlateOfAnyThickness) {
  for (const double h : kVoxels) {
    for (const double thick : {0.5, 1.0, 2.0, 4.0}) {
      const auto plate = test::solid(
          h, 8, [&](Vec3 p) { return p.x > 0.07 && std::abs(p.z - 0.13) < thick / 2; }, {}, 3);
      for (const double speed : {1.0, 25.0, 300.0}) {
        Mover m{plate, {0, 0, 1}};
        m.go({-2.2, 0.3, -30}, speed);
        m.go({0.1, 0.3, -30}, speed);
        Vec3 x = m.go({0.1, 0.3, -30}, speed);
        EXPECT_NEAR(x.x, 0.07 - kRadius, 0.5 * h + 0.02) << h << " " << thick << " " << speed;
        if (speed < 25) continue;
        x = m.go({6, 0.3, -30}, speed);
        EXPECT_NEAR(x.x, 0.07 - kRadius, 0.5 * h + 0.02) << h << " " << thick << " " << speed;
        EXPECT_NEAR(length(m.offset), 6 - x.x, 0.05);
        // It slides along the rim as the hand goes on, and is free when the hand comes back.
        m.go({6, 3.3, -30}, speed);
        for (int n = 0; n < 50; ++n) x = m.go({6, 3.3, -30}, speed);
        EXPECT_NEAR(x.x, 0.07 - kRadius, 0.5 * h + 0.02);
        // 7 mm behind the rim its friction is 0.36 mm, and a degree of the rim's direction 0.12 mm.
        EXPECT_NEAR(x.y, 3.3, 0.75) << h << " " << thick << " " << speed;
        m.go({-3, 3.3, -30}, speed);
        EXPECT_EQ(length(m.offset), 0);
        EXPECT_LE(m.most, 16);
      }
    }
  }
}

// Lying under a plate and drawn up, and drawn out sideways through what is in the way.
TEST(HeldShaft, StopsWhenItIsDrawnOut) {
  for (const double h : kVoxels) {
    const auto plate = test::solid(
        h, 8, [&](Vec3 p) { return std::abs(p.z - 0.13) < 1; }, {}, 3);
    Mover m{plate, {1, 0, 0}};
    m.go({-30, 0.2, -4}, 25);
    const Vec3 x = m.go({-30, 0.2, 12}, 100);
    EXPECT_NEAR(x.z, 0.13 - 1 - kRadius, 0.5 * h + 0.02) << h;
  }
}

// A slot between two plates: wide enough it is gone through, narrower than the shaft the shaft rests on its two
// corners.
TEST(HeldShaft, ASlotHoldsWhatDoesNotFit) {
  for (const double h : kVoxels) {
    for (const double gap : {1.2, 2 * kRadius + 1.2 * h}) {
      const auto plates = test::solid(
          h, 8, [&](Vec3 p) { return p.y > 0 && std::abs(p.x) > gap / 2 && std::abs(p.z) < 1; }, {}, 3);
      Mover m{plates, {0, 0, 1}};
      m.go({0, -4, -30}, 25);
      const Vec3 x = m.go({0, 6, -30}, 50);
      if (gap < 2 * kRadius) {
        EXPECT_NEAR(x.y, -std::sqrt(kRadius * kRadius - gap * gap / 4), 0.6 * h + 0.02) << h;
      } else {
        EXPECT_NEAR(x.y, 6, 0.02) << h;
      }
      EXPECT_NEAR(x.x, 0, 0.1 * h) << h;
    }
  }
}

// In a round hole it goes as far as the hole is wider, whichever way.
TEST(HeldShaft, InAHoleItGoesToTheWall) {
  for (const double h : kVoxels) {
    const double hole = 2.6;
    const auto ring = test::solid(
        h, 8, [&](Vec3 p) { return std::hypot(p.x, p.y) > hole && std::abs(p.z) < 1; }, {}, 3);
    for (int n = 0; n < 7; ++n) {
      const double a = 0.3 + n * 0.9;
      Mover m{ring, {0, 0, 1}};
      m.go({0, 0, -30}, 25);
      Vec3 x = m.go({8 * std::cos(a), 8 * std::sin(a), -30}, n < 3 ? 25 : 300);
      for (int t = 0; t < 20; ++t) x = m.go({8 * std::cos(a), 8 * std::sin(a), -30}, 25);
      EXPECT_NEAR(std::hypot(x.x, x.y), hole - kRadius, 0.5 * h + 0.02) << h << " " << n;
      EXPECT_NEAR(std::atan2(x.y, x.x), std::remainder(a, 2 * std::numbers::pi), 0.1 + 0.25 * h) << h << " " << n;
    }
  }
}

// Onto a rim, along it, off its end and back, and drawn out: what pulls the hand goes with the offset, which changes by
// what the hand moves and by what a shaft that is free again comes back. (It left the offset without a force, or the
// force without an offset, for a tick: 1.6 N.)
TEST(HeldShaft, ItsOffsetNeverJumps) {
  for (const double h : kVoxels) {
    const auto plate = test::solid(
        h, 8, [&](Vec3 p) { return p.x > 0.07 && std::abs(p.z - 0.13) < 1 && p.y > -2; }, {}, 3);
    for (const double speed : {1.0, 25.0, 300.0}) {
      const double far = speed < 5 ? 0.3 : 3;
      Mover m{plate, {0, 0, 1}};
      m.go({-kRadius - 0.3, 0, -30}, speed);
      m.go({-kRadius + far, 0.2, -30}, speed);
      m.go({-kRadius + far, -0.4 - far, -30}, speed);
      m.go({-kRadius + far, 0.2, -30}, speed);
      m.go({-kRadius - 0.3, 0.2, -30}, speed);
      EXPECT_LT(m.most_jump, HeldShaft::kReturnMm + 1e-9) << h << " " << speed;
      Mover out{plate, normalized({1, 0, 0.05})};
      out.go({-20, 1.5, -2.8}, speed);
      out.go({-20, 1.5, -2.8 + 1 + far}, speed);
      out.go({-20, 1.5, -2.8}, speed);
      EXPECT_LT(out.most_jump, HeldShaft::kReturnMm + 1e-9) << h << " " << speed;
    }
  }
}

HeldShaft::Body placed(const BrickGrid& bone, VoxelKey name, Vec3 shift) {
  const RigidTransform there{{}, shift};
  return {&bone, nullptr, name, there, there.inverse()};
}

// Two pieces with a slot between them hold it as one bone with that slot does: their pushes are added before it is
// asked where it may be.
TEST(HeldShaft, PiecesHoldItTogether) {
  const double h = 0.5, gap = 1.2;
  const auto half = [&](double side, bool both) {
    return test::solid(
        h, 8, [=](Vec3 p) { return p.y > 0 && (both ? std::abs(p.x) : side * p.x) > gap / 2 && std::abs(p.z) < 1; }, {},
        3);
  };
  const auto whole = half(0, true), left = half(-1, false), right = half(1, false);
  HeldShaft of_one, of_two;
  Vec3 one, two;
  for (int t = 0; t <= 400; ++t) {
    const Vec3 at{0.1, -4 + t * 0.02, -30};
    const HeldShaft::Body body = placed(whole, 0, {});
    const std::array bodies{placed(left, 0, {}), placed(right, 1U << 20, {})};
    one = of_one.follow({&body, 1}, kShaft, 0.5 * h, at, {0, 0, 1}).offset_mm;
    two = of_two.follow(bodies, kShaft, 0.5 * h, at, {0, 0, 1}).offset_mm;
  }
  EXPECT_LT(one.y, -3);
  EXPECT_LT(length(one - two), 0.02 * h);
}

// A piece that is pushed against a shaft at rest takes it along; when it is taken away, or gone, the shaft comes back
// to the hand without a jump.
TEST(HeldShaft, APieceThatMovesPushesIt) {
  const double h = 0.5;
  const auto piece = test::solid(
      h, 8, [](Vec3 p) { return p.x > 0 && std::abs(p.z) < 1; }, {}, 3);
  for (const bool gone : {false, true}) {
    HeldShaft held;
    const Vec3 at{0, 0.2, -30};
    Vec3 last;
    double piece_x = 3;
    for (int t = 0; t < 400; ++t) {
      if (t < 100) piece_x -= 0.03;
      if (t == 200) piece_x = 9;
      const HeldShaft::Body body = placed(piece, 0, {piece_x, 0, 0});
      const std::size_t bodies = gone && t >= 200 ? 0 : 1;
      const Vec3 offset = held.follow({&body, bodies}, kShaft, 0.5 * h, at, {0, 0, 1}).offset_mm;
      EXPECT_LE(length(offset - last), HeldShaft::kReturnMm + 1e-9);
      last = offset;
      if (t == 199) {
        EXPECT_NEAR(offset.x, piece_x - kRadius, 0.5 * h + 0.02);
      }
    }
    EXPECT_EQ(length(last), 0);
  }
}

TEST(HeldShaft, WithoutBoneItIsWhereTheHandIs) {
  HeldShaft held;
  for (int t = 0; t < 5; ++t) {
    const auto a = held.follow({}, kShaft, 0.25, {0.3 * t, 0, 0}, {0, 0, 1});
    EXPECT_EQ(a.offset_mm, Vec3{});
    EXPECT_EQ(a.torque_mm, Vec3{});
  }
}

TEST(HeldShaft, InBoneAllAroundItIsLetBe) {
  const auto solid = test::solid(
      0.5, 8, [](Vec3) { return true; }, {}, 1);
  Mover m{solid, {0, 0, 1}};
  for (int n = 0; n < 5; ++n) EXPECT_EQ(length(m.go({0.1 * n, 0, -30}, 25) - m.at), 0);
  Mover nowhere{solid, {0, 0, 1}};
  const HeldShaft::Body body{&solid};
  EXPECT_EQ(nowhere.held.follow({&body, 1}, kShaft, 0.25, {NAN, 0, 0}, {0, 0, 1}).offset_mm, Vec3{});
}

// Through a hole in a plate, the hand pushes to the side with a constant force, drill off and on: the tool stays in the
// hole, though the burr mills where it can. (A hand went 30 mm through any thickness.)
TEST(HeldShaft, AHandDoesNotPushItThroughCortex) {
  for (const char* const name : {"cutting 4 mm", "sucker 8 Fr", "probe 1 mm", "hook 2 mm", "irrigator 2 mm"}) {
    for (const double push : {0.2, 1.3}) {
      const double h = 0.5;
      auto plate = test::solid(
          h, 12, [](Vec3 p) { return std::abs(p.z) < 1.75 && std::hypot(p.x, p.y) > 3; }, {}, 2);
      HapticSetup setup;
      setup.params.effects.vibration = false;
      setup.params.effects.held_shaft = true;
      SimulatedDeviceParams held;
      held.hand_damping_n_s_per_m = 5;
      SimulatedDevice device(held, {0, 0, -8});
      const int tool = instrument_index(name);
      const bool cuts = instrument_library()[static_cast<std::size_t>(tool)].cutter() != nullptr;
      setup.device = device.traits();
      HapticRenderer r(setup, plate, {}, 1e-3);
      device.set_hand({push, 0, 0}, {0, 0, -8}, 0);
      Vec3 force;
      double farthest = 0, tool_farthest = 0, gained = 0;
      std::uint32_t flags = 0;
      for (std::uint64_t t = 0; t < 3000; ++t) {
        device.set_drill(cuts && t > 1500, tool);
        const TickRecord record = r.step(device.read(t, 1e-3, force)).record;
        force = from_floats(record.force_n);
        flags |= record.flags;
        if (t > 1000) farthest = std::max(farthest, device.position_mm().x);
        tool_farthest =
            std::max(tool_farthest, static_cast<double>(record.device.position_mm[0] + record.shown_offset_mm[0]));
        gained = std::max(gained, static_cast<double>(record.energy_mj));
      }
      const double room = 3 - instrument_library()[static_cast<std::size_t>(tool)].shaft.start_radius_mm;
      EXPECT_NE(flags & kShaftContact, 0U) << name;
      EXPECT_LT(tool_farthest, room + 0.6 * h) << name << " " << push;
      EXPECT_LT(farthest, room + push / 2 + 0.6 * h) << name << " " << push;
      EXPECT_GT(farthest, room - 0.3) << name << " " << push;
      EXPECT_LT(length(device.velocity_mm_s()), 2) << name << " " << push;
      EXPECT_LT(gained, 0.1) << name << " " << push;
    }
  }
}

// A burr and a sucker in one hole, pressed apart: each is held, and feels what it would feel alone.
TEST(HeldShaft, TwoHandsAreHeldEachByItself) {
  const auto hole = [] {
    return test::solid(
        0.5, 12, [](Vec3 p) { return std::abs(p.z) < 1.75 && std::hypot(p.x, p.y) > 5; }, {}, 2);
  };
  const auto setup = [](std::size_t hands) {
    HapticSetup s;
    s.params.effects.vibration = false;
    s.params.effects.held_shaft = true;
    s.device = SpringHand::traits();
    if (hands > 1) s.more_devices = {s.device};
    return s;
  };
  const auto sample = [](int hand, int t) {
    DeviceSample d;
    d.position_mm = {static_cast<float>((hand == 0 ? 0.01 : -0.01) * std::min(t, 600)), 0.1F, -8};
    d.axis = {0, 0, 1};
    d.tool = static_cast<std::uint8_t>(instrument_index(hand == 0 ? "cutting 4 mm" : "sucker 8 Fr"));
    return d;
  };
  auto both_bone = hole();
  std::vector<BrickGrid> alone_bone;
  alone_bone.push_back(hole());
  alone_bone.push_back(hole());
  HapticRenderer both(setup(2), both_bone, {}, 1e-3), first(setup(1), alone_bone[0], {}, 1e-3),
      second(setup(1), alone_bone[1], {}, 1e-3);
  TickRecord last[2];
  for (int t = 0; t < 700; ++t) {
    const std::array samples{sample(0, t), sample(1, t)};
    const auto step = both.step(samples);
    const TickRecord a = first.step(samples[0]).record, b = second.step(samples[1]).record;
    EXPECT_EQ(step.hands[0].force_n, a.force_n) << t;
    EXPECT_EQ(step.hands[1].force_n, b.force_n) << t;
    last[0] = step.hands[0];
    last[1] = step.hands[1];
  }
  for (const TickRecord& r : last) {
    const double room = 5 - instrument_library()[r.device.tool].shaft.start_radius_mm;
    EXPECT_NE(r.flags & kShaftContact, 0U);
    EXPECT_NEAR(std::abs(r.device.position_mm[0] + r.shown_offset_mm[0]), room, 0.3);
  }
}

// Whoever changes the burr while its shaft is pressed to a rim does not get through with the next one.
TEST(HeldShaft, AnotherToolIsHeldWhereTheOneBeforeWas) {
  auto plate = test::solid(
      0.5, 12, [](Vec3 p) { return std::abs(p.z) < 1.75 && std::hypot(p.x, p.y) > 5; }, {}, 2);
  HapticSetup setup;
  setup.params.effects.held_shaft = true;
  setup.device = SpringHand::traits();
  HapticRenderer r(setup, plate, {}, 1e-3);
  Vec3 last;
  for (int t = 0; t < 900; ++t) {
    DeviceSample d;
    d.position_mm = {static_cast<float>(0.01 * std::min(t, 550)), 0.1F, -8};
    d.axis = {0, 0, 1};
    d.tool = static_cast<std::uint8_t>(instrument_index(t < 700 ? "cutting 4 mm" : "sucker 12 Fr"));
    const TickRecord record = r.step(d).record;
    const Vec3 force = from_floats(record.force_n);
    if (t > 550) {
      EXPECT_LT(length(force - last), 4 * HeldShaft::kReturnMm + 0.01) << t;
    }
    last = force;
    if (t < 650) continue;
    const double room = 5 - instrument_library()[d.tool].shaft.start_radius_mm;
    EXPECT_LT(record.device.position_mm[0] + record.shown_offset_mm[0], room + (t < 720 ? 1.0 : 0.3)) << t;
  }
}

}  // namespace
}  // namespace osteo
