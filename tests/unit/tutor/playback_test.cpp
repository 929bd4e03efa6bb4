// A recorded hand leads another: how near it stays, that bone is the recorded one, that the guided session replays to
// the bit.
#include "osteo/network/tutor/playback.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "bar.h"
#include "firm_hand.h"
#include "osteo/core/base/error.h"
#include "osteo/session/scene/rehearsal.h"
#include "osteo/simulation/bone/instrument.h"
#include "scratch.h"

namespace osteo {
namespace {

namespace fs = std::filesystem;

World bar() {
  return World(test::bar(0.5, 0.3));
}

// A groove along the bar's upper face (z = 4), with a rest in it.
Script groove() {
  Script s;
  s.tool = burr_index(BurrKind::cutting, 4);
  s.waypoints = {{0, {-6, 0, 8}, true},  {0.3, {-6, 0, 5}, true},  {1.3, {0, 1, 4}, true, 0.7},
                 {1.6, {0, 1, 4}, true}, {2.4, {6, 0, 4.5}, true}, {2.6, {6, 0, 9}, false}};
  return s;
}

std::string record(const Script& script, const fs::path& file, std::vector<SceneAction> actions = {}) {
  RehearsalOptions o;
  o.session_file = file;
  o.haptics.device = SpringHand::traits();
  o.haptics.more_devices.assign(script.more_hands.size(), SpringHand::traits());
  o.actions = std::move(actions);
  Rehearsal r(bar(), devices_of(script, 1000), o, {});
  return r.run_to_end({}).bone_hash;
}

struct Played {
  RehearsalSummary summary;
  GuidedFacts facts;
  std::shared_ptr<Playback> playback;
};

Played play(const fs::path& expert, const PlaybackParams& params, double hand_n_per_m, const fs::path& file,
            Vec3 off = {0, 0, 2}, const SimulatedDeviceParams& arm = {}) {
  const SessionReader session(expert);
  auto playback = std::make_shared<Playback>(std::make_shared<Lesson>(read_lesson(session, 0, 0)), params);
  const DeviceSample& first = playback->lesson->hands.front().front();
  RehearsalOptions o;
  o.session_file = file;
  auto devices = playback_devices(
      std::make_unique<FollowingHand>(hand_n_per_m, from_floats(first.position_mm) + off, playback, arm), playback,
      o.haptics);
  o.actions = playback_actions(*playback);
  Rehearsal r(bar(), std::move(devices), o, {});
  Played p{r.run_to_end({}), {}, playback};
  p.facts = measure_guided(SessionReader(file), playback->begun);
  return p;
}

bool replays(const fs::path& file) {
  const ReplayResult r = replay(SessionReader(file), bar(), {}, {});
  EXPECT_EQ(r.difference, "");
  return r.identical && r.complete;
}

struct Playbacks : testing::Test {
  test::ScratchFolder at;
  fs::path expert = at / "expert.oss";
  std::string bone = record(groove(), expert);
};

TEST_F(Playbacks, HandsOfThreeStiffnessesFollowWithinAMillimetre) {
  for (const PlaybackMode mode : {PlaybackMode::show, PlaybackMode::guide}) {
    for (const double stiffness : {100.0, 250.0, 500.0}) {
      PlaybackParams params;
      params.mode = mode;
      const fs::path file = at / ("led" + std::to_string(static_cast<int>(mode)) + std::to_string(stiffness) + ".oss");
      const Played p = play(expert, params, stiffness, file);
      EXPECT_TRUE(p.playback->over);
      EXPECT_GT(p.facts.ticks, 2500U);
      EXPECT_LT(p.facts.rms_mm, 1);
      EXPECT_LE(p.facts.most_pull_n, params.most_n + 8);
      EXPECT_LT(p.facts.most_work_mj,
                8);  // what it takes to carry the hand along, and no more: twice as much would be swinging
      EXPECT_EQ(p.summary.bone_hash, bone);  // to the bit, though another hand was there
      EXPECT_TRUE(replays(file));
    }
  }
}

fs::path press(double press_n, double seconds, const fs::path& file) {
  RehearsalOptions o;
  o.session_file = file;
  auto hand = std::make_unique<test::FirmHand>(press_n, seconds);
  o.haptics.device = hand->traits();
  Rehearsal(bar(), std::move(hand), o, {}).run_to_end({});
  return file;
}

// In the mode that is the default a lesson of many newtons carries no hand off, whatever it holds. Guided, the
// learner's own bone pushes him out where the expert pressed into it.
TEST_F(Playbacks, ALessonOfEightNewtonsCarriesNoArmAway) {
  const fs::path firm = press(9.6, 2.6, at / "firm.oss");
  double most_n = 0;
  const Session recorded = read_session(firm);
  for (const TickRecord& t : recorded.ticks) most_n = std::max(most_n, length(from_floats(t.force_n)));
  EXPECT_GT(most_n, 7.8);
  std::printf("presses with %.1f N\n", most_n);
  for (const test::Arm& arm : test::kArms) {
    for (const PlaybackMode mode : {PlaybackMode::show, PlaybackMode::guide}) {
      PlaybackParams params;
      params.mode = mode;
      const bool shown = mode == PlaybackMode::show;
      const Played p = play(firm, params, 250, at / ("led" + std::to_string(arm.params.mass_kg) + (shown ? "s" : "g")),
                            {0, 0, 2}, arm.params);
      std::printf("%s, %s: RMS %.2f, 95 %% %.2f, most %.2f mm, pull %.2f N, work %.1f, most %.1f mJ\n",
                  shown ? "show" : "guide", arm.name, p.facts.rms_mm, p.facts.p95_mm, p.facts.most_mm,
                  p.facts.most_pull_n, p.facts.work_mj, p.facts.most_work_mj);
      EXPECT_TRUE(p.playback->over);
      EXPECT_FALSE(p.playback->given_up);
      EXPECT_LT(p.facts.rms_mm, shown ? 0.5 : 1.5);
      EXPECT_LT(p.facts.p95_mm, shown ? 0.7 : 2);
      EXPECT_LE(p.facts.most_pull_n, params.most_n);
      EXPECT_LT(p.facts.most_work_mj, 4);
    }
  }
}

// Whoever is held off farther than the leash: in every mode that leads time stops, nothing of the expert's force is
// left, and what pulls back is no more than it may be; by the clock too. Then let go: no arm swings up.
TEST_F(Playbacks, BeyondTheLeashEveryModeStopsAndNoArmGainsEnergy) {
  const fs::path firm = press(9.6, 2.6, at / "firm.oss");
  const auto lesson = std::make_shared<Lesson>(read_lesson(SessionReader(firm), 0, 0));
  for (const test::Arm& arm : test::kArms) {
    for (const PlaybackMode mode : {PlaybackMode::show, PlaybackMode::guide, PlaybackMode::fading}) {
      for (const Pace pace : {Pace::clock, Pace::way}) {
        PlaybackParams params;
        params.mode = mode;
        params.pace = pace;
        params.ramp_s = 0.2;
        auto playback = std::make_shared<Playback>(lesson, params);
        RehearsalOptions o;
        auto hand = std::make_unique<FollowingHand>(100, from_floats(lesson->hands.front().front().position_mm),
                                                    playback, arm.params);
        FollowingHand* const held = hand.get();
        auto devices = playback_devices(std::move(hand), playback, o.haptics);
        std::vector<Device*> all;
        for (auto& d : devices) all.push_back(d.get());
        Stream stream;
        StreamReader& out = stream.add_reader(1 << 14, 1 << 20);
        Operation operation(bar(), o.haptics, {}, all, stream, 1000);
        operation.act(playback_actions(*playback).front());
        const auto run = [&](int ticks) {
          double most_n = 0;
          std::array<TickRecord, 2> t;
          for (int n = 0; n < ticks; ++n) {
            operation.step(0);
            while (out.ticks.pop(t) == 2) most_n = std::max(most_n, length(from_floats(t[0].force_n)));
          }
          return most_n;
        };
        const auto energy_mj = [&] {
          return 0.5 * arm.params.mass_kg * dot(held->velocity_mm_s(), held->velocity_mm_s()) / 1000;
        };
        run(1400);
        ASSERT_TRUE(playback->clock.started());
        held->push_n = {0, 0, 6};  // away, off the bone
        run(700);
        const std::size_t then = playback->clock.sample();
        EXPECT_GT(length(playback->hand_mm - playback->clock.target_mm()), params.tolerance_radius_mm);
        EXPECT_LE(run(200), params.most_n + 0.1);
        EXPECT_LE(playback->clock.sample(), then) << "time goes on without the hand";
        held->push_n = {};
        playback->on = false;  // nothing but what is stored
        double most = 0;
        for (int n = 0; n < 200; ++n) {
          run(1);
          most = std::max(most, energy_mj());
        }
        run(1300);
        EXPECT_LT(energy_mj(), 0.02 * std::max(most, 0.05)) << arm.name << static_cast<int>(mode);
      }
    }
  }
}

TEST_F(Playbacks, TimeAlongTheWayWaitsAndBoneIsStillTheRecordedOne) {
  PlaybackParams params;
  params.mode = PlaybackMode::show;
  params.pace = Pace::way;
  params.tolerance_radius_mm = 0.6;  // a firm hand is behind farther than that
  const fs::path file = at / "way.oss";
  const Played p = play(expert, params, 500, file);
  EXPECT_TRUE(p.playback->over);
  EXPECT_GT(p.summary.ticks, 2700U + p.playback->begun) << "it never waited";
  EXPECT_EQ(p.summary.bone_hash, bone);
  EXPECT_TRUE(replays(file));
}

TEST_F(Playbacks, TheLearnersBurrDrillsWhereItIsToAndTheRecordedHandIsAShadow) {
  PlaybackParams params;
  params.mode = PlaybackMode::fading;
  params.trial_s = 0.5;
  params.dead_zone_mm = 0.1;
  const fs::path file = at / "fading.oss";
  const Played p = play(expert, params, 100, file);
  EXPECT_GT(p.playback->fading.trials(), 3);
  EXPECT_LT(p.playback->fading.strength(), 1);
  EXPECT_GT(p.summary.removed_mm3, 0.1);  // by the learner's burr: the recorded one meets nothing
  const Session session = read_session(file);
  for (const TickRecord& r : session.ticks) {
    if (r.hand == 1) {
      ASSERT_EQ(r.voxels_changed, 0U);
    }
  }
  EXPECT_TRUE(replays(file));
}

TEST_F(Playbacks, FeelingAloneLeadsNobodyAndBoneIsTheRecordedOne) {
  PlaybackParams params;
  params.mode = PlaybackMode::feel;
  const fs::path file = at / "feel.oss";
  const Played p = play(expert, params, 100, file, {0, 0, 20});
  EXPECT_EQ(p.summary.bone_hash, bone);
  EXPECT_EQ(p.facts.work_mj, 0);
  EXPECT_EQ(p.facts.guided_s, 0);
  EXPECT_TRUE(replays(file));
}

TEST_F(Playbacks, OneWhoDoesNotComeOnEndsItWhereItWasToldTo) {
  auto playback =
      std::make_shared<Playback>(std::make_shared<Lesson>(read_lesson(SessionReader(expert), 0, 0)), PlaybackParams{});
  playback->patience_s = 0.5;
  class Rock final : public Device {
    DeviceSample read(std::uint64_t, double, Vec3) noexcept override {
      DeviceSample s;
      s.position_mm = {0, 0, 60};
      return s;
    }
    [[nodiscard]] bool active(std::uint64_t) const noexcept override { return false; }
  };
  RehearsalOptions o;
  auto devices = playback_devices(std::make_unique<Rock>(), playback, o.haptics);
  o.actions = playback_actions(*playback);
  Rehearsal r(bar(), std::move(devices), o, {});
  EXPECT_NEAR(static_cast<double>(r.run_to_end({}).ticks), 501, 2);
  EXPECT_TRUE(playback->given_up);
}

// The pull is let go, and the hand rests: no energy is left in it.
TEST_F(Playbacks, AHandThatIsLetGoComesToRest) {
  PlaybackParams params;
  params.ramp_s = 0.2;
  auto playback =
      std::make_shared<Playback>(std::make_shared<Lesson>(read_lesson(SessionReader(expert), 0, 0)), params);
  RehearsalOptions o;
  auto hand = std::make_unique<FollowingHand>(100, Vec3{-6, 0, 8}, playback);
  FollowingHand* const held = hand.get();
  auto devices = playback_devices(std::move(hand), playback, o.haptics);
  std::vector<Device*> all;
  for (auto& d : devices) all.push_back(d.get());
  Stream stream;
  Operation operation(bar(), o.haptics, {}, all, stream, 1000);
  operation.act(playback_actions(*playback).front());
  double pulled = 0;
  for (int t = 0; t < 2500; ++t) {
    if (t == 1000) playback->on = false;
    operation.step(0);
    if (t == 900) pulled = playback->pulled;
  }
  EXPECT_EQ(pulled, 1);
  EXPECT_EQ(playback->pulled, 0);
  EXPECT_LT(length(held->velocity_mm_s()), 0.5);
}

TEST_F(Playbacks, WhatHandsDoNotRepeatIsRefusedAndSaysWhen) {
  const auto refused = [&](const fs::path& file, double from, double to) -> std::string {
    try {
      static_cast<void>(read_lesson(SessionReader(file), from, to));
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(refused(expert, 0, 0), "");
  EXPECT_EQ(refused(expert, 1, 2), "");
  EXPECT_NE(refused(expert, 10, 0).find("nothing from 10 s"), std::string::npos);
  SceneAction move = SceneAction::move(0, {{}, {0, 0, 0.5}});
  move.tick = 1000;
  record(groove(), at / "moved.oss", {move});
  EXPECT_NE(refused(at / "moved.oss", 0, 0).find("at 1 s the session has 'move'"), std::string::npos);
  EXPECT_EQ(refused(at / "moved.oss", 0, 0.9), "");
  EXPECT_EQ(refused(at / "moved.oss", 1.1, 0), "");
  // Dust that began meanwhile begins in the lesson too; what began before it is as the lesson's own session has it.
  SceneAction dust = SceneAction::simulate(Simulated::dust, true);
  dust.tick = 1000;
  record(groove(), at / "dust.oss", {dust});
  EXPECT_EQ(refused(at / "dust.oss", 0, 0), "");
  ASSERT_EQ(read_lesson(SessionReader(at / "dust.oss"), 0.5, 0).actions.size(), 1U);
  EXPECT_EQ(read_lesson(SessionReader(at / "dust.oss"), 0.5, 0).actions.front().tick, 500U);
  EXPECT_TRUE(read_lesson(SessionReader(at / "dust.oss"), 1.1, 0).actions.empty());
  // A guided session is none to be led by: whose hand would it be?
  play(expert, {}, 100, at / "led.oss");
  EXPECT_NE(refused(at / "led.oss", 0, 0).find("'guide'"), std::string::npos);
}

TEST_F(Playbacks, SettingsOfTheSessionAreInForceWhereTheLessonBegins) {
  SceneAction soft = SceneAction::setting(static_cast<std::uint32_t>(setting_number("stiffness_n_per_mm")), 1.25);
  soft.tick = 500;
  record(groove(), at / "set.oss", {soft});
  EXPECT_EQ(read_lesson(SessionReader(at / "set.oss"), 1, 0).setup.params.contact.stiffness_n_per_mm, 1.25);
  const Lesson whole = read_lesson(SessionReader(at / "set.oss"), 0, 0);
  ASSERT_EQ(whole.actions.size(), 1U);
  EXPECT_THROW(static_cast<void>(playback_actions(Playback(std::make_shared<Lesson>(whole), {}))), Error);
  PlaybackParams feel;
  feel.mode = PlaybackMode::feel;
  EXPECT_EQ(playback_actions(Playback(std::make_shared<Lesson>(whole), feel)).size(), 2U);
}

Lesson straight(double mm_per_s, double seconds) {
  Lesson lesson;
  lesson.hands.resize(1);
  for (int t = 0; t < seconds * 1000; ++t) {
    DeviceSample s;
    s.position_mm = to_floats({mm_per_s * t / 1000, 0, 0});
    lesson.hands[0].push_back(s);
  }
  lesson.way = way_of(lesson.hands[0]);
  return lesson;
}

TEST(LessonClock, GoesWithTheHandWaitsAndGoesBack) {
  const Lesson lesson = straight(10, 4);
  EXPECT_NEAR(static_cast<double>(lesson.way.back().arc_mm), 40, 0.3);
  PlaybackParams params;
  params.mode = PlaybackMode::guide;
  params.pace = Pace::way;
  LessonClock clock(lesson, params);
  int ticks = 0;
  Vec3 hand{-6, 0, 0};
  // The target comes to the hand, and leads it to the beginning.
  for (; !clock.started() && ticks < 1000; ++ticks) {
    clock.step(hand, 1e-3);
    EXPECT_LT(length(clock.target_mm() - hand), 3);
    hand = hand * 0.99 + clock.target_mm() * 0.01;
  }
  EXPECT_TRUE(clock.started());
  // With the hand at its side it goes at its own pace.
  for (int t = 0; t < 1000; ++t) clock.step(clock.target_mm(), 1e-3);
  EXPECT_EQ(clock.sample(), 1000U);
  // The hand stays: a leash on, time waits.
  hand = clock.target_mm();
  for (int t = 0; t < 1000; ++t) clock.step(hand, 1e-3);
  EXPECT_NEAR(clock.target_mm().x - hand.x, params.tolerance_radius_mm, 0.05);
  EXPECT_FALSE(clock.goes_on());
  // It goes back six millimetres: so does time, to two leashes.
  hand.x -= 6;
  for (int t = 0; t < 2000; ++t) clock.step(hand, 1e-3);
  EXPECT_NEAR(clock.target_mm().x - hand.x, 2 * params.tolerance_radius_mm, 0.25);
  EXPECT_FALSE(clock.goes_on());
  // And on again: what was there before is not new.
  int again = 0, fresh = 0;
  for (int t = 0; t < 6000 && !clock.ended(); ++t) {
    clock.step(clock.target_mm(), 1e-3);
    (clock.goes_on() ? fresh : again) += 1;
  }
  EXPECT_TRUE(clock.ended());
  EXPECT_NEAR(fresh, 2800, 30);
  EXPECT_GT(again, 300);
}

// There and back on the same places: a hand that lags at one of them is still on its way there, and time goes back to
// it; not on to where it comes by the second time.
TEST(LessonClock, OfAPlaceThatIsPassedTwiceTheFirstTimeCounts) {
  Lesson lesson;
  lesson.hands.resize(1);
  for (int t = 0; t <= 600; ++t) {
    DeviceSample s;
    s.position_mm = to_floats({(t <= 300 ? t : 600 - t) / 100.0, 0, 0});  // 3 mm and back
    lesson.hands[0].push_back(s);
  }
  for (std::uint32_t n = 0; n <= 30; ++n) {
    const double fifths = n <= 15 ? n : 30 - n;  // both passes at the very same places
    lesson.way.push_back({to_floats({fifths / 5, 0, 0}), static_cast<float>(n) / 5, 20 * n});
  }
  PlaybackParams params;
  params.mode = PlaybackMode::guide;
  params.pace = Pace::way;
  params.tolerance_radius_mm = 1;
  LessonClock clock(lesson, params);
  while (!clock.started()) clock.step({}, 1e-3);
  // With the hand along until the way is 0.6 mm on its way back, at 2.4 mm.
  while (clock.sample() < 360) clock.step(clock.target_mm(), 1e-3);
  ASSERT_NEAR(clock.target_mm().x, 2.4, 1e-6);
  // A hand at 1 mm was there 2.6 mm of way ago, and will be 1.4 mm further on.
  for (int t = 0; t < 20; ++t) clock.step({1, 0, 0}, 1e-3);
  EXPECT_EQ(clock.sample(), 340U) << "time goes back by a tick each";
}

TEST(LessonClock, ItBeginsAMillimetreFromTheBeginning) {
  Lesson lesson = straight(10, 1);
  for (DeviceSample& at : lesson.hands[0]) at.position_mm[0] += 5;
  for (Lesson::Point& at : lesson.way) at.at_mm[0] += 5;
  // Where nothing leads time waits for who comes by himself; by the clock it does not.
  for (const auto& [mode, pace, hand, starts] : {std::tuple(PlaybackMode::graphics, Pace::way, 1.0, true),
                                                 std::tuple(PlaybackMode::graphics, Pace::way, 1.001, false),
                                                 std::tuple(PlaybackMode::feel, Pace::clock, 50.0, true),
                                                 std::tuple(PlaybackMode::guide, Pace::way, 1.001, false)}) {
    PlaybackParams params;
    params.mode = mode;
    params.pace = pace;
    LessonClock clock(lesson, params);
    EXPECT_FALSE(clock.started());
    for (int t = 0; t < 200; ++t) {
      clock.step({5, hand, 0}, 1e-3);
      if (clock.started()) break;
    }
    EXPECT_EQ(clock.started(), starts) << hand;
    EXPECT_EQ(clock.goes_on(), starts);
    EXPECT_EQ(clock.sample(), 0U);
    EXPECT_EQ(clock.target_mm().y, 0) << "the target is where the lesson begins";
  }
  // What leads comes at 30 mm/s, and not on where the hand does not come along.
  PlaybackParams led;
  led.mode = PlaybackMode::guide;
  led.tolerance_radius_mm = 2;
  LessonClock clock(lesson, led);
  const Vec3 hand{5, 9, 0};
  clock.step(hand, 1e-3);
  EXPECT_NEAR(clock.target_mm().y, 9 - 0.03, 1e-9);
  for (int t = 0; t < 500; ++t) clock.step(hand, 1e-3);
  EXPECT_NEAR(clock.target_mm().y, 7, 0.031);
  EXPECT_LT(clock.target_mm().y, 7);
  EXPECT_FALSE(clock.started());
}

// What leads, who drills and what time goes by, of each mode; each may be asked for otherwise.
TEST(Modes, SayWhatLeadsWhoDrillsAndWhatTimeGoesBy) {
  struct Row {
    PlaybackMode mode;
    bool leads, expert, clock;
  };
  for (const Row& row :
       {Row{PlaybackMode::show, true, true, true}, Row{PlaybackMode::feel, false, true, true},
        Row{PlaybackMode::guide, true, true, false}, Row{PlaybackMode::fading, true, false, false},
        Row{PlaybackMode::amplify, true, false, false}, Row{PlaybackMode::graphics, false, false, false}}) {
    PlaybackParams p;
    p.mode = row.mode;
    p.stiffness_n_per_mm = 0.7;
    p.damping_n_s_per_m = 3;
    p.most_n = 4;
    p.dead_zone_mm = 1.5;
    p.forward = 0.6;
    const int mode = static_cast<int>(row.mode);
    EXPECT_EQ(leads(p), row.leads) << mode;
    EXPECT_EQ(expert_drills(p), row.expert) << mode;
    EXPECT_EQ(by_clock(p), row.clock) << mode;
    const HandGuide g = guide_of(p);
    EXPECT_EQ(g.most_n, 4) << mode;
    const bool away = row.mode == PlaybackMode::amplify;
    EXPECT_DOUBLE_EQ(g.stiffness_n_per_mm, !row.leads ? HandGuide{}.stiffness_n_per_mm
                                           : away     ? -std::min(0.7, GuideLaw::kAwayStiffness)
                                                      : 0.7)
        << mode;
    EXPECT_DOUBLE_EQ(g.damping_n_s_per_m, !row.leads ? HandGuide{}.damping_n_s_per_m : away ? 10 : 3) << mode;
    EXPECT_EQ(g.dead_zone_mm, row.mode == PlaybackMode::fading || away ? 1.5 : HandGuide{}.dead_zone_mm) << mode;
    EXPECT_EQ(g.own_contact, row.leads ? row.mode != PlaybackMode::show : HandGuide{}.own_contact) << mode;
    EXPECT_EQ(g.forward, row.mode == PlaybackMode::show ? 0.6 : HandGuide{}.forward) << mode;
    for (const bool other : {false, true}) {
      p.drills = other ? WhoDrills::expert : WhoDrills::learner;
      p.pace = other ? Pace::clock : Pace::way;
      EXPECT_EQ(expert_drills(p), other) << mode;
      EXPECT_EQ(by_clock(p), other) << mode;
    }
    p.most_n = 0;
    EXPECT_EQ(guide_of(p).most_n, 1e-3) << "a leader there is";
    p.damping_n_s_per_m = 12;
    if (away) {
      EXPECT_EQ(guide_of(p).damping_n_s_per_m, 12);
    }
  }
}

TEST(LessonClock, ByTheClockItWaitsForNobody) {
  const Lesson lesson = straight(10, 1);
  PlaybackParams feel;
  feel.mode = PlaybackMode::feel;
  LessonClock clock(lesson, feel);
  for (int t = 0; t < 1000; ++t) {
    clock.step({100, 0, 0}, 1e-3);
    ASSERT_EQ(clock.sample(), static_cast<std::size_t>(t));
    ASSERT_TRUE(clock.goes_on());
  }
  clock.step({100, 0, 0}, 1e-3);
  EXPECT_TRUE(clock.ended());
}

TEST(FadingGuide, ForgetsWithoutErrorsAndComesBackWithThem) {
  FadingGuide g(0.85, 1);
  EXPECT_EQ(g.strength(), 1);
  const auto trial = [&](double mm) {
    for (int i = 0; i < 1000; ++i) g.add(mm * i / 900);
    g.end_trial();
  };
  double before = 1;
  for (int i = 0; i < 30; ++i) {
    trial(0.8);  // in the dead zone: nothing but forgetting
    EXPECT_NEAR(g.strength(), 0.85 * before, 1e-9);
    before = g.strength();
  }
  EXPECT_LT(g.strength(), 0.01);
  for (int i = 0; i < 60; ++i) trial(FadingGuide::kWorstMm);
  EXPECT_NEAR(g.last_error_mm(), FadingGuide::kWorstMm, 0.06);
  EXPECT_NEAR(g.strength(), 1, 0.02);
  // Halfway errors ask for half of it.
  for (int i = 0; i < 80; ++i) trial(3);
  EXPECT_NEAR(g.strength(), 0.5, 0.02);
  g.add(NAN);
  g.end_trial();
  EXPECT_LE(g.strength(), 1);
}

// The 90th percentile of a trial: an error that one tick in ten has counts, one that fewer have does not.
TEST(FadingGuide, AnErrorIsTheNinetiethPercentileOfATrial) {
  for (const auto& [large, mm] : {std::pair<int, double>{100, 1}, {101, 4}, {0, 1}, {1000, 4}}) {
    FadingGuide g(0.5, 2);
    for (int i = 0; i < 1000; ++i) g.add(i < large ? 4.01 : 1.01);
    g.end_trial();
    EXPECT_NEAR(g.last_error_mm(), mm, 0.03) << large;
    // Half is forgotten; an error of 4 mm, of 2 to 5, asks for two thirds of the other half.
    EXPECT_NEAR(g.strength(), mm < 2 ? 0.5 : 0.5 + 0.5 * 2 / 3, 0.01) << large;
    EXPECT_EQ(g.trials(), 1);
    g.end_trial();  // nothing added
    EXPECT_EQ(g.trials(), 1);
    EXPECT_NEAR(g.last_error_mm(), mm, 0.03);
  }
  // A dead zone as wide as the worst error leaves a tenth of a millimetre.
  FadingGuide narrow(0, FadingGuide::kWorstMm);
  narrow.add(5.03);
  narrow.end_trial();
  EXPECT_NEAR(narrow.strength(), 0.25, 1e-9);
  FadingGuide far(0.5, 2);
  for (const double error : {1e9, static_cast<double>(NAN), -1.0}) {
    far.add(error);
    far.end_trial();
    EXPECT_NEAR(far.last_error_mm(), error < 0 ? 0 : 25.6, 0.03) << error;
  }
}

TEST(Spread, IsTheDistanceOfWays) {
  const Lesson a = straight(10, 2);
  Lesson b = a;
  for (auto& p : b.way) p.at_mm[1] = 1.5F;
  EXPECT_EQ(spread_mm(a, {}), 0);
  const Lesson others[] = {b};
  EXPECT_NEAR(spread_mm(a, others), 1.5, 0.02);
}

}  // namespace
}  // namespace osteo
