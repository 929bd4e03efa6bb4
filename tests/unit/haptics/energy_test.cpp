// Energy on closed ways: what a hand gets back is no more than what it has put in.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "osteo/simulation/haptics/renderer.h"
#include "osteo/simulation/haptics/simulated_device.h"
#include "solid.h"

namespace osteo {
namespace {

struct Way {
  const char* name;
  bool (*inside)(Vec3);
  std::vector<Vec3> points;  ///< press, slide, release; the way home is above the bone
};
// A ball of 4 mm; faces off the voxels' borders. Each in the direction in which its law gives the most, by measurement.
const Way kWays[] = {
    {"plane",
     [](Vec3 p) { return p.z < 0.07; },
     {{-1.5, 0.2, 2.6}, {-1.5, 0.2, 1.3}, {1.5, 0.5, 1.3}, {1.5, 0.5, 2.6}}},
    {"edge",
     [](Vec3 p) { return p.z < 0.07 && p.x < 0.03; },
     {{-1.2, 0.2, 2.6}, {-1.2, 0.2, 1.2}, {2.5, 0.2, 1.2}, {2.5, 0.2, 2.6}}},
    {"corner",
     [](Vec3 p) { return p.z < 0.07 && p.x < 0.03 && p.y < 0.1; },
     {{-1.2, -1.2, 2.6}, {-1.2, -1.2, 1.2}, {1.5, 1.2, 1.2}, {1.5, 1.2, 2.6}}},
    {"groove",
     [](Vec3 p) { return p.z < std::abs(p.x - 0.03); },
     {{0.03, 0.2, 4.3}, {0.03, 0.2, 2.4}, {-1, 0.2, 2.6}, {-1, 0.2, 4.3}}},
    {"wall",
     [](Vec3 p) { return p.z < 0.07 && std::abs(p.x - 0.03) < 0.5; },
     {{0, 0.2, 2.6}, {0, 0.2, 1.2}, {2.6, 0.2, 1.2}, {2.6, 0.2, 2.6}}},
    {"bumps",
     [](Vec3 p) { return p.z < 0.4 * std::sin(2 * p.x) * std::sin(2 * p.y); },
     {{-1.5, 0.2, 2.8}, {-1.5, 0.2, 1.5}, {1.5, 0.6, 1.5}, {1.5, 0.6, 2.8}}},
    {"pit",
     [](Vec3 p) {
       return p.z < 1 && length(p - Vec3{0.03, 0.02, 1}) > 2.2;
     },
     {{0.5, 0.1, 1.6}, {0.5, 0.1, 0.5}, {-0.5, 0.1, 0.5}, {-0.5, 0.1, 1.6}}},
};

struct Cycled {
  double turned_mj = 0, law_mj = 0, given_mj = 0;  // what the law of force gave; all in all; what reached the hand
};

Cycled cycle(const Way& way, double h, int law, int cycles = 4) {
  auto bone = test::solid(h, 6, way.inside, {}, 3);
  HapticSetup setup;
  setup.params.contact.stiffness_n_per_mm = 2;
  setup.params.effects.shaft = false;
  setup.params.guard.law = law;
  setup.device.damping_n_s_per_m = 2;
  HapticRenderer renderer(setup, bone, {}, 1e-3);
  Cycled c;
  Vec3 at = way.points[0], force, raw;
  constexpr double kMmPerS = 3;
  for (int round = 0; round < cycles; ++round) {
    for (std::size_t i = 0; i < way.points.size(); ++i) {
      const bool home = i + 1 == way.points.size();
      const Vec3 from = way.points[i], to = way.points[home ? 0 : i + 1];
      const int ticks = home ? 60 : static_cast<int>(std::ceil(1000 * length(to - from) / kMmPerS));
      for (int t = 1; t <= ticks; ++t) {
        const double s = static_cast<double>(t) / ticks;
        DeviceSample sample;
        sample.position_mm =
            to_floats(from + (to - from) * s + Vec3{0, 0, home ? 5 * std::sin(std::numbers::pi * s) : 0});
        sample.tool = 3;
        const Vec3 now = from_floats(sample.position_mm), moved = now - at;
        c.law_mj += dot(raw, moved);
        c.turned_mj += std::max(0.0, dot(raw, moved));
        c.given_mj += dot(force, moved);
        at = now;
        force = from_floats(renderer.step(sample).record.force_n);
        raw = renderer.contact().force_n;
      }
    }
  }
  return c;
}

TEST(ClosedCycles, GiveNoMoreThanAHundredthOfWhatTheyTurnOver) {
  for (const double h : {0.3, 0.5}) {
    for (const Way& way : kWays) {
      const Cycled now = cycle(way, h, 2);
      EXPECT_GT(now.turned_mj, 1) << way.name << ' ' << h;
      EXPECT_LT(now.given_mj, 0.01 * now.turned_mj) << way.name << ' ' << h << ": the law gave " << now.law_mj;
    }
  }
  // What it is measured against: the law alone, and the guard that forgot.
  const Cycled before = cycle(kWays[1], 0.5, 1);
  EXPECT_GT(before.law_mj, 0.2 * before.turned_mj);
  EXPECT_GT(before.given_mj, 0.1 * before.turned_mj);
}

// Where nothing is gained, it is not felt: out of flat bone and out of the burr's own hollow.
TEST(ClosedCycles, TheWayOutIsNotDulled) {
  for (const Way& way : {kWays[0], kWays[6]}) {
    auto bone = test::solid(0.5, 6, way.inside, {}, 3);
    HapticSetup setup;
    setup.params.contact.stiffness_n_per_mm = 2;
    setup.params.effects.shaft = false;
    HapticRenderer renderer(setup, bone, {}, 1e-3);
    double applied = 0, by_law = 0;
    for (int t = 0; t < 700; ++t) {
      DeviceSample sample;
      const double depth = 0.8 * std::sin(std::numbers::pi * t / 700);
      sample.position_mm = to_floats(Vec3{0, 0, way.points[0].z - 0.45 - depth});
      sample.tool = 3;
      const Vec3 force = from_floats(renderer.step(sample).record.force_n);
      if (t < 360) continue;
      applied += length(force);
      by_law += length(renderer.contact().force_n);
    }
    EXPECT_GT(by_law, 50) << way.name;
    EXPECT_GT(applied, 0.97 * by_law) << way.name;
  }
}

// A stroke that takes bone away owes nothing: the hand feels what it felt with the guard that forgot.
TEST(ClosedCycles, ADrillingStrokeIsNotDulled) {
  std::vector<double> felt;
  for (const int law : {1, 2}) {
    auto bone = test::slab(0.5);
    HapticSetup setup;
    setup.params.effects.vibration = false;
    setup.params.effects.drag = 0;
    setup.params.guard.law = law;
    setup.device = SpringHand::traits();
    HapticRenderer renderer(setup, bone, {}, 1e-3);
    SpringHand hand;
    Vec3 force;
    double sum = 0;
    for (int t = 0; t < 1500; ++t) {
      HandGoal goal;
      // Strokes to and fro, lifted at the ends.
      const double s = t / 1000.0;
      goal.position_mm = {4 * std::sin(5 * s), 0, 2.3 - s + 1.5 * std::pow(std::sin(5 * s), 8)};
      goal.axis = {0.6F, 0, 0.8F};
      goal.pedal = 255;
      goal.tool = 3;
      force = from_floats(renderer.step(hand.step(goal, 1e-3, force)).record.force_n);
      sum += length(force);
    }
    felt.push_back(sum);
  }
  EXPECT_GT(felt[0], 200);
  EXPECT_NEAR(felt[1], felt[0], 0.01 * felt[0]);
}

// Drag goes round in a pit: a light device that yields was driven ever faster.
TEST(Drag, DoesNotDriveAHandThatYields) {
  for (const double encoder_mm : {0.0, 0.03}) {
    for (const double delay_s : {0.0, 2e-3}) {
      std::vector<double> most;
      for (const int law : {1, 2}) {
        auto bone = test::solid(
            0.5, 6,
            [](Vec3 p) {
              return p.z < 1 && length(p - Vec3{0, 0, 1}) > 2.6;
            },
            {}, 3);
        SimulatedDevice device({.mass_kg = 0.1, .damping_n_s_per_m = 1, .encoder_mm = encoder_mm, .delay_s = delay_s},
                               {0.9, 0, 0.6});
        device.set_hand({0, 0, -1});
        device.set_drill(true, 3);
        HapticSetup setup;
        setup.params.contact.stiffness_n_per_mm = 2;
        setup.params.effects.shaft = false;
        setup.params.effects.vibration = false;
        setup.params.guard.law = law;
        setup.device = device.traits();
        HapticRenderer renderer(setup, bone, {}, 1e-3);
        renderer.hold(true);
        Vec3 force;
        double most_mj = 0;
        for (std::uint64_t t = 0; t < 4000; ++t) {
          const TickRecord r = renderer.step(device.read(t, 1e-3, force)).record;
          force = from_floats(r.force_n);
          most_mj = std::max(most_mj, device.work_mj());
        }
        most.push_back(most_mj);
      }
      if (delay_s == 0) {
        EXPECT_GT(most[0], 20) << encoder_mm;
      }
      EXPECT_LT(most[1], 1) << encoder_mm << ' ' << delay_s;
    }
  }
}

// A hand that holds still or goes against it feels all of it.
TEST(Drag, IsFeltInFullByAHandThatHoldsStillOrGoesAgainstIt) {
  Guard guard({}, {});
  Guard::Input in{.position_mm = {0, 0, 0}, .elastic_n = {0, 0, 2}, .normal = {0, 0, 1}, .effects_n = {0.3, 0, 0}};
  in.drag_n = in.effects_n;
  in.stored_mj = 1;
  Vec3 force;
  for (int t = 0; t < 500; ++t) force = guard.limit(in, 1e-3).force_n;
  EXPECT_NEAR(force.x, 0.3, 1e-9);
  for (int t = 0; t < 500; ++t) {
    in.position_mm.x -= 0.02;
    force = guard.limit(in, 1e-3).force_n;
    ASSERT_NEAR(force.x, 0.3, 1e-9);
  }
  double given = 0;
  for (int t = 0; t < 500; ++t) {
    in.position_mm.x += 0.02;
    given += force.x * 0.02;
    force = guard.limit(in, 1e-3).force_n;
  }
  EXPECT_LT(given, 0.12);
  EXPECT_NEAR(force.x, 0, 0.02);
  EXPECT_NEAR(force.z, 2, 1e-9);
}

TEST(EnergyDebt, IsPaidOnTheWayOutOfTheNextContactsAndNotAtRest) {
  // A spring that is half as stiff again on the way out as on the way in.
  EnergyDebt debt;
  double given = 0, x = 0, force = 0, turned = 0;
  const auto move = [&](double to, double stiffness) {
    given += force * (to - x);
    turned += std::max(0.0, force * (to - x));
    const Vec3 elastic{to < 0 ? -stiffness * to : 0, 0, 0}, velocity{(to - x) / 1e-3, 0, 0};
    x = to;
    force = elastic.x * debt.update({x, 0, 0}, elastic, 0.5 * stiffness * x * std::min(x, 0.0), velocity, 1e-3, 0);
    debt.applied({force, 0, 0});
  };
  for (int round = 0; round < 10; ++round) {
    for (int t = 0; t <= 100; ++t) {
      move(-0.01 * t, 1);
      EXPECT_GE(force, -x * 0.999);  // in full on the way in
    }
    for (int t = 100; t >= -5; --t) move(-0.01 * t, 1.5);
    const double share = force;
    move(x, 1.5);
    EXPECT_EQ(force, share);
  }
  EXPECT_LT(given, 0.01 * turned);
  EXPECT_LE(debt.given_mj(), EnergyDebt::kMaxOwedMj);
}

TEST(ContactParams, TheEnergyIsTheAreaUnderTheLaw) {
  for (const double most : {8.0, 1.0, 0.1}) {
    ContactParams p;
    p.max_force_n = most;
    double sum = 0;
    for (int i = 0; i < 3000; ++i) {
      EXPECT_NEAR(p.energy_mj(i * 1e-3), sum, 1e-4) << i;
      sum += 0.5e-3 * (p.force_n(i * 1e-3) + p.force_n((i + 1) * 1e-3));
    }
  }
}

}  // namespace
}  // namespace osteo
