// Several hands in one step, the burr's speed, instruments, settings that change while it runs.
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstring>
#include <set>

#include "osteo/core/base/error.h"
#include "osteo/simulation/haptics/servo.h"
#include "slab.h"

namespace osteo {
namespace {

int burr(BurrKind kind, double mm) {
  return burr_index(kind, mm);
}
DeviceSample at(Vec3 x, int tool, bool pedal, Vec3 axis = {0, 0, 1}) {
  DeviceSample s;
  s.position_mm = to_floats(x);
  s.axis = to_floats(axis);
  s.pedal = pedal ? 255 : 0;
  s.tool = static_cast<std::uint8_t>(tool);
  return s;
}

HapticSetup hands(std::size_t n) {
  HapticSetup s;
  s.device = SpringHand::traits();
  s.more_devices.assign(n - 1, SpringHand::traits());
  return s;
}

// All of a record but whose it is and the machine's times.
bool same(TickRecord a, TickRecord b) {
  a.hand = b.hand = 0;
  return std::memcmp(&a, &b, offsetof(TickRecord, work_us)) == 0;
}

// A hand feels the same whether others are there or not, as long as they leave the bone that it feels alone.
TEST(Hands, EachFeelsWhatItWouldFeelAlone) {
  const int tools[] = {burr(BurrKind::cutting, 4), instrument_index("sucker 8 Fr"), instrument_index("probe 1 mm"),
                       burr(BurrKind::diamond, 3)};
  for (const ContactMethod method :
       {ContactMethod::rays, ContactMethod::volume, ContactMethod::overlap, ContactMethod::proxy}) {
    HapticSetup setup = hands(4);
    setup.params.contact.method = method;
    const auto sample = [&](std::size_t h, int t) {
      const double way = t / 200.0;
      const Vec3 start{-10 + 7.0 * static_cast<double>(h), 3, 2.5};
      // Hand 0 drills; the others press elsewhere.
      return at(start + Vec3{std::sin(way), std::cos(way), -way}, tools[h], h == 0, normalized({0.3, 0, 1}));
    };
    auto bone = test::slab(0.5);
    HapticRenderer together(setup, bone, {}, 1e-3);
    std::vector<BrickGrid> bones;
    for (int h = 0; h < 4; ++h) bones.push_back(test::slab(0.5));
    std::vector<std::unique_ptr<HapticRenderer>> alone;
    HapticSetup one = hands(1);
    one.params.contact.method = method;
    for (std::size_t h = 0; h < 4; ++h)
      alone.push_back(std::make_unique<HapticRenderer>(one, bones[h], Anatomy{}, 1e-3));
    double felt[4] = {};
    for (int t = 0; t < 600; ++t) {
      std::array<DeviceSample, 4> samples;
      for (std::size_t h = 0; h < 4; ++h) samples[h] = sample(h, t);
      const auto step = together.step(samples);
      ASSERT_EQ(step.hands.size(), 4u);
      std::size_t changes = 0;
      for (std::size_t h = 0; h < 4; ++h) {
        const auto own = alone[h]->step(samples[h]);
        ASSERT_EQ(step.hands[h].hand, h);
        ASSERT_TRUE(same(step.hands[h], own.record)) << "hand " << h << " tick " << t;
        felt[h] = std::max(felt[h], static_cast<double>(step.hands[h].normal_force_n));
        changes += step.hands[h].voxels_changed;
      }
      ASSERT_EQ(step.changes.size(), changes);
    }
    for (const double f : felt) EXPECT_GT(f, 0.2);
    EXPECT_EQ(bone.hash(), bones[0].hash());
    EXPECT_LT(bone.sum(), test::slab(0.5).sum());
  }
}

// Two burrs at one place: bone goes once, the changes come in the order of the hands and the last one is what is left.
TEST(Hands, TwoBurrsShareTheBone) {
  auto bone = test::slab(0.5);
  const double before = bone.sum() * 0.125;
  HapticRenderer r(hands(2), bone, {}, 1e-3);
  double removed = 0;
  std::size_t by_hand[2] = {};
  for (int t = 0; t < 800; ++t) {
    const std::array<DeviceSample, 2> samples{at({-0.5, 0, 2 - t / 800.0}, burr(BurrKind::cutting, 4), true),
                                              at({0.5, 0, 2 - t / 800.0}, burr(BurrKind::cutting, 4), true)};
    const auto step = r.step(samples);
    for (const TickRecord& h : step.hands) {
      removed += static_cast<double>(h.removed_mm3);
      by_hand[h.hand] += h.voxels_changed;
    }
    for (std::size_t c = step.changes.size(); c-- > 0;) {
      bool later = false;
      for (std::size_t d = c + 1; d < step.changes.size(); ++d)
        later = later || step.changes[d].voxel == step.changes[c].voxel;
      if (!later) {
        ASSERT_EQ(bone.value(step.changes[c].voxel), step.changes[c].density);
      }
    }
  }
  EXPECT_GT(by_hand[0], 100u);
  EXPECT_GT(by_hand[1], 100u);
  EXPECT_NEAR(removed, before - bone.sum() * 0.125, 1e-3 * removed);
}

// Each hand is limited as its own device bears it.
TEST(Hands, EachHasItsOwnDevice) {
  auto bone = test::slab(0.5);
  HapticSetup setup = hands(2);
  setup.more_devices[0] = {.damping_n_s_per_m = 0.5, .delay_s = 5e-3, .encoder_mm = 0, .max_force_n = 0.3};
  HapticRenderer r(setup, bone, {}, 1e-3);
  EXPECT_EQ(r.stiffness_n_per_mm(0), setup.params.contact.stiffness_n_per_mm);
  EXPECT_LT(r.stiffness_n_per_mm(1), 0.5);
  TickRecord last[2];
  for (int t = 0; t < 200; ++t) {
    const auto step = r.step(std::array<DeviceSample, 2>{at({-6, 0, 1.2}, 3, false), at({6, 0, -0.5}, 3, false)});
    std::copy(step.hands.begin(), step.hands.end(), last);
  }
  EXPECT_GT(last[0].force_n[2], 1);
  EXPECT_NEAR(length(from_floats(last[1].force_n)), 0.3, 1e-3);
  EXPECT_NE(last[1].flags & kForceCapped, 0u);
  EXPECT_EQ(last[0].flags & kForceCapped, 0u);
}

TEST(Hands, AsManyAsThereAreDevices) {
  auto bone = test::slab(1);
  EXPECT_THROW(HapticRenderer(hands(kMaxHands + 1), bone, {}, 1e-3), Error);
  HapticRenderer r(hands(2), bone, {}, 1e-3);
  MouseDevice mouse{HandGoal{}};
  Stream stream;
  EXPECT_THROW(Servo(r, mouse, stream, 1000), Error);
}

// Goals come with the pictures: however far apart these are, the handle turns evenly.
TEST(MouseDevice, TurnsItsAxisEvenlyHoweverSeldomItIsTold) {
  constexpr double kRadPerS = 4;
  const auto turned_rad = [](Vec3 a, Vec3 b) { return std::acos(std::clamp(dot(a, b), -1.0, 1.0)); };
  for (const Vec3 to : {Vec3{1, 0, 0}, Vec3{0, 0, -1}}) {
    MouseDevice mouse{HandGoal{}};
    Vec3 before = from_floats(mouse.read(0, 1e-3, {}).axis);
    mouse.set_goal({.position_mm = {}, .axis = to_floats(to)});
    for (std::uint64_t t = 1; t <= 300; ++t) {
      const Vec3 axis = from_floats(mouse.read(t, 1e-3, {1, 0, 0}).axis);
      ASSERT_LT(turned_rad(axis, before), kRadPerS * 1e-3 + 0.0005) << t;  // a float's last bits turn it by as much
      ASSERT_NEAR(length(axis), 1, 1e-6);
      before = axis;
    }
    EXPECT_NEAR(turned_rad(before, {0, 0, 1}), kRadPerS * 0.3, 0.002);
    for (std::uint64_t t = 301; t <= 1000; ++t) before = from_floats(mouse.read(t, 1e-3, {}).axis);
    EXPECT_LT(length(before - to), 1e-6);
  }
}

// The speed against the closed form of a first-order lag, up, half up and down.
TEST(Speed, FollowsThePedal) {
  auto bone = test::slab(1);
  HapticSetup setup = hands(1);
  setup.params.effects.spin_up_s = 0.08;
  setup.params.effects.spin_down_s = 0.2;
  const double full = setup.params.effects.speed_rpm;
  HapticRenderer r(setup, bone, {}, 1e-3);
  DeviceSample s = at({0, 0, 30}, 3, true);
  double speed = 0;
  for (int t = 1; t <= 300; ++t) {
    speed = r.step(s).record.speed_rpm;
    ASSERT_NEAR(speed, full * (1 - std::exp(-t * 1e-3 / 0.08)), 1);
  }
  s.pedal = 102;  // two fifths
  const double from = speed, to = 0.4 * full;
  for (int t = 1; t <= 300; ++t) {
    speed = r.step(s).record.speed_rpm;
    ASSERT_NEAR(speed, to + (from - to) * std::exp(-t * 1e-3 / 0.2), 1);
  }
  s.pedal = 0;
  double still_at = 0;
  for (int t = 1; t <= 2000 && speed > 0; ++t, still_at = t * 1e-3) speed = r.step(s).record.speed_rpm;
  EXPECT_NEAR(still_at, 0.2 * std::log((to + (from - to) * std::exp(-1.5)) / 60),
              0.002);  // within 60 rpm of rest it rests
  // Another burr begins at rest; what is no burr never turns.
  s.pedal = 255;
  for (int t = 0; t < 1000; ++t) static_cast<void>(r.step(s));
  s.tool = 5;
  EXPECT_LT(r.step(s).record.speed_rpm, 0.02 * full);
  s.tool = static_cast<std::uint8_t>(instrument_index("sucker 8 Fr"));
  for (int t = 0; t < 100; ++t) EXPECT_EQ(r.step(s).record.speed_rpm, 0);
}

// Removal is in proportion to the real speed, so what is lost while it spins up comes back while it spins down.
TEST(Speed, RemovalGoesByIt) {
  const auto removed = [](double up, double down, int from, int to) {
    auto bone = test::slab(0.5);
    HapticSetup setup = hands(1);
    setup.params.effects.spin_up_s = up;
    setup.params.effects.spin_down_s = down;
    HapticRenderer r(setup, bone, {}, 1e-3);
    double sum = 0;
    for (int t = 0; t < to; ++t) {
      const auto record = r.step(at({0, 0, 1.0 - 0.001 * t}, 5, t < 400)).record;
      if (t >= from) sum += static_cast<double>(record.removed_mm3);
    }
    return sum;
  };
  const double at_once = removed(0, 0, 0, 100), slowly = removed(0.05, 0.05, 0, 100);
  EXPECT_LT(slowly, 0.85 * at_once);
  EXPECT_GT(slowly, 0.3 * at_once);
  EXPECT_EQ(removed(0, 0, 400, 900), 0);
  EXPECT_GT(removed(0.05, 0.05, 400, 500), 0);
  EXPECT_EQ(removed(0.05, 0.05, 800, 900), 0);
}

TEST(Instruments, EveryOneHasItsNameShapeAndUse) {
  const auto& all = instrument_library();
  ASSERT_GT(all.size(), burr_library().size());
  ASSERT_LE(all.size(), 255u);
  std::set<std::string> names;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Instrument& x = all[i];
    EXPECT_TRUE(names.insert(x.name).second) << x.name;
    EXPECT_EQ(instrument_index(x.name), static_cast<int>(i));
    EXPECT_EQ(x.kind == InstrumentKind::burr, x.as_burr() != nullptr);
    if (x.as_burr() != nullptr) {
      EXPECT_EQ(x.name, burr_library()[i].name()) << "burrs keep their numbers";
      EXPECT_EQ(x.head.volume_mm3(), burr_library()[i].head().volume_mm3());
    }
    const bool works = x.kind == InstrumentKind::sucker || x.kind == InstrumentKind::irrigator;
    EXPECT_EQ(works, x.rate > 0 && x.reach_mm > 0) << x.name;
    EXPECT_GT(x.shaft.length_mm, 20);
    // A saw's chuck does not follow into its cut.
    EXPECT_EQ(x.shaft.largest_radius_mm() <= x.head.largest_radius_mm(), x.kind != InstrumentKind::saw) << x.name;
    EXPECT_GT(head_cut_depth(i)(0.1 * x.head.volume_mm3(), 1), 0);
    EXPECT_GT(shaft_cut_depth(i)(0.1 * x.shaft.volume_mm3(), 0), 0);
  }
  EXPECT_NEAR(2 * all[static_cast<std::size_t>(instrument_index("sucker 12 Fr"))].head.start_radius_mm, 4, 1e-9);
  EXPECT_THROW(static_cast<void>(instrument_index("sucker 99 Fr")), Error);
}

// All are felt, by their head and their shaft; only what has an edge takes bone away, and only that shakes the hand.
TEST(Instruments, AllAreFeltAndOnlyWhatCutsRemoves) {
  for (std::size_t tool = 0; tool < instrument_library().size(); ++tool) {
    const Instrument& x = instrument_library()[tool];
    auto bone = test::slab(0.5);
    const double before = bone.sum();
    HapticRenderer r(hands(1), bone, {}, 1e-3);
    const double z = x.head.start_radius_mm - 0.3;
    TickRecord record;
    double shaken = 0, last = 0;
    for (int t = 0; t < 300; ++t) {
      record = r.step(at({0, 0, z}, static_cast<int>(tool), true)).record;
      if (t > 100) shaken = std::max(shaken, static_cast<double>(std::hypot(record.force_n[0], record.force_n[1])));
      last = std::max(last, static_cast<double>(record.force_n[2]));
    }
    EXPECT_GT(last, 0.2) << x.name;
    EXPECT_EQ(bone.sum() < before, x.cutter() != nullptr) << x.name;
    EXPECT_EQ(shaken > 0.005, x.cutter() != nullptr) << x.name << " " << shaken;
    HapticRenderer side(hands(1), bone, {}, 1e-3);
    for (int t = 0; t < 20; ++t)
      record = side.step(at({-24, 0, x.shaft.start_radius_mm - 0.3}, static_cast<int>(tool), false, {1, 0, 0})).record;
    EXPECT_NE(record.flags & kShaftContact, 0u) << x.name;
  }
}

TEST(Settings, NumbersNamesAndValuesAgree) {
  const HapticsParams usual;
  HapticsParams p;
  ASSERT_FALSE(setting_names().empty());
  for (std::size_t n = 0; n < setting_names().size(); ++n) {
    const int number = static_cast<int>(n);
    EXPECT_EQ(setting_number(setting_names()[n]), number);
    EXPECT_NO_THROW(change_setting(p, static_cast<std::uint32_t>(n), setting_value(number, usual)))
        << setting_names()[n];
    EXPECT_EQ(setting_value(number, p), setting_value(number, usual));
  }
  EXPECT_EQ(setting_number("stiffnes"), -1);
  const auto number = [](const char* name) { return static_cast<std::uint32_t>(setting_number(name)); };
  change_setting(p, number("stiffness_n_per_mm"), 1.5);
  EXPECT_EQ(p.contact.stiffness_n_per_mm, 1.5);
  change_setting(p, number("method"), setting_value(setting_number("method"), "proxy"));
  EXPECT_EQ(p.contact.method, ContactMethod::proxy);
  change_setting(p, number("vibration"), 0);
  EXPECT_FALSE(p.effects.vibration);
  const HapticsParams before = p;
  for (const auto& [name, bad] : {std::pair{"stiffness_n_per_mm", -1.0},
                                  {"stiffness_n_per_mm", 1e9},
                                  {"stiffness_n_per_mm", NAN},
                                  {"method", 4.0},
                                  {"method", 0.5},
                                  {"vibration", 0.5},
                                  {"vibration", 2.0}})
    EXPECT_THROW(change_setting(p, number(name), bad), Error) << name << " " << bad;
  EXPECT_THROW(change_setting(p, static_cast<std::uint32_t>(setting_names().size()), 0), Error);
  EXPECT_EQ(p.contact.stiffness_n_per_mm, before.contact.stiffness_n_per_mm);
}

// From the step on for which it is set, no sooner; and no stiffer than the device bears.
TEST(Settings, TakeEffectWithTheNextStep) {
  auto bone = test::slab(0.5), other = test::slab(0.5);
  HapticSetup setup = hands(1);
  setup.params.contact.stiffness_n_per_mm = 2;
  setup.params.guard.max_rate_n_per_s = 0;
  HapticRenderer changed(setup, bone, {}, 1e-3), kept(setup, other, {}, 1e-3);
  HapticsParams p = setup.params;
  for (int t = 0; t < 200; ++t) {
    if (t == 100) {
      p.contact.stiffness_n_per_mm = 1;
      changed.set(p);
    }
    const auto s = at({0, 0, 1.5}, 3, false);
    const double a = changed.step(s).record.force_n[2], b = kept.step(s).record.force_n[2];
    if (t < 100) {
      ASSERT_EQ(a, b) << t;
    } else {
      ASSERT_LT(a, 0.7 * b) << t;
    }
  }
  p.contact.stiffness_n_per_mm = 100;
  changed.set(p);
  EXPECT_LT(changed.stiffness_n_per_mm(), 100);
  EXPECT_GT(changed.stiffness_n_per_mm(), 2);
}

}  // namespace
}  // namespace osteo
