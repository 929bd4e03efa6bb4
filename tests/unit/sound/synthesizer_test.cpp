// The synthesiser against the model's table: lines where and as loud as it says, noise too, and nothing that clicks.
#include "osteo/simulation/sound/synthesizer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

namespace osteo {
namespace {

constexpr double kRate = Synthesizer::kRateHz;
const SafeLevel kNotHeld{200, 10};

// Of the kinds of burrs there are: level on bone, share of the teeth.
struct Edge {
  double db, teeth_share;
};
constexpr Edge kCutting{0, 0.5}, kDiamond{-8, 0};

SoundState burr(Edge edge, double rpm, double press_n, double diameter_mm = 4, double thickness_mm = 0,
                double softness = 0) {
  SoundState s;
  s.voices[0] = {SoundKind::burr, rpm, diameter_mm, press_n, thickness_mm, softness, 0, edge.db, edge.teeth_share};
  return s;
}

std::vector<float> play(Synthesizer& s, const SoundState& state, double seconds,
                        std::size_t block = Synthesizer::kBlock) {
  std::vector<float> out(static_cast<std::size_t>(seconds * kRate) / block * block);
  for (std::size_t at = 0; at < out.size(); at += block) s.render(state, 1, std::span(out).subspan(at, block));
  return out;
}
// Behind the fade at the beginning.
std::vector<float> steady(const SoundState& state, double seconds, const SoundModel& model = {}) {
  Synthesizer s(model, 1, kNotHeld);
  play(s, state, 0.1);
  return play(s, state, seconds);
}

// Of a sine of this frequency in the samples: its amplitude, by a Hann window, whose sides fall quickly.
double line_amplitude(const std::vector<float>& x, double hz) {
  std::complex<double> sum = 0;
  double weight = 0;
  const std::complex<double> step = std::polar(1.0, -2 * std::numbers::pi * hz / kRate);
  std::complex<double> turn = 1;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double w =
        1 - std::cos(2 * std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(x.size()));
    sum += w * static_cast<double>(x[i]) * turn;
    weight += w;
    turn *= step;
    if (i % 4096 == 4095) turn /= std::abs(turn);
  }
  return 2 * std::abs(sum) / weight;
}
double db_of(double rms, const SoundModel& m) {
  return 20 * std::log10(rms) + m.full_scale_db;
}
double rms(const std::vector<float>& x) {
  double sum = 0;
  for (const float v : x) sum += static_cast<double>(v) * static_cast<double>(v);
  return std::sqrt(sum / static_cast<double>(x.size()));
}
// Power between two frequencies, by many lines a hertz apart: for a second of noise.
double band_db(const std::vector<float>& x, double from, double to, const SoundModel& m) {
  double power = 0;
  int lines = 0;
  for (double hz = from; hz < to; hz += (to - from) / 40, ++lines) {
    const double a = line_amplitude(x, hz);
    power += a * a / 2;
  }
  return db_of(std::sqrt(power / lines), m);
}

TEST(Synthesizer, LinesAreWithinAHertzAndADecibelOfTheTable) {
  const SoundModel model;
  int compared = 0;
  for (const double rpm : {20000.0, 43000.0, 60000.0}) {
    for (const double press : {0.0, 2.0}) {
      const SoundState state = burr(kCutting, rpm, press);
      const BurrSpectrum table = burr_spectrum(state.voices[0], model);
      const std::vector<float> x = steady(state, 2);
      for (const SoundLine& line : table.lines) {
        // In 2 s it stands out of the noise beside it, which is 37 dB weaker in a hertz than in all, only where it is
        // not much weaker.
        if (line.db < table.noise_db + envelope_db(line.hz) - 20 || line.db < 0) continue;
        ++compared;
        double best_hz = 0, best = 0;
        for (double hz = line.hz - 3; hz <= line.hz + 3; hz += 0.25) {
          const double a = line_amplitude(x, hz);
          if (a > best) best = a, best_hz = hz;
        }
        EXPECT_NEAR(best_hz, line.hz, 1) << rpm << " rpm, " << press << " N";
        EXPECT_NEAR(db_of(best / std::numbers::sqrt2, model), line.db, 1)
            << line.hz << " Hz, " << rpm << " rpm, " << press << " N";
      }
    }
  }
  EXPECT_GE(compared, 20);
}

TEST(Synthesizer, NoiseIsAsLoudAsTheTableAndFallsAsPublished) {
  const SoundModel model;
  const SoundState state = burr(kDiamond, 60000, 2, 5);
  const BurrSpectrum table = burr_spectrum(state.voices[0], model);
  const std::vector<float> x = steady(state, 4);
  double lines = 0;
  for (const SoundLine& l : table.lines) lines += std::pow(10, l.db / 10);
  const double noise = 10 * std::log10(std::pow(10, db_of(rms(x), model) / 10) - lines);
  EXPECT_NEAR(noise, table.noise_db, 1);
  const double middle = band_db(x, 2100, 3900, model);
  EXPECT_LT(band_db(x, 8000, 8800, model), middle - 24);
  EXPECT_LT(band_db(x, 15900, 17000, model), middle - 60);
  EXPECT_LT(band_db(x, 200, 400, model), middle - 6);
}

TEST(SoundModel, DifferencesOfLevelsAreThosePublished) {
  const SoundModel m;
  const auto noise = [&](Edge kind, double rpm, double press, double diameter) {
    return burr_spectrum(burr(kind, rpm, press, diameter).voices[0], m).noise_db;
  };
  const double six = noise(kCutting, 60000, 1, 6);
  const double four = six - noise(kCutting, 60000, 1, 4), two = six - noise(kCutting, 60000, 1, 2);
  EXPECT_GE(four, 1);
  EXPECT_LE(four, 6);
  EXPECT_GE(two, 5);
  EXPECT_LE(two, 16);
  // All of a diamond's is noise, half of a cutting burr's: 3 dB of the difference.
  const double diamond = six + 10 * std::log10(2) - noise(kDiamond, 60000, 1, 6);
  EXPECT_GE(diamond, 5);
  EXPECT_LE(diamond, 11);
  const double speed = noise(kCutting, 80000, 1, 4) - noise(kCutting, 20000, 1, 4);
  EXPECT_GE(speed, 0);
  EXPECT_LE(speed, 5.01);
  EXPECT_GT(noise(kCutting, 60000, 3, 4), noise(kCutting, 60000, 1, 4) + 3);
  EXPECT_LT(noise(kCutting, 60000, 0, 4), noise(kCutting, 60000, 0.1, 4));
  for (double hz : {8000.0, 12000.0}) EXPECT_LE(envelope_db(hz), -24);
  EXPECT_LE(envelope_db(16000), -60);
  EXPECT_EQ(envelope_db(0), -200);
  // Suction: larger and wetter is louder.
  SoundVoice sucker{SoundKind::sucker, 0, 5 / 3.0, 0, 0, 0, 1};
  const double small = suction_db(sucker, 0, m);
  sucker.diameter_mm = 4;
  EXPECT_GT(suction_db(sucker, 0, m), small + 5);
  EXPECT_GT(suction_db(sucker, 1, m), suction_db(sucker, 0, m) + 5);
  sucker.draws = 0;
  EXPECT_EQ(suction_db(sucker, 1, m), -200);
}

TEST(SoundModel, ThePitchRisesOverThinBoneAndFallsUnderLoad) {
  const SoundModel m;
  const auto pitch = [&](double press, double thickness) {
    return burr_spectrum(burr(kCutting, 60000, press, 4, thickness).voices[0], m).rotation_hz;
  };
  EXPECT_DOUBLE_EQ(pitch(0, 0), 1000);
  EXPECT_DOUBLE_EQ(pitch(1, 0), pitch(1, 5));  // not known: as thick bone
  EXPECT_LT(pitch(3, 5), pitch(1, 5));
  EXPECT_GT(pitch(1, 1), pitch(1, 1.5));
  EXPECT_NEAR(pitch(1, 0.2) / pitch(1, 5), 1 + 0.25 * 0.9, 1e-12);
  EXPECT_DOUBLE_EQ(pitch(0, 0.2), 1000);  // it does not touch
}

TEST(Synthesizer, BoneOverSoftTissueIsDuller) {
  const SoundModel model;
  const std::vector<float> hard = steady(burr(kDiamond, 60000, 1), 2);
  const std::vector<float> soft = steady(burr(kDiamond, 60000, 1, 4, 0, 1), 2);
  EXPECT_LT(band_db(soft, 3000, 5000, model), band_db(hard, 3000, 5000, model) - 10);
  EXPECT_GT(band_db(soft, 600, 1200, model), band_db(hard, 600, 1200, model));
}

TEST(Synthesizer, NothingClicks) {
  // The steepest step between samples that the sound itself has, against all that changes: states that jump each 5 ms.
  Synthesizer s({}, 3, kNotHeld);
  const SoundState loud = burr(kCutting, 20000, 0);  // lines alone, and low ones
  SoundState states[] = {loud, burr(kCutting, 0, 0), burr(kDiamond, 18000, 0), {}, loud};
  double step = 0;
  std::vector<float> out(Synthesizer::kBlock);
  float last = 0;
  for (int i = 0; i < 400; ++i) {
    s.render(states[i % 5], 1, out);
    for (const float v : out) {
      step = std::max(step, std::abs(static_cast<double>(v - last)));
      last = v;
    }
  }
  // Without any change: amplitude times angle of the lines, and the noise of a burr that runs free.
  const std::vector<float> free = steady(loud, 1);
  double usual = 0;
  for (std::size_t i = 1; i < free.size(); ++i)
    usual = std::max(usual, std::abs(static_cast<double>(free[i] - free[i - 1])));
  EXPECT_LT(step, 1.5 * usual);
  // Silence stays silence, to the last bit.
  for (int i = 0; i < 3; ++i) s.render({}, 1, out);
  s.render({}, 1, out);
  EXPECT_TRUE(std::all_of(out.begin(), out.end(), [](float v) { return v == 0; }));
}

TEST(Synthesizer, WhateverTheStateSamplesAreFiniteAndBelowOne) {
  std::mt19937 random(5);
  const auto any = [&]() -> double {
    static constexpr double kOdd[] = {0,
                                      -1,
                                      1e300,
                                      -1e300,
                                      1e-300,
                                      0.5,
                                      3,
                                      60000,
                                      std::numeric_limits<double>::infinity(),
                                      std::numeric_limits<double>::quiet_NaN()};
    return kOdd[random() % std::size(kOdd)];
  };
  Synthesizer s;
  std::vector<float> out(100);
  for (int i = 0; i < 3000; ++i) {
    SoundState state;
    for (SoundVoice& v : state.voices)
      v = {static_cast<SoundKind>(random() % 4), any(), any(), any(), any(), any(), any(), any(), any()};
    state.water = any();
    state.metal_n = any();
    state.alarm = static_cast<SoundAlarm>(random() % 3);
    s.render(state, any(), out);
    for (const float v : out) ASSERT_TRUE(std::isfinite(v) && std::abs(v) < 1);
  }
}

TEST(Synthesizer, TheSameStatesGiveTheSameSamples) {
  SoundState state = burr(kCutting, 60000, 2);
  state.voices[1] = {SoundKind::sucker, 0, 3, 0, 0, 0, 1};
  state.water = 0.5;
  state.alarm = SoundAlarm::touched;
  Synthesizer a, b, other({}, 2);
  const std::vector<float> x = play(a, state, 1), y = play(b, state, 1), z = play(other, state, 1);
  EXPECT_EQ(x, y);
  EXPECT_NE(x, z);
}

TEST(Synthesizer, WhatIsLoudForLongIsHeldAtTheSafeLevel) {
  SoundModel model;
  model.contact_db = 100;
  Synthesizer s(model);
  const SoundState loud = burr(kCutting, 80000, 5, 7);
  const double first = 20 * std::log10(rms(play(s, loud, 0.2)));
  EXPECT_GT(first, -15);  // a short one passes
  play(s, loud, 40);
  EXPECT_NEAR(20 * std::log10(rms(play(s, loud, 5))), -25, 0.5);
  EXPECT_LT(s.held_down_db(), -5);
  play(s, {}, 120);
  EXPECT_EQ(s.held_down_db(), 0);
}

TEST(Synthesizer, WaterGurglesMetalRingsAlarmsBeep) {
  const SoundModel model;
  SoundState sucks;
  sucks.voices[2] = {SoundKind::sucker, 0, 8 / 3.0, 0, 0, 0, 1};
  EXPECT_NEAR(db_of(rms(steady(sucks, 3)), model), model.suction_db, 1);
  // Gurgles: loudness by short windows varies far more at half water.
  const auto variation = [&](double water) {
    sucks.water = water;
    const std::vector<float> x = steady(sucks, 6);
    double least = 1e9, most = 0;
    for (std::size_t at = 0; at + 960 <= x.size(); at += 960) {
      const double r =
          rms({x.begin() + static_cast<std::ptrdiff_t>(at), x.begin() + static_cast<std::ptrdiff_t>(at + 960)});
      least = std::min(least, r);
      most = std::max(most, r);
    }
    return 20 * std::log10(most / least);
  };
  const double dry = variation(0), half = variation(0.5), wet = variation(1);
  EXPECT_GT(half, dry + 4);
  EXPECT_GT(half, wet + 4);

  Synthesizer s;
  SoundState metal;
  metal.metal_n = 1;
  play(s, {}, 0.1);
  std::vector<float> out(Synthesizer::kBlock);
  s.render(metal, 1, out);
  const double at_first = rms(out);
  EXPECT_GT(db_of(at_first, model), model.metal_db - 12);
  play(s, metal, 0.5);  // it goes on lying there: silent
  s.render(metal, 1, out);
  EXPECT_LT(rms(out), at_first / 100);

  for (const SoundAlarm alarm : {SoundAlarm::touched, SoundAlarm::injured}) {
    SoundState state;
    state.alarm = alarm;
    const std::vector<float> x = steady(state, 3);
    EXPECT_GT(line_amplitude(x, 880), 5 * line_amplitude(x, 700));
    EXPECT_EQ(line_amplitude(x, 1320) > 5 * line_amplitude(x, 1100), alarm == SoundAlarm::injured);
  }
}

}  // namespace
}  // namespace osteo
