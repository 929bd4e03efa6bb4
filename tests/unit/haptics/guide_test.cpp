// The law of one hand led by another, by itself and in the servo's step.
#include "osteo/simulation/haptics/guide.h"

#include <gtest/gtest.h>

#include <cmath>

#include "osteo/simulation/haptics/renderer.h"
#include "osteo/simulation/haptics/simulated_device.h"
#include "slab.h"

namespace osteo {
namespace {

DeviceSample leader_at(Vec3 x, int strength = kLeadStrength) {
  DeviceSample s;
  s.position_mm = to_floats(x);
  s.buttons = static_cast<std::uint8_t>(strength);
  return s;
}
constexpr DeviceTraits kFirm{.damping_n_s_per_m = 21, .delay_s = 0, .encoder_mm = 0, .max_force_n = 100};

GuideLaw law_of(const HandGuide& guide, const DeviceTraits& device = kFirm) {
  GuideLaw law;
  law.set(guide, device, 1, 1e-3);
  return law;
}

TEST(Guide, PullsTowardsTheLeaderWithinItsLimit) {
  HandGuide g;
  g.stiffness_n_per_mm = 0.5;
  g.most_n = 2;
  GuideLaw law = law_of(g);
  Vec3 f = law.step({1, 0, 0}, {}, leader_at({3, 0, 0}), {}, 1e-3);
  EXPECT_NEAR(f.x, 1, 1e-6);  // towards, not away: the printed law of the thesis has the other sign
  EXPECT_EQ(f.y, 0);
  f = law.step({1, 0, 0}, {}, leader_at({30, 0, 0}, 127), {}, 1e-3);
  EXPECT_NEAR(length(f), 2, 1e-9);
  // Half of its strength, half of all.
  EXPECT_NEAR(law.step({1, 0, 0}, {}, leader_at({30, 0, 0}, 64), {}, 1e-3).x, 2 * 64.0 / 127, 1e-9);
  EXPECT_EQ(law.step({1, 0, 0}, {}, leader_at({30, 0, 0}, 0), {}, 1e-3), Vec3{});
}

TEST(Guide, DeadZoneDampingAndTheLeadersForce) {
  HandGuide g;
  g.stiffness_n_per_mm = 0.5;
  g.damping_n_s_per_m = 10;
  g.forward = 1;
  g.most_n = 20;
  g.dead_zone_mm = 1;
  GuideLaw law = law_of(g);
  Vec3 f;
  // At rest within the dead zone: the leader's force alone, once its time has gone on for a while.
  for (int t = 0; t < 100; ++t) f = law.step({}, {}, leader_at({0.9, 0, 0}), {0, 0, 2}, 1e-3);
  EXPECT_NEAR(f.x, 0, 1e-9);
  EXPECT_NEAR(f.z, 2, 1e-9);
  // Its time stands still: the force fades.
  for (int t = 0; t < 25; ++t)
    f = law.step({}, {}, leader_at({0.9, 0, 0}, kLeadStrength | kLeadStill), {0, 0, 2}, 1e-3);
  EXPECT_NEAR(f.z, 1, 0.05);
  for (int t = 0; t < 30; ++t)
    f = law.step({}, {}, leader_at({0.9, 0, 0}, kLeadStrength | kLeadStill), {0, 0, 2}, 1e-3);
  EXPECT_EQ(f.z, 0);
  // The leader moves at 100 mm/s, the hand rests: 0.01 N s/mm x 100 mm/s.
  for (int t = 0; t < 100; ++t) f = law.step({}, {}, leader_at({0, 0.005 + 0.1 * t - 5, 0}), {}, 1e-3);
  EXPECT_NEAR(f.y - 0.5 * (4.905 - 1), 1, 0.01);
}

TEST(Guide, TheDeviceBearsNoMoreThanHalfAWall) {
  HandGuide g;
  g.stiffness_n_per_mm = 9;
  g.most_n = 20;
  const DeviceTraits weak{.damping_n_s_per_m = 1, .delay_s = 0.002, .encoder_mm = 0, .max_force_n = 8};
  EXPECT_EQ(law_of(g, weak).stiffness_n_per_mm(), safe_stiffness_n_per_mm(weak, 1, 1e-3) / 2);
}

// All that leads a hand together is within the limit, and what is forwarded gives way as the hand goes off: wherever it
// is, the sum leads back beyond kNearMm, whatever the leader pressed with.
TEST(Guide, TheLeadersForceCannotCarryTheHandOff) {
  HandGuide g;
  g.stiffness_n_per_mm = 1;
  g.forward = 1;
  g.most_n = 3;
  for (const DeviceTraits& device : {kFirm, DeviceTraits{}, DeviceTraits{.damping_n_s_per_m = 1, .delay_s = 0.001}}) {
    for (const double pressed : {1.0, 4.0, 8.0}) {
      Vec3 before;
      for (double off = 0; off < 30; off += 0.05) {
        GuideLaw law = law_of(g, device);
        Vec3 f;
        for (int t = 0; t < 80; ++t) f = law.step({0, 0, off}, {}, leader_at({}), {0, 0, pressed}, 1e-3);
        EXPECT_LE(length(f), g.most_n + 1e-9);
        if (off > GuideLaw::kNearMm) {
          EXPECT_LT(f.z, 0) << off << " " << pressed;
        }
        // No steeper than the spring and as much again.
        if (off > 0) {
          EXPECT_LT(length(f - before), 2 * safe_stiffness_n_per_mm(device, 1, 1e-3) / 2 * 0.05 + 1e-9) << off;
        }
        before = f;
      }
    }
  }
}

// A hand of 0.1 kg that gives way, on three arms, is shown strokes of up to 4 mm/s that the leader pressed on with up
// to 8 N.
TEST(Guide, AHandThatIsShownFollowsWithinAMillimetre) {
  struct Arm {
    double damping, delay_s, encoder_mm;
  };
  for (const Arm& arm : {Arm{1, 0, 0}, {1, 0.001, 0}, {3, 0, 0.03}}) {
    for (const double pressed : {2.0, 5.0, 8.0}) {
      for (const double grip : {0.1, 0.25, 0.5}) {
        SimulatedDeviceParams p;
        p.damping_n_s_per_m = arm.damping;
        p.delay_s = arm.delay_s;
        p.encoder_mm = arm.encoder_mm;
        p.hand_damping_n_s_per_m = 100 * grip;
        SimulatedDevice hand(p, {});
        HandGuide g;
        g.stiffness_n_per_mm = 1;
        g.damping_n_s_per_m = 2;
        g.forward = 1;
        g.most_n = 3;
        g.own_contact = false;
        GuideLaw law = law_of(g, hand.traits());
        Guard guard({}, hand.traits());
        Vec3 force, place;
        double squares = 0, most = 0;
        int n = 0;
        for (std::uint64_t t = 0; t < 4000; ++t) {
          const double s = static_cast<double>(t) * 1e-3;
          const Vec3 way{4 * std::sin(s), 0, -0.3 * s};
          const Vec3 at = from_floats(hand.read(t, 1e-3, force).position_mm);
          place += (at - place) * 0.01;
          hand.set_hand({}, place, grip);
          // Pressed in strokes of its own, as a hand does.
          const Vec3 felt{0.15 * pressed, 0, pressed * (0.6 + 0.4 * std::sin(9 * s))};
          Guard::Input in;
          in.position_mm = at;
          in.effects_n = law.step(at, {}, leader_at(way), felt, 1e-3);
          force = guard.limit(in, 1e-3).force_n;
          if (t < 500) continue;
          const double e = length(at - way);
          squares += e * e;
          most = std::max(most, e);
          ++n;
        }
        EXPECT_LT(std::sqrt(squares / n), 1)
            << arm.damping << " " << arm.delay_s << " " << pressed << " N, grip " << grip;
        EXPECT_LT(most, 2) << pressed << " N, grip " << grip;
      }
    }
  }
}

TEST(Guide, PushingAwayHasItsOwnLimits) {
  HandGuide g;
  g.stiffness_n_per_mm = -1;
  g.damping_n_s_per_m = 10;
  g.most_n = 5;
  g.dead_zone_mm = 1;
  GuideLaw law = law_of(g);
  EXPECT_EQ(law.stiffness_n_per_mm(), -GuideLaw::kAwayStiffness);
  const auto rest = [&](Vec3 at, float clearance = 1e9F) {
    Vec3 f;
    for (int t = 0; t < 50; ++t) f = law.step(at, {clearance}, leader_at({}), {}, 1e-3);
    return f;
  };
  EXPECT_EQ(rest({0.9, 0, 0}), Vec3{});
  EXPECT_NEAR(rest({5, 0, 0}).x, 0.05 * 4, 1e-4);
  EXPECT_NEAR(rest({100, 0, 0}).x, GuideLaw::kAwayN, 1e-9);
  EXPECT_EQ(rest({5, 0, 0}, 2.9F), Vec3{});
  // Fast: none.
  Vec3 f;
  for (int t = 0; t < 50; ++t) f = law.step({5 + 0.06 * t, 0, 0}, {}, leader_at({}), {}, 1e-3);
  EXPECT_EQ(f, Vec3{});
  // A device that damps little bears little: 5/s.
  g.damping_n_s_per_m = 0;
  EXPECT_NEAR(law_of(g, {.damping_n_s_per_m = 1, .delay_s = 0, .encoder_mm = 0, .max_force_n = 8}).stiffness_n_per_mm(),
              -0.005, 1e-12);
}

TEST(Guide, WhatIsNoNumberLeadsNobody) {
  HandGuide g;
  g.stiffness_n_per_mm = 1;
  g.damping_n_s_per_m = 1;
  g.forward = 1;
  g.most_n = 3;
  GuideLaw law = law_of(g);
  EXPECT_EQ(law.step({}, {}, leader_at({NAN, 0, 0}), {}, 1e-3), Vec3{});
  EXPECT_EQ(law.step({}, {}, leader_at({1, 0, 0}), {0, INFINITY, 0}, 1e-3), Vec3{});
  DeviceSample silent = leader_at({1, 0, 0});
  silent.age_ms = 255;
  EXPECT_EQ(law.step({}, {}, silent, {}, 1e-3), Vec3{});
  EXPECT_NEAR(law.step({}, {}, leader_at({1, 0, 0}), {}, 1e-3).x, 1, 1e-9);
}

TEST(Guide, IsRecordedAsItIs) {
  HandGuide g{2, 1, -0.04, 12, 1.5, 2.5, 0.7, false};
  EXPECT_EQ(guide_of(action_of(g)), g);
  EXPECT_TRUE(g.on());
  EXPECT_FALSE(HandGuide{}.on());
}

// Two hands in a renderer: nobody led gives the same bits as before there were guides; a leader that stands still meets
// no bone, and goes on as if nothing had been.
TEST(Guide, ALeaderThatStandsStillGoesOnAsBefore) {
  HapticSetup setup;
  setup.device = kFirm;
  setup.more_devices = {kFirm};
  const auto run = [&](bool pauses) {
    auto bone = test::slab(0.5);
    HapticRenderer r(setup, bone, {}, 1e-3);
    HandGuide g;
    g.stiffness_n_per_mm = 0.5;
    g.most_n = 3;
    r.guide(action_of(g));
    std::vector<float> forces;
    for (int t = 0; t < 400; ++t) {
      DeviceSample drill;
      drill.position_mm = to_floats({0.01 * t, 0, 1.5});
      drill.tool = static_cast<std::uint8_t>(burr_index(BurrKind::cutting, 4));
      drill.pedal = 255;
      drill.buttons = kLeadStrength;
      DeviceSample far;
      far.position_mm = {0, 0, 30};
      for (int still = 0; pauses && t % 50 == 20 && still < 30; ++still) {
        DeviceSample back = drill;
        back.position_mm[0] -= 1;
        back.buttons |= kLeadStill;
        const DeviceSample both[] = {far, back};
        const auto step = r.step(both);
        EXPECT_EQ(step.changes.size(), 0U);
        EXPECT_EQ(step.hands[1].normal_force_n, 0);
      }
      const DeviceSample both[] = {far, drill};
      const auto step = r.step(both);
      EXPECT_NE(step.hands[0].flags & kGuided, 0U);
      forces.push_back(step.hands[1].normal_force_n);
    }
    return std::pair(bone.hash(), forces);
  };
  const auto plain = run(false), paused = run(true);
  EXPECT_EQ(plain.first, paused.first);
  EXPECT_EQ(plain.second, paused.second);
  EXPECT_GT(*std::max_element(plain.second.begin(), plain.second.end()), 0.1F);
}

}  // namespace
}  // namespace osteo
