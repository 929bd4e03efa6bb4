#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "osteo/core/base/error.h"
#include "osteo/simulation/haptics/renderer.h"
#include "slab.h"
#include "solid.h"
#include "stability.h"

namespace osteo {
namespace {

class Stability : public testing::TestWithParam<test::StabilityCase> {};

TEST_P(Stability, RestsOnAWallOf2kNPerM) {
  for (const double push_n : {0.3, 1.0, 3.0}) {
    const auto r = test::push_against_wall(GetParam(), 2, true, push_n);
    EXPECT_TRUE(r.stable) << push_n << " N: " << r.fastest_mm_s << " mm/s at the end with " << r.stiffness_n_per_mm
                          << " N/mm";
    // What the wall gave, at any time, beyond what it had taken.
    EXPECT_LT(r.gained_mj, GetParam().device.late_share > 0.03 ? 1.5 : 0.5) << push_n;
  }
}
INSTANTIATE_TEST_SUITE_P(Table, Stability, testing::ValuesIn(test::kStabilityCases), [](const auto& row) {
  std::string name;
  for (const char* c = row.param.name; *c != 0; ++c)
    name += std::isalnum(static_cast<unsigned char>(*c)) != 0 ? *c : '_';
  return name;
});

// --- every tick of every hard case: finite, capped, of bounded rate and reach, the same again
// -----------------------------------------

const ContactMethod kMethods[] = {ContactMethod::rays, ContactMethod::volume, ContactMethod::overlap,
                                  ContactMethod::proxy};

HapticSetup setup_for(ContactMethod method) {
  HapticSetup s;
  s.params.contact.method = method;
  s.params.contact.stiffness_n_per_mm = 2;
  s.device = {.damping_n_s_per_m = 2, .delay_s = 0, .encoder_mm = 0, .max_force_n = 3.3, .max_stiffness_n_per_mm = 1e9};
  return s;
}

struct Checked {
  HapticRenderer renderer;
  double dt;
  HapticSetup setup;
  Vec3 last_force{};
  std::uint64_t ticks = 0;
  std::uint32_t flags = 0;
  double removed = 0;
  std::vector<TickRecord> records;

  Checked(const HapticSetup& s, BrickGrid& bone, double dt_s = 1e-3)
      : renderer(s, bone, {}, dt_s), dt(dt_s), setup(s) {}

  Vec3 step(const DeviceSample& sample) {
    const auto [r, changes] = renderer.step(sample);
    const Vec3 f{r.force_n[0], r.force_n[1], r.force_n[2]};
    EXPECT_TRUE(std::isfinite(length(f))) << ticks;
    EXPECT_TRUE(std::isfinite(r.torque_n_mm[0] + r.torque_n_mm[1] + r.torque_n_mm[2]));
    EXPECT_TRUE(std::isfinite(r.shown_offset_mm[0] + r.shown_offset_mm[1] + r.shown_offset_mm[2]));
    EXPECT_LE(length(f), std::min(setup.params.guard.max_force_n, setup.device.max_force_n) * (1 + 1e-6)) << ticks;
    EXPECT_LE(length(f - last_force), setup.params.guard.max_rate_n_per_s * dt * (1 + 1e-5) + 1e-6) << ticks;
    EXPECT_LT(std::hypot(r.shown_offset_mm[0], r.shown_offset_mm[1], r.shown_offset_mm[2]), 120) << ticks;
    for (const VoxelChange& c : changes) {
      EXPECT_GE(c.density, 0);
      EXPECT_LE(c.density, 1);
    }
    last_force = f;
    flags |= r.flags;
    removed += static_cast<double>(r.removed_mm3);
    ++ticks;
    records.push_back(r);
    return f;
  }
};

struct HardCase {
  const char* name;
  bool (*inside)(Vec3);
  Vec3 from, to;  ///< where the hand goes, on a spring
  bool drill;
  double origin;  ///< of everything, along each axis
};
const HardCase kHardCases[] = {
    {"thin_shell", [](Vec3 p) { return std::abs(p.z) < 0.5; }, {0, 0, 6}, {0.5, 0.2, -2}, false, 0},
    {"thin_shell_drilled", [](Vec3 p) { return std::abs(p.z) < 0.5; }, {0, 0, 6}, {0.5, 0.2, -6}, true, 0},
    {"acute_wedge", [](Vec3 p) { return p.z < 0 && std::abs(p.x) < -0.3 * p.z; }, {0.1, 0, 6}, {-0.4, 1, -4}, false, 0},
    {"saddle", [](Vec3 p) { return p.z < 0.08 * (p.x * p.x - p.y * p.y); }, {0, 0, 6}, {1, 1, -3}, false, 0},
    {"three_contacts", [](Vec3 p) { return p.x < -1 || p.y < -1 || p.z < -1; }, {5, 5, 5}, {-2, -2.2, -1.8}, false, 0},
    {"slot_narrower_than_the_burr",
     [](Vec3 p) { return p.z < 0 && std::abs(p.x) > 1; },
     {0, 0, 6},
     {0.3, 0, -4},
     false,
     0},
    {"bump", [](Vec3 p) { return p.z < 0 || length(p) < 1; }, {-6, 0, 4}, {6, 0.1, -1}, false, 0},
    {"start_inside", [](Vec3 p) { return length(p) < 9; }, {2, 1, 0}, {2, 1, 0}, false, 0},
    {"one_voxel",
     [](Vec3 p) {
       return std::max({std::abs(p.x - 0.25), std::abs(p.y - 0.25), std::abs(p.z - 0.25)}) < 0.25;
     },
     {0, 0, 5},
     {0, 0, 0},
     true,
     0},
    {"far_from_the_origin", [](Vec3 p) { return p.z < 0; }, {0, 0, 6}, {1, 0, -3}, true, 1e4},
    {"no_bone_at_all", [](Vec3) { return false; }, {0, 0, 6}, {1, 0, -3}, true, 0},
    {"along_the_border_of_the_grid", [](Vec3 p) { return p.x > 6; }, {9, 0, 12}, {11, 0, 0}, true, 0},
};

class HardCases : public testing::TestWithParam<std::tuple<ContactMethod, HardCase>> {};

TEST_P(HardCases, StayWithinAllBounds) {
  const auto& [method, c] = GetParam();
  const auto bone0 = test::solid(0.5, 12, c.inside, {c.origin, c.origin, c.origin});
  std::vector<TickRecord> first;
  for (int round = 0; round < 2; ++round) {
    auto bone = bone0;
    const Vec3 o{c.origin, c.origin, c.origin};
    SimulatedDevice device({.mass_kg = 0.15, .damping_n_s_per_m = 2, .hand_damping_n_s_per_m = 3}, c.from + o);
    device.set_axis({0.3, 0.1, std::sqrt(1 - 0.1)});
    device.set_drill(c.drill, 3);
    Checked run(setup_for(method), bone);
    Vec3 force{};
    double late_speed = 0;
    for (std::uint64_t t = 0; t < 2500; ++t) {
      const double s = std::min(1.0, static_cast<double>(t) / 1200);
      device.set_hand({}, c.from + (c.to - c.from) * s + o, 0.4);
      force = run.step(device.read(t, 1e-3, force));
      if (t > 2200) late_speed = std::max(late_speed, length(device.velocity_mm_s()));
    }
    // Nothing may shake at rest; the drill's own vibration and drag may.
    if (!c.drill) {
      EXPECT_LT(late_speed, std::string(c.name) == "start_inside" || method == ContactMethod::rays ? 60 : 8);
    }
    if (round == 0) {
      first = run.records;
    } else {
      for (std::size_t i = 0; i < first.size(); ++i)
        ASSERT_EQ(std::memcmp(&first[i], &run.records[i], sizeof(TickRecord)), 0) << i;
    }
  }
}
INSTANTIATE_TEST_SUITE_P(
    All, HardCases, testing::Combine(testing::ValuesIn(kMethods), testing::ValuesIn(kHardCases)), [](const auto& row) {
      return std::string(EnumNames<ContactMethod>::values[static_cast<std::size_t>(std::get<0>(row.param))]) + "_" +
             std::get<1>(row.param).name;
    });

DeviceSample at(double x, double y, double z) {
  DeviceSample s;
  s.position_mm = {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
  s.axis = {0.6F, 0, 0.8F};
  s.tool = 3;
  return s;
}

TEST(HardCase, StartedInsideTheForceLeadsOut) {
  for (const ContactMethod method : {ContactMethod::volume, ContactMethod::overlap}) {
    auto bone = test::solid(0.5, 12, [](Vec3 p) { return length(p) < 9; });
    Checked run(setup_for(method), bone);
    for (int t = 0; t < 300; ++t) static_cast<void>(run.step(at(3, 1, 0)));
    EXPECT_GT(dot(run.last_force, normalized({3, 1, 0})), 0.8 * length(run.last_force));
    EXPECT_GT(length(run.last_force), 1);
    EXPECT_NE(run.flags & kEscape, 0u);
  }
}

TEST(HardCase, AJumpOf50MmInATickBeginsAgainFromNothing) {
  for (const ContactMethod method : kMethods) {
    auto bone = test::slab(0.5);
    Checked run(setup_for(method), bone);
    for (int t = 0; t < 100; ++t) static_cast<void>(run.step(at(0, 0, 40)));
    const Vec3 first = run.step(at(0, 0, -10));
    EXPECT_LT(length(first), 0.1);
    EXPECT_NE(run.records.back().flags & kPoseJumped, 0u);
    for (int t = 0; t < 10; ++t) static_cast<void>(run.step(at(0, 0, -10)));
    EXPECT_LT(length(run.last_force), 1.2);  // a tenth of the way back
  }
}

TEST(HardCase, APoseThatIsNotANumberFadesTheForceAndStopsTheDrill) {
  auto bone = test::slab(0.5);
  Checked run(setup_for(ContactMethod::overlap), bone);
  auto pose = at(0, 0, 1.2);
  for (int t = 0; t < 200; ++t) static_cast<void>(run.step(pose));
  EXPECT_GT(length(run.last_force), 0.5);
  pose.pedal = 255;
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    auto broken = pose;
    broken.position_mm[2] = bad;
    for (int t = 0; t < 20; ++t) static_cast<void>(run.step(broken));
    EXPECT_EQ(length(run.last_force), 0);
    EXPECT_NE(run.records.back().flags & kPoseInvalid, 0u);
    broken = pose;
    broken.axis[0] = bad;
    static_cast<void>(run.step(broken));
  }
  // The axis alone may be unusable: then it stands upright.
  pose.pedal = 0;
  pose.axis = {0, 0, 0};
  for (int t = 0; t < 200; ++t) static_cast<void>(run.step(pose));
  EXPECT_GT(length(run.last_force), 0.5);
}

TEST(HardCase, AnUnpluggedDeviceFadesAndRemovesNothing) {
  auto bone = test::slab(0.5);
  Checked run(setup_for(ContactMethod::overlap), bone);
  auto pose = at(0, 0, 1.2);
  pose.pedal = 255;
  for (int t = 0; t < 200; ++t) static_cast<void>(run.step(pose));
  EXPECT_GT(run.removed, 0);
  const double removed = run.removed;
  for (int t = 0; t < 100; ++t) {
    pose.age_ms = static_cast<std::uint8_t>(std::min(255, 11 + t));
    static_cast<void>(run.step(pose));
  }
  EXPECT_EQ(run.removed, removed);
  EXPECT_EQ(length(run.last_force), 0);
  EXPECT_NE(run.records.back().flags & kPoseStale, 0u);
  pose.age_ms = 0;  // plugged in again: force comes back by and by
  const Vec3 first = run.step(pose);
  EXPECT_LT(length(first), 0.3);
  for (int t = 0; t < 200; ++t) static_cast<void>(run.step(pose));
  EXPECT_GT(length(run.last_force), 0.1);
}

TEST(HardCase, BoneTakenAwayUnderTheBurrLetsGo) {
  for (const ContactMethod method : kMethods) {
    auto bone = test::slab(0.5);
    Checked run(setup_for(method), bone);
    for (int t = 0; t < 100; ++t) static_cast<void>(run.step(at(0, 0, 3 - t * 0.02)));
    EXPECT_GT(length(run.last_force), 0.5);
    for (std::uint32_t v = 0; v < bone.brick_count() * BrickGrid::kVoxels; ++v) bone.set(v, 0);
    for (int t = 0; t < 10; ++t) static_cast<void>(run.step(at(0, 0, 1)));
    EXPECT_EQ(length(run.last_force), 0);
  }
}

TEST(HardCase, AStallOfFourTicksChangesTheForceWithoutAStep) {
  auto bone = test::slab(0.5);
  Checked run(setup_for(ContactMethod::overlap), bone);
  for (int t = 0; t < 100; ++t) static_cast<void>(run.step(at(0, 0, 3 - t * 0.01)));
  const Vec3 before = run.last_force;
  const Vec3 after = run.step(at(0, 0, 3 - 104 * 0.01));  // the hand went on meanwhile
  EXPECT_LT(length(after - before), 0.2);
}

TEST(HardCase, TimeGoingBackwardsOrStandingStillIsAMillisecond) {
  Guard guard({}, {});
  for (const double dt :
       {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    const auto out = guard.limit({{0, 0, 1}, {0, 0, 5}, {0, 0, 1}, {}, 0, false}, dt);
    EXPECT_TRUE(std::isfinite(length(out.force_n)));
    EXPECT_LE(length(out.force_n), 8.001);
  }
}

TEST(Guard, LimitsForceAndRate) {
  GuardParams p;
  p.max_force_n = 5;
  p.max_rate_n_per_s = 1000;
  Guard guard(p,
              {.damping_n_s_per_m = 1, .delay_s = 0, .encoder_mm = 0, .max_force_n = 3, .max_stiffness_n_per_mm = 1e9});
  Vec3 last{};
  for (int t = 0; t < 10; ++t) {
    const auto out = guard.limit({{0, 0, 1}, {0, 0, 50}, {0, 0, 1}, {}, 0, false}, 1e-3);
    EXPECT_LE(length(out.force_n - last), 1 + 1e-9);
    EXPECT_LE(length(out.force_n), 3 + 1e-9);
    last = out.force_n;
  }
  EXPECT_NEAR(last.z, 3, 1e-9);
}

TEST(Guard, StiffnessFollowsTickDelayAndDamping) {
  const DeviceTraits plain{
      .damping_n_s_per_m = 1, .delay_s = 0, .encoder_mm = 0, .max_force_n = 8, .max_stiffness_n_per_mm = 1e9};
  EXPECT_NEAR(safe_stiffness_n_per_mm(plain, 1, 1e-3), 2, 1e-9);
  EXPECT_NEAR(safe_stiffness_n_per_mm(plain, 1, 0.5e-3), 4, 1e-9);
  auto slow = plain;
  slow.delay_s = 5e-3;
  EXPECT_NEAR(safe_stiffness_n_per_mm(slow, 1, 1e-3), 1 / 5.5, 1e-3);
  auto soft = plain;
  soft.max_stiffness_n_per_mm = 0.4;
  EXPECT_EQ(safe_stiffness_n_per_mm(soft, 1, 1e-3), 0.4);
}

double any_bits(std::mt19937_64& random) {
  return std::bit_cast<double>(random());
}

// Any bit patterns at all for whatever it is given or made with: what comes out is finite and within the limits of
// force and rate.
TEST(Fuzz, TheGuardLetsNothingThatIsNoNumberThrough) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> u(-1, 1);
  // Mostly plausible, so that one bad value at a time meets all the good ones; now and then everything is bad.
  const auto one = [&](double most, int bad) {
    return static_cast<int>(random() % 100) < bad ? any_bits(random) : most * u(random);
  };
  for (int round = 0; round < 4000; ++round) {
    const int bad = round % 4 == 0 ? 100 : round % 4 == 1 ? 0 : 5;
    const bool bad_limits = round % 8 >= 6;
    GuardParams p;
    DeviceTraits d;
    for (double* const x : {&p.max_rate_n_per_s, &p.max_force_n, &p.max_damping_n_s_per_m, &p.contact_damping_n_s_per_m,
                            &p.resume_s, &p.stale_ms, &p.fade_ms, &d.damping_n_s_per_m, &d.delay_s, &d.encoder_mm,
                            &d.max_force_n, &d.max_stiffness_n_per_mm}) {
      if (bad_limits && random() % 3 == 0) *x = any_bits(random);
    }
    p.passivity = random() % 2 == 0;
    const auto strict = [](double limit) { return limit > 0 ? limit : 0; };
    const double most = std::min(strict(p.max_force_n), strict(d.max_force_n));
    const double stiffness =
        safe_stiffness_n_per_mm(d, p.contact_damping_n_s_per_m, bad_limits ? any_bits(random) : 1e-3);
    EXPECT_GE(stiffness, 0);
    Guard guard(p, d);
    Vec3 last{};
    for (int t = 0; t < 60; ++t) {
      Guard::Input in;
      for (std::size_t a = 0; a < 3; ++a) {
        in.position_mm[a] = one(50, bad);
        in.elastic_n[a] = one(10, bad);
        in.normal[a] = one(1, bad);
        in.effects_n[a] = one(1, bad);
      }
      if (random() % 2 == 0) in.normal = normalized(in.normal);
      in.age_ms = one(20, bad);
      in.jumped = random() % 10 == 0;
      const double dt = static_cast<int>(random() % 100) < bad ? any_bits(random) : 1e-3;
      const Vec3 f = guard.limit(in, dt).force_n;
      ASSERT_TRUE(std::isfinite(f.x) && std::isfinite(f.y) && std::isfinite(f.z)) << round << ' ' << t;
      ASSERT_LE(length(f), most * (1 + 1e-12) + 1e-150) << round << ' ' << t;
      const double step = std::isfinite(dt) && dt > 0 ? dt : 1e-3;
      if (p.max_rate_n_per_s != 0) {
        ASSERT_LE(length(f - last), strict(p.max_rate_n_per_s * step) * (1 + 1e-9) + 1e-12 * most) << round << ' ' << t;
      }
      ASSERT_TRUE(std::isfinite(guard.energy_mj()) && std::isfinite(length(guard.velocity_mm_s())))
          << round << ' ' << t;
      last = f;
    }
    // It has not lost itself: with plausible input the force comes.
    if (bad_limits) continue;
    for (int t = 0; t < 300; ++t) last = guard.limit({{0, 0, 1}, {0, 0, 2}, {0, 0, 1}, {}, 0, false}, 1e-3).force_n;
    ASSERT_NEAR(last.z, 2, 1e-9) << round;
  }
}

TEST(Guard, ANormalThatIsNoNumberLeavesTheForce) {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    Guard guard({}, {}), without({}, {});
    for (int t = 0; t < 5; ++t) {
      const Vec3 f = guard.limit({{0, 0, 1 - 0.01 * t}, {0, 0, 2}, {bad, 0, 1}, {}, 0, false}, 1e-3).force_n;
      EXPECT_EQ(f, without.limit({{0, 0, 1 - 0.01 * t}, {0, 0, 2}, {}, {}, 0, false}, 1e-3).force_n);
      EXPECT_GT(f.z, 1.9);
    }
  }
}

// The bytes of a report may be anything: every number of every record stays finite, and force and rate within their
// limits.
TEST(Fuzz, AnyBytesFromADeviceGiveFiniteRecords) {
  const auto number = [](const TickRecord& r) {
    double sum = static_cast<double>(r.normal_force_n) + static_cast<double>(r.depth_mm) +
                 static_cast<double>(r.removed_mm3) + static_cast<double>(r.energy_mj) +
                 static_cast<double>(r.thickness_mm) + static_cast<double>(r.clearance_mm);
    for (std::size_t a = 0; a < 3; ++a)
      sum += static_cast<double>(r.force_n[a]) + static_cast<double>(r.torque_n_mm[a]) +
             static_cast<double>(r.shown_offset_mm[a]);
    return sum;
  };
  for (const ContactMethod method : kMethods) {
    auto bone =
        test::solid(0.5, 8, [](Vec3 p) { return std::sin(p.x) + std::sin(1.3 * p.y) + std::sin(0.9 * p.z) < 0.2; });
    const HapticSetup setup = setup_for(method);
    HapticRenderer renderer(setup, bone, {}, 1e-3);
    Vec3 last{};
    std::mt19937_64 random(13);
    std::uniform_real_distribution<float> u(-8, 8);
    for (int t = 0; t < 1500; ++t) {
      DeviceSample s;
      std::array<std::uint64_t, 4> bits{random(), random(), random(), random()};
      std::memcpy(static_cast<void*>(&s), bits.data(), sizeof s);
      // Half the time in or near the bone, with one part of it broken or none.
      if (random() % 2 == 0) s.position_mm = {u(random), u(random), u(random)};
      if (random() % 4 == 0) s.position_mm[random() % 3] = std::bit_cast<float>(static_cast<std::uint32_t>(random()));
      if (random() % 2 == 0) s.age_ms = 0;
      if (random() % 50 == 0) {
        SceneAction push;
        for (double& v : push.values) v = random() % 4 == 0 ? any_bits(random) : static_cast<double>(u(random));
        renderer.push(push);
      }
      const auto [record, changes] = renderer.step(s);
      const Vec3 f = from_floats(record.force_n);
      ASSERT_TRUE(std::isfinite(number(record))) << t;
      ASSERT_LE(length(f), 3.3 * (1 + 1e-6)) << t;
      ASSERT_LE(length(f - last), setup.params.guard.max_rate_n_per_s * 1e-3 * (1 + 1e-5)) << t;
      last = f;
    }
    for (VoxelKey v = 0; v < bone.brick_count() * BrickGrid::kVoxels; ++v)
      ASSERT_TRUE(bone.value(v) >= 0 && bone.value(v) <= 1);
  }
}

TEST(Renderer, ARateThatIsNoNumberIsRefused) {
  auto bone = test::slab(1);
  for (const double dt :
       {0.0, -1e-3, 2.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
    EXPECT_THROW(HapticRenderer(setup_for(ContactMethod::overlap), bone, {}, dt), Error) << dt;
}

TEST(SpringHand, AGoalOrForceThatIsNoNumberDoesNotLoseIt) {
  SpringHand hand;
  HandGoal goal;
  static_cast<void>(hand.step(goal, 1e-3, {}));
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    goal.position_mm = {bad, 0, 0};
    static_cast<void>(hand.step(goal, 1e-3, {}));
    goal.position_mm = {1, 0, 0};
    static_cast<void>(hand.step(goal, 1e-3, {0, bad, 0}));
    DeviceSample s;
    for (int t = 0; t < 500; ++t) s = hand.step(goal, 1e-3, {});
    EXPECT_NEAR(s.position_mm[0], 1, 1e-3);
  }
}

// Anything a device may say, for a hundred thousand ticks; osteo bench haptics does a hundred million.
TEST(Fuzz, NoForceIsEverOutOfBounds) {
  for (const ContactMethod method : kMethods) {
    auto bone =
        test::solid(0.5, 12, [](Vec3 p) { return std::sin(p.x) + std::sin(1.3 * p.y) + std::sin(0.9 * p.z) < 0.2; });
    auto setup = setup_for(method);
    setup.params.effects.spin_up_s = 0;  // each tick has another burr, which would never come up to speed
    Checked run(setup, bone);
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> u(-1, 1);
    Vec3 x{0, 0, 10};
    for (int t = 0; t < 12500; ++t) {
      const auto dice = random() % 1000;
      if (dice < 5) x = Vec3{u(random), u(random), u(random)} * 20;
      x += Vec3{u(random), u(random), u(random)} * (dice < 50 ? 3 : 0.3);
      if (length(x) > 25) x = x * 0.5;
      auto s = at(x.x, x.y, x.z);
      const Vec3 axis = normalized({u(random), u(random), u(random)});
      s.axis = {static_cast<float>(axis.x), static_cast<float>(axis.y), static_cast<float>(axis.z)};
      s.pedal = random() % 3 != 0 ? static_cast<std::uint8_t>(random()) : 0;
      s.tool = static_cast<std::uint8_t>(random() % 50);
      s.age_ms = dice > 990 ? static_cast<std::uint8_t>(random()) : 0;
      if (dice == 500) s.position_mm[random() % 3] = std::numeric_limits<float>::quiet_NaN();
      if (dice == 501) s.axis[random() % 3] = std::numeric_limits<float>::infinity();
      if (dice == 502) s.position_mm[random() % 3] = 1e30F;
      if (dice == 503) s.axis = {};
      static_cast<void>(run.step(s));
    }
    EXPECT_GT(run.removed, 1);
  }
}

}  // namespace
}  // namespace osteo
