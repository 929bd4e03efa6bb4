// The nerve monitor's sound without a sound card: how soon a touch is heard, what is silent.
#include "osteo/session/scene/monitor_sound.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "ear.h"
#include "osteo/session/scene/monitor_reader.h"
#include "osteo/simulation/bone/instrument.h"

namespace osteo {
namespace {

double loudest(std::span<const float> x) {
  double most = 0;
  for (const float v : x) most = std::max(most, std::abs(static_cast<double>(v)));
  return most;
}

// Tick by tick as they would come, and a card that asks for 5.3 ms at a time: from the tick in which a probe meets the
// bare nerve.
TEST(MonitorSound, ATouchIsHeardWithinATenthOfASecond) {
  const HeadAnatomy head;
  test::Ear ear = test::ear(head, 0.5);
  const StructureMap map(ear.labels);
  BrickGrid bare = ear.bone;
  for (VoxelKey v = 0; v < bare.brick_count() * BrickGrid::kVoxels; ++v) bare.set(v, 0);
  const World world(std::move(bare));
  MonitorOptions options;
  options.setup = parse_monitor(default_monitor_json(), "built in");
  options.setup.constants.noise_uv = options.setup.constants.mains_uv = 0;
  options.heat = false;
  MonitorReader monitor(options, &map, 1000);
  MonitorSound sound;
  monitor.add_sink(sound);
  monitor.resync(world);
  const auto tool = static_cast<std::uint8_t>(instrument_index("probe 1 mm"));
  std::array<float, 256> card{};
  double asked_s = 0;
  constexpr double kTouchS = 0.3;
  double heard_s = -1;
  for (std::uint64_t t = 0; t < 600; ++t) {
    const double now_s = static_cast<double>(t) / 1000;
    TickRecord r;
    r.tick = t;
    r.device.tool = tool;
    // Comes nearer by 20 mm/s; at 0.3 s its ball meets the nerve's middle.
    r.device.position_mm = {static_cast<float>(46.2 + std::max(0.0, kTouchS - now_s) * 20), 9.5F, -33.5F};
    if (now_s < kTouchS) r.device.position_mm[0] += 0.5F;
    r.device.axis = {1, 0, 0};
    monitor.tick(r, {});
    for (; asked_s <= now_s; asked_s += 256.0 / 48000) {
      card.fill(0);
      sound.mix(card);
      if (heard_s < 0 && loudest(card) > 0.02) heard_s = asked_s + 256.0 / 48000;  // when the card has played it
    }
  }
  ASSERT_GT(heard_s, kTouchS) << "silent before";
  EXPECT_LT(heard_s - kTouchS, 0.1);
  RecordProperty("touch_to_sound_ms", std::to_string(1000 * (heard_s - kTouchS)));
}

MonitorBlock block_of(const std::vector<std::int16_t>& values, std::uint64_t first) {
  return {first, 1, values};
}

TEST(MonitorSound, IsSilentWhereAPulseIsAndWhereItIsMuted) {
  const std::vector<std::int16_t> loud(150, 2000);
  const auto played = [&](bool pulse, bool muted) {
    MonitorSound sound;
    sound.mute(muted);
    MonitorEvent e;
    e.kind = MonitorEventKind::stimulus;
    e.sample = 0;
    if (pulse) sound.event(e);
    for (std::uint64_t b = 0; b < 3; ++b) sound.block(block_of(loud, b * 150));
    std::vector<float> out(700, 0.0F);
    sound.mix(out);
    return out;
  };
  EXPECT_NEAR(played(false, false)[300], 0.7 * 0.5, 1e-3) << "500 uV at the usual volume";
  const std::vector<float> blanked = played(true, false);
  EXPECT_EQ(loudest({blanked.data(), 180}), 0) << "4 ms";
  EXPECT_GT(loudest({blanked.data() + 250, 200}), 0.1);
  EXPECT_EQ(loudest(played(false, true)), 0);
}

// Nobody listens for a second, then someone does: what is heard is new. And a sum stays within what a card takes.
TEST(MonitorSound, WhatIsOldIsLeftOut) {
  MonitorSound sound;
  const std::vector<std::int16_t> old(150, 2000), fresh(150, -400);
  std::uint64_t at = 0;
  for (int b = 0; b < 200; ++b, at += 150) sound.block(block_of(old, at));
  std::vector<float> out(4800, 0.9F);
  sound.mix(out);
  EXPECT_LE(loudest(out), 1);
  std::vector<float> later(240, 0.0F);
  for (int b = 0; b < 10; ++b, at += 150) {
    sound.block(block_of(fresh, at));
    std::fill(later.begin(), later.end(), 0.0F);
    if (b > 3) sound.mix(later);
  }
  EXPECT_NEAR(later.back(), -0.07, 1e-3) << "of the fresh";
  std::fill(later.begin(), later.end(), 0.0F);
  for (int i = 0; i < 30; ++i) {
    std::fill(later.begin(), later.end(), 0.0F);
    sound.mix(later);
  }
  EXPECT_EQ(loudest(later), 0) << "nothing comes: silence";
}

}  // namespace
}  // namespace osteo
