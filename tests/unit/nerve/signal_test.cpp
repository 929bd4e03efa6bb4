// The signal and what a monitor makes of it: noise as large as said, answers when they should come, events by their
// length, files.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>

#include "osteo/core/base/files.h"
#include "osteo/simulation/nerve/activity.h"
#include "osteo/simulation/nerve/blackrock.h"
#include "osteo/simulation/nerve/electromyogram.h"
#include "scratch.h"

namespace osteo {
namespace {

constexpr std::size_t kBlock = 150;

const MonitorSetup& setup() {
  static const MonitorSetup s = parse_monitor(default_monitor_json(), "built in");
  return s;
}

// One nerve 20 mm long, heard by the channels of the facial nerve.
struct Bench {
  explicit Bench(MonitorConstants c, std::uint64_t seed = 1)
      : constants(c), model(c, {course()}, seed), signal(c, channels(), seed) {}
  static NerveCourse course() {
    NerveCourse n;
    n.name = "facial nerve";
    for (int i = 0; i <= 40; ++i) n.points.push_back({{0, 0, -0.5 * i}, 0.5 * (40 - i), 0.6});
    return n;
  }
  static std::vector<Electromyogram::Channel> channels() {
    std::vector<Electromyogram::Channel> all;
    for (const MonitorChannel& c : setup().nerves[0].channels) all.push_back({0, c});
    return all;
  }
  void run(double seconds, const NerveStress* stress = nullptr, const DrillNoise& drill = {}) {
    const auto blocks = static_cast<std::size_t>(seconds * MonitorSetup::kRateHz / kBlock);
    std::vector<std::int16_t> block(kBlock * 4);
    for (std::size_t b = 0; b < blocks; ++b) {
      model.step(0.005, stress == nullptr ? std::span<const NerveStress>() : std::span(stress, 1), {});
      signal.render(model, drill, block);
      samples.insert(samples.end(), block.begin(), block.end());
    }
  }
  [[nodiscard]] double rms(std::size_t channel) const {
    double sum = 0;
    for (std::size_t i = channel; i < samples.size(); i += 4) {
      const double uv = samples[i] * MonitorSetup::kMicrovoltsPerBit;
      sum += uv * uv;
    }
    return std::sqrt(sum / (static_cast<double>(samples.size()) / 4));
  }
  MonitorConstants constants;
  NerveModel model;
  Electromyogram signal;
  std::vector<std::int16_t> samples;
};

TEST(Electromyogram, NoiseMainsAndDrillAreAsLargeAsSaid) {
  MonitorConstants c = setup().constants;
  c.mains_uv = 0;
  Bench quiet(c);
  quiet.run(10);
  EXPECT_NEAR(quiet.rms(0), c.noise_uv, 0.03 * c.noise_uv);
  EXPECT_NEAR(quiet.rms(3), c.noise_uv, 0.03 * c.noise_uv);
  Bench drilled(c);
  drilled.run(10, nullptr, {1000, 2});
  EXPECT_NEAR(drilled.rms(0), std::sqrt(49 + 64 + 4.5), 0.4) << "floor, contact of 2 N, line of 3 uV";
  c.noise_uv = 0;
  c.mains_uv = 40;
  Bench mains(c);
  mains.run(1);
  EXPECT_NEAR(mains.rms(0), 40 * std::sqrt(0.5 * 1.04), 0.5);
  for (std::size_t i = 0; i < 4000; ++i)
    EXPECT_EQ(mains.samples[i], mains.samples[i + 600 * 4]) << "50 Hz: 600 samples";
}

TEST(Electromyogram, SameBitsForTheSameSeed) {
  const NerveStress stress{0, 20, 0.2, 0.2, 1, true, true};
  Bench a(setup().constants, 5), b(setup().constants, 5), other(setup().constants, 6);
  for (Bench* const x : {&a, &b, &other}) x->run(2, &stress, {1300, 1});
  EXPECT_EQ(a.samples, b.samples);
  EXPECT_NE(a.samples, other.samples);
}

TEST(Electromyogram, AnAnswerComesByLatencyAndConduction) {
  MonitorConstants c = setup().constants;
  c.noise_uv = c.mains_uv = c.artefact_uv = 0;
  Bench bench(c);
  bench.signal.answer(30, bench.model, 0, 0, 1);
  bench.run(0.05);
  const auto channels = Bench::channels();
  for (std::size_t ch = 0; ch < 4; ++ch) {
    std::size_t peak = 0;
    double most = 0;
    for (std::size_t i = 0; i < bench.samples.size() / 4; ++i) {
      const double uv = std::abs(bench.samples[4 * i + ch]) * MonitorSetup::kMicrovoltsPerBit;
      if (uv > most) {
        most = uv;
        peak = i;
      }
    }
    EXPECT_NEAR(most, channels[ch].electrode.evoked_uv, 1);
    // Half the wave, 20 mm at 50 m/s, the electrode's own.
    EXPECT_NEAR(1000 * (static_cast<double>(peak) - 30) / 30000,
                channels[ch].electrode.latency_ms + 0.4 + 0.5 * c.evoked_ms, 0.1);
  }
}

TEST(Electromyogram, TheAmplifierEnds) {
  MonitorConstants c = setup().constants;
  Bench bench(c);
  bench.signal.stimulate(10, 5);
  bench.run(0.01);
  EXPECT_EQ(*std::max_element(bench.samples.begin(), bench.samples.end()), Electromyogram::kLargest);
  EXPECT_EQ(*std::min_element(bench.samples.begin(), bench.samples.end()), -Electromyogram::kLargest);
}

// A signal by hand: one channel, quiet but where told.
struct Heard {
  std::vector<MonitorEvent> events;
  std::vector<MonitorSpike> spikes;
  std::vector<bool> answers;
  [[nodiscard]] const MonitorEvent* find(MonitorEventKind kind) const {
    for (const MonitorEvent& e : events) {
      if (e.kind == kind) return &e;
    }
    return nullptr;
  }
};
Heard hear(const std::vector<std::int16_t>& samples, std::vector<std::uint64_t> pulses = {},
           std::size_t in_blocks_of = kBlock) {
  ActivityDetector detector(setup().constants, 1);
  Heard heard;
  const auto take = [&] {
    heard.events.insert(heard.events.end(), detector.events().begin(), detector.events().end());
    heard.spikes.insert(heard.spikes.end(), detector.spikes().begin(), detector.spikes().end());
    if (const auto a = detector.take_answer()) heard.answers.push_back(*a);
  };
  for (std::size_t at = 0; at < samples.size(); at += in_blocks_of) {
    while (!pulses.empty() && pulses.front() < at + in_blocks_of) {
      detector.stimulus(pulses.front(), 1);
      pulses.erase(pulses.begin());
    }
    detector.take(at, std::span(samples).subspan(at, std::min(in_blocks_of, samples.size() - at)));
    take();
  }
  detector.end();
  take();
  return heard;
}
void beat(std::vector<std::int16_t>& samples, std::size_t from, int times, std::size_t every, int bits) {
  for (int n = 0; n < times; ++n) samples[from + static_cast<std::size_t>(n) * every] = static_cast<std::int16_t>(bits);
}

TEST(Activity, ByHowLongItGoesOn) {
  std::vector<std::int16_t> samples(3 * 30000, 0);
  beat(samples, 15000, 10, 600, 600);   // 150 uV, 0.18 s
  beat(samples, 45000, 90, 300, -800);  // 200 uV, 0.89 s
  beat(samples, 84000, 3, 600, 399);    // 99.75 uV: below
  const Heard h = hear(samples);
  ASSERT_NE(h.find(MonitorEventKind::burst), nullptr);
  ASSERT_NE(h.find(MonitorEventKind::train), nullptr);
  EXPECT_NEAR(h.find(MonitorEventKind::burst)->seconds, 0.18, 0.001);
  EXPECT_EQ(h.find(MonitorEventKind::burst)->uv, 150);
  EXPECT_EQ(h.find(MonitorEventKind::burst)->sample, 15000u);
  EXPECT_EQ(h.find(MonitorEventKind::train)->sample, 45000u);
  EXPECT_NEAR(h.find(MonitorEventKind::train)->seconds, 0.5, 0.011);
  EXPECT_EQ(h.events.size(), 4u) << "two alarms, a burst, a train";
  EXPECT_EQ(h.spikes.size(), 10u + 90u);
  EXPECT_EQ(h.spikes[0].sample, 15000u);
  EXPECT_EQ(h.spikes[0].wave[MonitorSpike::kBefore], 600);
  // However it is cut into blocks.
  for (const std::size_t n : {1UL, 37UL, 1024UL}) {
    const Heard again = hear(samples, {}, n);
    ASSERT_EQ(again.events.size(), h.events.size());
    ASSERT_EQ(again.spikes.size(), h.spikes.size());
    for (std::size_t i = 0; i < h.spikes.size(); ++i) EXPECT_EQ(again.spikes[i].wave, h.spikes[i].wave);
  }
}

TEST(Activity, APulseIsNoActivityAndItsAnswerIsAnswered) {
  std::vector<std::int16_t> samples(30000, 0);
  beat(samples, 6000, 3, 1, 12000);   // artefact
  beat(samples, 6165, 3, 1, -1000);   // 250 uV, 5.5 ms later
  beat(samples, 18000, 3, 1, 12000);  // no answer
  const Heard h = hear(samples, {6000, 18000});
  ASSERT_EQ(h.answers, (std::vector<bool>{true, false}));
  EXPECT_EQ(h.find(MonitorEventKind::activity), nullptr);
  ASSERT_NE(h.find(MonitorEventKind::response), nullptr);
  EXPECT_NEAR(h.find(MonitorEventKind::response)->ms, 5.5, 0.05);
  EXPECT_EQ(h.find(MonitorEventKind::response)->uv, 250);
  EXPECT_TRUE(h.spikes.empty());
}

TEST(Activity, MissingTimeClosesWhatWentOn) {
  ActivityDetector detector(setup().constants, 1);
  std::vector<std::int16_t> block(kBlock, 0);
  block[20] = 600;
  detector.take(0, block);
  block[20] = 0;
  detector.take(30000, block);
  ASSERT_FALSE(detector.events().empty());
  EXPECT_EQ(detector.events().front().kind, MonitorEventKind::burst);
}

template <class T>
T at(const std::string& bytes, std::size_t where) {
  T v;
  std::memcpy(&v, bytes.data() + where, sizeof v);
  return v;
}

// By the layout of the files; tests/readers reads them with neo.
TEST(BlackrockFiles, HoldWhatCame) {
  const test::ScratchFolder scratch;
  const std::vector<std::string> labels{"orbicularis oculi", "oris"};
  BlackrockFiles files(scratch / "", "monitor", labels, setup().constants);
  std::vector<std::int16_t> block(2 * kBlock);
  for (std::size_t i = 0; i < block.size(); ++i) block[i] = static_cast<std::int16_t>(i);
  for (std::uint64_t b = 0; b < 40; ++b) {
    files.block({b * kBlock, 2, block});
    if (b == 3) {
      MonitorSpike spike;
      spike.channel = 1;
      spike.sample = 500;
      spike.wave[MonitorSpike::kBefore] = 444;
      files.spike(spike);
      MonitorEvent e;  // known later, came before
      e.kind = MonitorEventKind::response;
      e.sample = 450;
      e.ma = 1.5;
      files.event(e);
    }
  }
  files.close();
  const std::string ns5 = read_text(scratch / "monitor.ns5"), nev = read_text(scratch / "monitor.nev");
  EXPECT_EQ(ns5.substr(0, 8), "NEURALCD");
  const auto header = at<std::uint32_t>(ns5, 10);
  EXPECT_EQ(header, 314u + 2 * 66u);
  EXPECT_EQ(at<std::uint32_t>(ns5, header + 5), 40 * kBlock);
  EXPECT_EQ(ns5.size(), header + 9 + 40 * kBlock * 4);
  EXPECT_EQ(at<std::int16_t>(ns5, header + 9 + 2 * 7), 7);
  EXPECT_EQ(nev.substr(0, 8), "NEURALEV");
  const auto first = at<std::uint32_t>(nev, 12);
  EXPECT_EQ(nev.size(), first + 2 * 104u);
  EXPECT_EQ(at<std::uint32_t>(nev, first), 450u) << "by time";
  EXPECT_EQ(at<std::uint16_t>(nev, first + 8), 1500 | 0x8000);
  EXPECT_EQ(at<std::uint16_t>(nev, first + 104 + 4), 2);
  EXPECT_EQ(at<std::int16_t>(nev, first + 104 + 8 + 20), 444);
}

}  // namespace
}  // namespace osteo
