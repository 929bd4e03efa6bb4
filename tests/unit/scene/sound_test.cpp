// What is heard of a rehearsal follows from its stream, live and from a file.
#include "osteo/session/scene/sound.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstring>
#include <thread>

#include "bar.h"
#include "osteo/core/base/files.h"
#include "scratch.h"

namespace osteo {
namespace {

// Free above the bar, from half a second on pressed on its upper face (z = 4), free again.
Script one_hole(double seconds) {
  Script s;
  s.axis = {0, 0.3, 0.95};
  s.waypoints = {{0, {0, 0, 9}, true},
                 {0.4, {0, 0, 9}, true},
                 {0.5, {0, 0, 5.6}, true},
                 {seconds - 0.6, {1, 0.5, 4.6}, true},
                 {seconds - 0.5, {0, 0, 9}, true},
                 {seconds, {0, 0, 9}, false}};
  return s;
}

RehearsalOptions recorded_in(const std::filesystem::path& file) {
  RehearsalOptions o;
  o.session_file = file;
  o.haptics.device = SpringHand::traits();
  return o;
}

double rms(std::span<const float> x) {
  double sum = 0;
  for (const float v : x) sum += static_cast<double>(v) * static_cast<double>(v);
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(1, x.size())));
}

std::vector<float> samples_of(const std::filesystem::path& wav) {
  const std::vector<std::byte> file = read_file(wav);
  std::vector<float> x((file.size() - 44) / 2);
  for (std::size_t i = 0; i < x.size(); ++i) {
    std::int16_t v = 0;
    std::memcpy(&v, file.data() + 44 + 2 * i, 2);
    x[i] = static_cast<float>(v) / 32767;
  }
  return x;
}

std::span<const float> second(const std::vector<float>& x, double from, double to) {
  return std::span(x).subspan(static_cast<std::size_t>(from * 48000), static_cast<std::size_t>((to - from) * 48000));
}

TEST(Sound, OfASessionFollowsContactAndIsTheSameEachTime) {
  const test::ScratchFolder folder;
  Rehearsal r(World(test::bar(0.5, 0.2)), std::make_unique<ScriptedDevice>(one_hole(3), 1000),
              recorded_in(folder / "s.oss"), {});
  ASSERT_GT(r.run_to_end({}).removed_mm3, 0.5);
  const SessionReader session(folder / "s.oss");
  const SoundFileFacts facts = write_session_sound(session, {}, 1, false, folder / "a.wav", {});
  EXPECT_NEAR(facts.seconds, 3, 0.02);
  EXPECT_EQ(facts.gaps, 0U);
  const std::vector<float> x = samples_of(folder / "a.wav");
  EXPECT_GT(rms(second(x, 1.2, 1.8)), 2.5 * rms(second(x, 0.3, 0.45)));  // on bone louder than free
  EXPECT_GT(rms(second(x, 0.3, 0.45)), 1e-4);                            // and free it is heard
  static_cast<void>(write_session_sound(session, {}, 1, false, folder / "b.wav", {}));
  EXPECT_EQ(hash_path(folder / "a.wav"), hash_path(folder / "b.wav"));
  static_cast<void>(write_session_sound(session, {}, 0, false, folder / "silent.wav", {}));
  EXPECT_EQ(rms(samples_of(folder / "silent.wav")), 0);
}

TEST(Sound, LiveIsHeardAsItHappensAndEndsInSilence) {
  Rehearsal r(World(test::bar(0.5, 0.2)), std::make_unique<ScriptedDevice>(one_hole(30), 1000), recorded_in({}), {});
  LiveSound sound(r, false, 1);
  r.start();
  std::vector<float> out(256);
  double loudest = 0;
  // As a sound card asks, but without its clock: until the burr is on bone.
  while (loudest < 0.01) {
    sound.fill(out);
    loudest = std::max(loudest, rms(out));
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    ASSERT_LT(r.latest().tick, 29000U);
  }
  EXPECT_GT(r.latest().tick, 400U);  // not before it touched
  sound.set_volume(0);
  sound.fill(out);
  sound.fill(out);
  EXPECT_EQ(rms(out), 0);
  sound.set_volume(1);
  static_cast<void>(r.stop());
  for (int i = 0; i < 200; ++i) sound.fill(out);  // a second without ticks
  EXPECT_EQ(rms(out), 0);
}

TEST(Sound, AReaderThatComesAndGoesWhileItRunsCostsTheOthersNothing) {
  const test::ScratchFolder folder;
  Rehearsal r(World(test::bar(0.5, 0.2)), std::make_unique<ScriptedDevice>(one_hole(30), 1000),
              recorded_in(folder / "s.oss"), {});
  r.start();
  std::vector<float> out(256);
  for (int i = 0; i < 50; ++i) {
    LiveSound sound(r, true, 1);
    for (int k = 0; k < 4; ++k) sound.fill(out);
  }
  const RehearsalSummary s = r.stop();
  EXPECT_TRUE(s.gaps.empty());
  EXPECT_EQ(s.ticks_not_followed, 0U);
}

TEST(SoundTracker, HearsHandsActionsAndStructures) {
  SoundTracker t({7}, 1000, true);
  TickRecord drill;
  drill.device.tool = static_cast<std::uint8_t>(burr_index(BurrKind::diamond, 5));
  drill.speed_rpm = 50000;
  drill.normal_force_n = 2;
  drill.thickness_mm = 1.5;
  drill.structure = 7;
  drill.clearance_mm = 1;
  t.take(drill);
  EXPECT_EQ(t.state().voices[0].kind, SoundKind::burr);
  EXPECT_EQ(t.state().voices[0].edge_db, row_of(BurrKind::diamond).sound_db);
  EXPECT_EQ(t.state().voices[0].teeth_share, 0) << "a diamond has none";
  EXPECT_EQ(t.state().voices[0].diameter_mm, 5);
  EXPECT_EQ(t.state().voices[0].thickness_mm, 1.5);
  EXPECT_NEAR(t.state().voices[0].softness, 0.5, 1e-9);
  EXPECT_EQ(t.state().alarm, SoundAlarm::none);
  drill.structure = 8;  // a nerve is not soft
  drill.flags = kStructureTouched;
  drill.tick = 1;
  t.take(drill);
  EXPECT_EQ(t.state().voices[0].softness, 0);
  EXPECT_EQ(t.state().alarm, SoundAlarm::touched);
  drill.flags = kStructureTouched | kStructureInjured;
  drill.tick = 2;
  t.take(drill);
  EXPECT_EQ(t.state().alarm, SoundAlarm::injured);
  t.set_alarms(false);
  drill.tick = 3;
  t.take(drill);
  EXPECT_EQ(t.state().alarm, SoundAlarm::none);
  // A sucker in the second hand, water beside the burr.
  TickRecord hand;
  hand.hand = 1;
  hand.device.tool = static_cast<std::uint8_t>(instrument_index("sucker 10 Fr"));
  hand.device.pedal = 255;
  t.take(hand);
  EXPECT_EQ(t.state().voices[1].kind, SoundKind::sucker);
  EXPECT_NEAR(t.state().voices[1].diameter_mm, 10 / 3.0, 1e-9);
  EXPECT_EQ(t.state().water, 0);
  t.take(SceneAction::irrigate({}, 5, 0.8));
  for (int i = 0; i < 5000; ++i) t.take(drill), t.take(hand);
  EXPECT_GT(t.state().water, 0.2);
  t.take(SceneAction::irrigate({}, 5, 0));
  for (int i = 0; i < 20000; ++i) t.take(drill), t.take(hand);
  EXPECT_LT(t.state().water, 0.01);
  // A plate in the hand: metal where it meets bone, and no burr.
  drill.flags = kPlateInHand;
  drill.normal_force_n = 3;
  t.take(drill);
  EXPECT_EQ(t.state().voices[0].kind, SoundKind::silent);
  EXPECT_EQ(t.state().metal_n, 3);
}

TEST(SoundTracker, ASawIsHeardAtItsStrokes) {
  SoundTracker t({}, 1000, true);
  TickRecord saw;
  saw.device.tool = static_cast<std::uint8_t>(instrument_index("saw 25 mm"));
  saw.speed_rpm = 60000;
  saw.normal_force_n = 2;
  t.take(saw);
  EXPECT_EQ(t.state().voices[0].kind, SoundKind::burr);
  EXPECT_EQ(t.state().voices[0].teeth_share, row_of(BurrKind::cutting).sound_teeth_share);
  EXPECT_EQ(t.state().voices[0].speed_rpm, 15000);
  EXPECT_EQ(t.state().voices[0].press_n, 2);
}

TEST(SoundTracker, HearsInstrumentsTouch) {
  SoundTracker t({}, 1000, true);
  TickRecord drill, sucker;
  drill.device.tool = static_cast<std::uint8_t>(burr_index(BurrKind::cutting, 4));
  sucker.hand = 1;
  sucker.device.tool = static_cast<std::uint8_t>(instrument_index("sucker 8 Fr"));
  drill.device.axis = sucker.device.axis = {0, 0, 1};
  const auto at = [&](float x_mm) {
    sucker.device.position_mm = {x_mm, 0, 0};
    for (int n = 0; n < 20; ++n) {
      t.take(drill), t.take(sucker);
      sucker.tick = ++drill.tick;
    }
    return t.state().metal_n;
  };
  EXPECT_EQ(at(8), 0);
  EXPECT_GT(at(3), 0);  // 2 mm and 1.33 mm are more than 3
  EXPECT_EQ(at(8), 0);
  drill.flags = kPlateInHand;
  EXPECT_EQ(at(3), 0);  // a plate is no shaft
}

TEST(SoundTracker, KnowsSoftStructuresByTheirNames) {
  const std::vector<Structure> names{
      {1, "facial nerve"}, {2, "Sigmoid sinus"}, {3, "dura"}, {4, "jugular bulb"}, {5, "malleus"}};
  EXPECT_EQ(soft_structures(names), (std::set<std::uint32_t>{2, 3, 4}));
}

}  // namespace
}  // namespace osteo
