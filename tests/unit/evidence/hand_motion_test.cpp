// Hands at rest and on their way as devices tell them: ideal, trembling, and in an encoder's steps.
#include "osteo/assessment/evidence/detail/hand_motion.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <functional>
#include <numbers>
#include <random>

#include "osteo/assessment/evidence/timeline.h"
#include "osteo/simulation/bone/instrument.h"
#include "osteo/simulation/haptics/renderer.h"
#include "osteo/simulation/haptics/simulated_device.h"
#include "scene.h"
#include "solid.h"

namespace osteo {
namespace {

constexpr double kHz = 1000;

// How a device tells of a place at a time.
struct Telling {
  std::string name;
  std::function<Vec3(Vec3, double)> reported;
};
std::vector<Telling> tellings() {
  std::vector<Telling> all{{"ideal", [](Vec3 at, double) { return at; }}};
  all.push_back({"trembling 0.03 mm RMS, white", [engine = std::mt19937(1)](Vec3 at, double) mutable {
                   std::normal_distribution<double> normal(0, 0.03);
                   return at + Vec3{normal(engine), normal(engine), normal(engine)};
                 }});
  for (const double mm : {0.03, 0.3})
    all.push_back({"tremor of 9 Hz, " + std::to_string(mm) + " mm RMS", [mm](Vec3 at, double s) {
                     const double phase = 2 * std::numbers::pi * 9 * s, a = mm * std::numbers::sqrt2;
                     return at + Vec3{std::sin(phase), std::sin(phase + 2), std::sin(phase + 4)} * a;
                   }});
  // On the edge between two steps, where a little noise goes to and fro.
  for (const double step : {0.01, 0.04})
    all.push_back(
        {"encoder of " + std::to_string(step) + " mm", [step, engine = std::mt19937(2)](Vec3 at, double) mutable {
           std::normal_distribution<double> normal(0, 0.3 * step);
           const auto whole = [&](double v) { return step * std::floor((v + normal(engine)) / step); };
           return Vec3{whole(at.x), whole(at.y), whole(at.z)};
         }});
  return all;
}
TickRecord tick_at(std::uint64_t n, Vec3 at, std::uint32_t hand = 0) {
  TickRecord t;
  t.tick = n;
  t.hand = hand;
  for (std::size_t a = 0; a < 3; ++a) t.device.position_mm[a] = static_cast<float>(at[a]);
  t.device.tool = static_cast<std::uint8_t>(instrument_index("cutting 2 mm"));
  return t;
}
double idle_s(const IdleClock& clock) {
  return static_cast<double>(clock.idle_ticks()) / kHz;
}

TEST(IdleClock, TenSecondsAtRestAreTenHoweverTheDeviceTells) {
  for (Telling& d : tellings()) {
    // All of it; and between two ways at 20 mm/s of a second each.
    IdleClock whole(kHz), between(kHz);
    for (std::uint64_t n = 0; n < 10'000; ++n)
      whole.add(tick_at(n, d.reported({1, 2, 3}, static_cast<double>(n) / kHz)));
    for (std::uint64_t n = 0; n < 12'000; ++n) {
      const double s = static_cast<double>(n) / kHz;
      between.add(tick_at(n, d.reported({20 * (std::min(s, 1.0) + std::max(s - 11, 0.0)), 2, 3}, s)));
    }
    if (std::getenv("OSTEO_PRINT") != nullptr)
      std::printf("%-32s %.3f %.3f s\n", d.name.c_str(), idle_s(whole), idle_s(between));
    EXPECT_NEAR(idle_s(whole), 10, 0.2) << d.name;
    EXPECT_NEAR(idle_s(between), 10, 0.2) << d.name;
  }
}

// An encoder of 0.03 mm on a device without friction keeps a burr that rests in its own pit trembling, at up to 14 mm/s
// (docs/validation/haptics.md). A hand that does nothing but rest there is idle, and has no speed near a structure.
TEST(IdleClock, AHandThatAnEncoderShakesInAPitIsAtRest) {
  constexpr std::uint64_t kSettledTick = 1000, kTicks = 4000;
  const SimulatedDeviceParams stepped{.damping_n_s_per_m = 1, .encoder_mm = 0.03};
  for (const ContactMethod method :
       {ContactMethod::overlap, ContactMethod::proxy, ContactMethod::volume, ContactMethod::rays}) {
    for (const double radius_mm : {2.0, 2.2, 2.5}) {
      auto bone = test::solid(
          0.5, 6,
          [&](Vec3 p) {
            return p.z < 1 && length(p - Vec3{0.03, 0.02, 1}) > radius_mm;
          },
          {}, 3);
      SimulatedDevice device(stepped, {0.03, 0.02, 2});
      device.set_hand({}, {0.03, 0.02, -2}, 0.3);
      device.set_drill(false, 3);
      HapticSetup setup;
      setup.params.contact.method = method;
      setup.params.effects.vibration = false;
      setup.device = device.traits();
      HapticRenderer renderer(setup, bone, {}, 1e-3);
      IdleClock clock(kHz);
      HandMotion motion(kHz);
      Vec3 force;
      double device_mm_s = 0, told_mm_s = 0;
      for (std::uint64_t t = 0; t < kTicks; ++t) {
        TickRecord r = renderer.step(device.read(t, 1e-3, force)).record;
        force = from_floats(r.force_n);
        r.tick = t;
        motion.add(t, from_floats(r.device.position_mm));
        if (t < kSettledTick) continue;
        clock.add(r);
        device_mm_s = std::max(device_mm_s, length(device.velocity_mm_s()));
        if (const auto speed = motion.speed_mm_s()) told_mm_s = std::max(told_mm_s, *speed);
      }
      if (std::getenv("OSTEO_PRINT") != nullptr)
        std::printf("method %d, pit of %.1f mm: device up to %.1f mm/s, told %.2f mm/s, idle %.3f s\n",
                    static_cast<int>(method), radius_mm, device_mm_s, told_mm_s, idle_s(clock));
      EXPECT_NEAR(idle_s(clock), static_cast<double>(kTicks - kSettledTick) / kHz, 0.02);
      EXPECT_LT(told_mm_s, 1.5);
    }
  }
}

TEST(IdleClock, AHandOnItsWayIsNotIdleHoweverTheDeviceTells) {
  for (Telling& d : tellings()) {
    IdleClock slow(kHz);
    for (std::uint64_t n = 0; n < 5000; ++n)
      slow.add(tick_at(n, d.reported({0.004 * static_cast<double>(n), 0, 0}, static_cast<double>(n) / kHz)));
    EXPECT_EQ(idle_s(slow), 0) << d.name;
  }
}

TEST(IdleClock, EitherHandOrAPedalEndsIt) {
  // 10 s; from 4 to 6 s a hand goes to and fro or has its pedal down.
  for (const std::uint32_t busy : {0U, 1U}) {
    for (const bool pedal : {false, true}) {
      IdleClock clock(kHz);
      for (std::uint64_t n = 0; n < 10'000; ++n) {
        const bool now = n >= 4000 && n < 6000;
        for (std::uint32_t hand = 0; hand < 2; ++hand) {
          TickRecord t = tick_at(
              n, {now && !pedal && hand == busy ? 5 * std::sin(0.02 * static_cast<double>(n - 4000)) : 0, 0, 0}, hand);
          t.device.pedal = now && pedal && hand == busy ? 255 : 0;
          clock.add(t);
        }
      }
      EXPECT_NEAR(idle_s(clock), 8, 0.1) << busy << pedal;
    }
  }
}

TEST(IdleClock, LessThanASecondAndWhatIsNotRecordedAreNot) {
  IdleClock clock(kHz);
  for (std::uint64_t n = 0; n < 900; ++n) clock.add(tick_at(n, {}));
  for (std::uint64_t n = 5000; n < 6500; ++n) clock.add(tick_at(n, {}));
  EXPECT_NEAR(idle_s(clock), 1.5, 1e-9);
  EXPECT_EQ(IdleClock(kHz).idle_ticks(), 0U);
}

TEST(HandMotion, SpeedIsTheHandsHoweverTheDeviceTells) {
  for (Telling& d : tellings()) {
    if (d.name.starts_with("tremor")) continue;  // that is a speed of its own
    HandMotion motion(kHz);
    double most_off = 0;
    for (std::uint64_t n = 0; n < 2000; ++n) {
      const double s = static_cast<double>(n) / kHz;
      motion.add(n, d.reported({10 * s, 0, 0}, s));
      if (const auto speed = motion.speed_mm_s()) most_off = std::max(most_off, std::abs(*speed - 10));
    }
    if (std::getenv("OSTEO_PRINT") != nullptr) std::printf("%-32s %.3f mm/s\n", d.name.c_str(), most_off);
    EXPECT_LT(most_off, 1.5) << d.name;
  }
}

TEST(HandMotion, IsThatOfAWindowAgoAndBeginsAnewBehindAGap) {
  HandMotion motion(kHz);
  std::optional<double> at_half;
  for (std::uint64_t n = 0; n < 300; ++n) {
    motion.add(n, {0.0001 * static_cast<double>(n * n), 0, 0});  // 0.2 mm/s more each tick
    if (n < 49) {
      EXPECT_FALSE(motion.speed_mm_s());
    } else if (motion.speed_tick() == 150) {
      at_half = motion.speed_mm_s();
    }
  }
  ASSERT_TRUE(at_half);
  EXPECT_NEAR(*at_half, 0.2 * 150, 0.2);
  motion.add(301, {});
  EXPECT_FALSE(motion.speed_mm_s());
  EXPECT_FALSE(motion.place_mm());
}

// Through the metrics: path, speed near a structure and speed over time, of a hand at 10 mm/s and of one at rest.
TEST(HandMotion, PathAndSpeedsOfMetricsAreTheHands) {
  const World world = test::solid_world([](Vec3 p) { return 4 - length(p); }, 1, 16);
  const StructureMap ball =
      test::structure_map([](Vec3 p) -> std::uint8_t { return length(p) < 2 ? 1 : 0; }, {{1, "ball", {}}}, 0.5, 16);
  for (Telling& d : tellings()) {
    if (d.name.starts_with("tremor")) continue;
    const EvidenceScene scene{kHz, &ball, nullptr};
    ProcessMetric process(scene);
    NearMetric near(scene);
    TimelineKeeper keeper(scene);
    for (std::uint64_t from = 0; from < 4000; from += 100) {
      std::vector<TickRecord> ticks;
      for (std::uint64_t n = from; n < from + 100; ++n) {
        const double s = static_cast<double>(n) / kHz;
        TickRecord t = tick_at(n, d.reported({-5 + 10 * std::clamp(s - 1, 0.0, 1.0), 0, 5}, s));
        t.speed_rpm = 20'000;
        t.normal_force_n = 0.5F;
        ticks.push_back(t);
      }
      const EvidenceFrame f{kHz, {}, ticks, {}, {}, world, nullptr, 0};
      process.frame(f);
      near.frame(f);
      keeper.frame(f);
    }
    std::vector<Measured> values;
    std::vector<Moment> moments;
    process.finish(world, values, moments);
    for (const Measured& m : values) {
      if (m.is("path_mm")) {
        EXPECT_NEAR(*m.value, 10, 0.5) << d.name;
      }
    }
    double most_off = 0;
    std::size_t known = 0;
    for (const NearMetric::Sample& s : near.samples().at(1)) {
      if (std::isnan(s.speed_mm_s)) continue;
      ++known;
      if (std::abs(s.t_s - 1) < 0.05 || std::abs(s.t_s - 2) < 0.05) continue;
      most_off = std::max(most_off, std::abs(static_cast<double>(s.speed_mm_s) - (s.t_s > 1 && s.t_s < 2 ? 10 : 0)));
    }
    EXPECT_LT(most_off, 2) << d.name;
    EXPECT_GE(known, near.samples().at(1).size() - 6) << d.name;
    const Timeline line = keeper.timeline({});
    for (std::size_t n = 0; n < line.size(); ++n) {
      if (n % 10 == 0 || n % 10 == 9) continue;
      EXPECT_NEAR(static_cast<double>(line.speed_mm_s[n]), n > 10 && n < 20 ? 10 : 0, 1.2) << d.name << " " << n;
    }
  }
}

// Two hands at one structure: each has its own contacts; time counts once.
TEST(NearMetric, TwoHandsAtOneStructureHaveTheirOwnContacts) {
  const World world = test::solid_world([](Vec3 p) { return 4 - length(p); }, 1, 16);
  const StructureMap ball =
      test::structure_map([](Vec3 p) -> std::uint8_t { return length(p) < 2 ? 1 : 0; }, {{1, "ball", {}}}, 0.5, 16);
  const EvidenceScene scene{kHz, &ball, nullptr};
  for (const bool turns : {false, true}) {
    NearMetric near(scene);
    TimelineKeeper keeper(scene);
    std::vector<TickRecord> ticks;
    // The first from 0.1 to 0.5 s, the second from 0.3 to 0.7 s, and again from 0.9 s on.
    for (std::uint64_t n = 0; n < 1000; ++n) {
      for (std::uint32_t hand = 0; hand < 2; ++hand) {
        const bool in = hand == 0 ? n >= 100 && n < 500 : (n >= 300 && n < 700) || n >= 900;
        ticks.push_back(tick_at(n, in ? Vec3{0, 0, 2.4} : Vec3{0, 0, 6}, hand));
        ticks.back().speed_rpm = turns ? 20'000 : 0;
      }
    }
    const EvidenceFrame f{kHz, {}, ticks, {}, {}, world, nullptr, 0};
    near.frame(f);
    keeper.frame(f);
    std::vector<Measured> values;
    std::vector<Moment> moments;
    near.finish(world, values, moments);
    for (const Measured& m : values) {
      if (m.is("touches")) {
        EXPECT_EQ(*m.value, 3);
      }
      if (m.is("touched_s")) {
        EXPECT_NEAR(*m.value, 0.7, 1e-9);
      }
      if (m.is("injured_s")) {
        EXPECT_NEAR(*m.value, turns ? 0.7 : 0, 1e-9);
      }
    }
    EXPECT_EQ(moments.size(), turns ? 3U : 0U);
    std::vector<double> begins_s;
    for (const TimelineEvent& e : keeper.timeline({}).events) {
      if (e.kind == (turns ? EventKind::injury : EventKind::touch)) begins_s.push_back(e.t_s);
    }
    EXPECT_EQ(begins_s, (std::vector<double>{0.1, 0.3, 0.9}));
  }
}

TEST(NearMetric, AnyHandThatBeginsInsideAStructureIsTold) {
  const World world = test::solid_world([](Vec3 p) { return 4 - length(p); }, 1, 16);
  const StructureMap ball =
      test::structure_map([](Vec3 p) -> std::uint8_t { return length(p) < 2 ? 1 : 0; }, {{1, "ball", {}}}, 0.5, 16);
  for (const std::uint32_t inside : {0U, 1U, 2U}) {
    NearMetric near({kHz, &ball, nullptr});
    const std::vector<TickRecord> ticks{tick_at(0, {0, 0, inside == 0 ? 1.0 : 9}, 0),
                                        tick_at(0, {0, 0, inside == 1 ? 1.0 : 9}, 1), tick_at(1, {0, 0, 1}, 0)};
    near.frame({kHz, {}, ticks, {}, {}, world, nullptr, 0});
    std::vector<Measured> values;
    std::vector<Moment> moments;
    near.finish(world, values, moments);
    EXPECT_EQ(moments.size(), inside < 2 ? 1U : 0U);
  }
}

// Of each of two hands a press above the limit is told, though they come within a second of each other.
TEST(NearMetric, EachHandsPressAboveALimitIsTold) {
  const World world = test::solid_world([](Vec3 p) { return 4 - length(p); }, 1, 16);
  const StructureMap ball =
      test::structure_map([](Vec3 p) -> std::uint8_t { return length(p) < 2 ? 1 : 0; }, {{1, "ball", {}}}, 0.5, 16);
  const Procedure procedure = parse_procedure(
      R"({"osteotome_procedure": 1, "name": "t", "structures": [{"name": "ball", "role": "keep"}],
 "force_limits": [{"structure": "ball", "within_mm": 2, "most_n": 1}]})",
      "t.json");
  NearMetric near({kHz, &ball, &procedure});
  std::vector<TickRecord> ticks;
  for (std::uint64_t n = 0; n < 3000; ++n) {
    for (std::uint32_t hand = 0; hand < 2; ++hand) {
      ticks.push_back(tick_at(n, {0, 0, hand == 0 ? 4.0 : -4.0}, hand));
      ticks.back().speed_rpm = 20'000;
      // The first for a second, the second half a second later for a second; the first again at the end.
      const bool hard = hand == 0 ? n < 1000 || n >= 2500 : n >= 500 && n < 1500;
      ticks.back().normal_force_n = hard ? 2 : 0.5F;
    }
  }
  near.frame({kHz, {}, ticks, {}, {}, world, nullptr, 0});
  std::vector<Measured> values;
  std::vector<Moment> moments;
  near.finish(world, values, moments);
  std::vector<double> reported_s;
  for (const Moment& m : moments) reported_s.push_back(m.t_s);
  EXPECT_EQ(reported_s, (std::vector<double>{0, 0.5, 2.5}));
  for (const Measured& m : values) {
    if (m.is("excess_force_ns")) {
      EXPECT_NEAR(*m.value, 2.5, 1e-6);
    }
  }
}

}  // namespace
}  // namespace osteo
