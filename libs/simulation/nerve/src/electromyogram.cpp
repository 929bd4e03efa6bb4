#include "osteo/simulation/nerve/electromyogram.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/portable_math.h"

namespace osteo::inline simulation {
namespace {

constexpr double kRate = MonitorSetup::kRateHz;
constexpr std::size_t kRing = 4096;  // 137 ms: longer than any latency and wave
constexpr std::size_t kSine = 1024;
constexpr double kSpikeMs = 4;

// Down, up, down: the second derivative of a bell, 1 at its middle.
std::vector<float> triphasic(double ms) {
  std::vector<float> wave(static_cast<std::size_t>(ms * kRate / 1000));
  for (std::size_t i = 0; i < wave.size(); ++i) {
    const double u = 8 * ((static_cast<double>(i) + 0.5) / static_cast<double>(wave.size()) - 0.5);
    wave[i] = static_cast<float>((1 - u * u) * portable::exp(-u * u / 2));
  }
  return wave;
}

}  // namespace

Electromyogram::Electromyogram(const MonitorConstants& constants, std::vector<Channel> channels, std::uint64_t seed)
    : c_(constants),
      channels_(std::move(channels)),
      spike_(triphasic(kSpikeMs)),
      evoked_(triphasic(constants.evoked_ms)),
      coming_(channels_.size(), std::vector<float>(kRing, 0.0F)),
      filtered_(channels_.size(), 0.0F),
      jitter_(seed ^ 0x5851f42d4c957f2dULL) {
  for (std::size_t i = 0; i <= kSine; ++i)
    sine_.push_back(static_cast<float>(portable::sin_cos_turns(static_cast<double>(i) / kSine).sin));
  // A wave of whole samples: 600 at 50 Hz; with a fifth of its third harmonic.
  const auto period = static_cast<std::size_t>(std::max(1.0, std::floor(kRate / c_.mains_hz + 0.5)));
  for (std::size_t i = 0; i < period; ++i) {
    const double turns = static_cast<double>(i) / static_cast<double>(period);
    mains_.push_back(static_cast<float>(
        c_.mains_uv * (portable::sin_cos_turns(turns).sin + 0.2 * portable::sin_cos_turns(3 * turns).sin)));
  }
  // The pulse itself is over in 0.1 ms; what is left of it in the amplifier falls off.
  for (std::size_t i = 0; i < static_cast<std::size_t>(10 * c_.artefact_ms * kRate / 1000) + 3; ++i) {
    const double ms = 1000 * static_cast<double>(i) / kRate;
    artefact_.push_back(static_cast<float>(ms < 0.1 ? 1.0 : -0.6 * portable::exp(-(ms - 0.1) / c_.artefact_ms)));
  }
  for (std::size_t ch = 0; ch < channels_.size(); ++ch) noise_.emplace_back(seed * 64 + ch + 1);
}

// `at` in samples from the next block's first.
void Electromyogram::add_wave(std::size_t channel, double at, const std::vector<float>& wave, double uv) {
  const auto first = static_cast<std::size_t>(std::max(0.0, at));
  if (first + wave.size() + kMaxSamples > kRing) return;
  std::vector<float>& ring = coming_[channel];
  const auto gain = static_cast<float>(uv);
  for (std::size_t i = 0; i < wave.size(); ++i) ring[(now_ + first + i) % kRing] += gain * wave[i];
}

double Electromyogram::delay(const Channel& channel, const NerveModel& model, std::size_t point) const {
  const double way_ms = model.courses()[channel.nerve].points[point].to_distal_mm / c_.conduction_m_per_s;
  return (channel.electrode.latency_ms + way_ms) * kRate / 1000;
}

void Electromyogram::stimulate(std::size_t at, double current_ma) {
  for (std::size_t ch = 0; ch < channels_.size(); ++ch)
    add_wave(ch, static_cast<double>(at), artefact_, c_.artefact_uv * current_ma * (ch % 2 == 0 ? 1 : -0.8));
}

void Electromyogram::answer(std::size_t at, const NerveModel& model, std::size_t nerve, std::size_t point,
                            double share) {
  if (share <= 0) return;
  for (std::size_t ch = 0; ch < channels_.size(); ++ch) {
    const Channel& channel = channels_[ch];
    if (channel.nerve == nerve)
      add_wave(ch, static_cast<double>(at) + delay(channel, model, point), evoked_,
               share * channel.electrode.evoked_uv);
  }
}

void Electromyogram::render(const NerveModel& model, const DrillNoise& drill, std::span<std::int16_t> out) {
  const std::size_t n = channels_.empty() ? 0 : out.size() / channels_.size();
  if (n == 0 || n > kMaxSamples) return;
  block_.assign(out.size(), 0.0F);  // channel by channel

  for (auto& [id, voice] : voices_) voice.seen = false;
  for (const NerveModel::Discharge& d : model.discharges()) {
    Voice& voice = voices_.try_emplace(d.id, Voice{d.train ? 0.0 : 1.0, 0, true})
                       .first->second;  // a burst's first spike comes at once
    voice.seen = true;
    const double reaches = model.conducts(d.nerve, d.point), step = d.hz / kRate;
    if (d.train) {
      const double goal = d.uv * reaches, slope = (goal - voice.level) / static_cast<double>(n);
      for (std::size_t ch = 0; ch < channels_.size(); ++ch) {
        if (channels_[ch].nerve != d.nerve) continue;
        const auto share = static_cast<float>(channels_[ch].electrode.share);
        double phase = voice.phase, level = voice.level;
        float* const to = &block_[ch * n];
        for (std::size_t i = 0; i < n; ++i) {
          to[i] += share * static_cast<float>(level) * sine_[static_cast<std::size_t>(phase * kSine)];
          level += slope;
          phase += step;
          if (phase >= 1) phase -= 1;
        }
      }
      for (std::size_t i = 0; i < n; ++i) {
        voice.phase += step;
        if (voice.phase >= 1) voice.phase -= 1;
      }
      voice.level = goal;
    } else {
      // Spikes a little off their beat and size, as units fire.
      double at = (1 - voice.phase) / step;
      for (; at < static_cast<double>(n); at += (0.8 + 0.4 * jitter_.uniform()) / step) {
        const double size = d.uv * reaches * (0.8 + 0.4 * jitter_.uniform());
        for (std::size_t ch = 0; ch < channels_.size(); ++ch) {
          if (channels_[ch].nerve == d.nerve)
            add_wave(ch, at + delay(channels_[ch], model, d.point), spike_, size * channels_[ch].electrode.share);
        }
      }
      voice.phase = 1 - (at - static_cast<double>(n)) * step;
    }
  }
  for (auto it = voices_.begin(); it != voices_.end();) it = it->second.seen ? std::next(it) : voices_.erase(it);

  const bool turns = drill.rotation_hz > 0;
  const double line_goal = turns ? c_.drill_uv : 0;
  const double noise_goal = turns ? std::min(c_.drill_most_uv, drill.press_n * c_.drill_uv_per_n) : 0;
  const double line_slope = (line_goal - drill_line_) / static_cast<double>(n),
               noise_slope = (noise_goal - drill_noise_) / static_cast<double>(n);
  // One pole at noise_hz; its gain makes the noise as large as it is said to be.
  const double pole = 1 - portable::exp(-2 * 3.14159265358979323846 * c_.noise_hz / kRate);
  const auto a = static_cast<float>(pole);
  const auto whole = static_cast<float>(std::sqrt((2 - pole) / pole));
  const auto floor_uv = static_cast<float>(c_.noise_uv);
  const double drill_step = std::min(0.49, drill.rotation_hz / kRate);
  for (std::size_t ch = 0; ch < channels_.size(); ++ch) {
    float* const to = &block_[ch * n];
    float* const ring = coming_[ch].data();
    std::size_t mains_at = mains_at_;
    double phase = drill_phase_, line = drill_line_, contact = drill_noise_;
    float filtered = filtered_[ch];
    NerveRandom& random = noise_[ch];
    const float mains_share = ch % 2 == 0 ? 1.0F : 0.7F;
    for (std::size_t i = 0; i < n; ++i) {
      float& coming = ring[(now_ + i) % kRing];
      float v = to[i] + coming;
      coming = 0;
      const auto white = static_cast<float>(random.normal());
      const auto rough = static_cast<float>(contact);
      // Two sources that know nothing of each other: their powers add.
      filtered += a * (white * std::sqrt(floor_uv * floor_uv + rough * rough) * whole - filtered);
      v += filtered + mains_share * mains_[mains_at] +
           static_cast<float>(line) * sine_[static_cast<std::size_t>(phase * kSine)];
      if (++mains_at == mains_.size()) mains_at = 0;
      phase += drill_step;
      if (phase >= 1) phase -= 1;
      line += line_slope;
      contact += noise_slope;
      constexpr auto kBits = static_cast<float>(1 / MonitorSetup::kMicrovoltsPerBit);
      const float bits = std::clamp(v * kBits, static_cast<float>(-kLargest), static_cast<float>(kLargest));
      out[i * channels_.size() + ch] = static_cast<std::int16_t>(static_cast<int>(bits + 32768.5F) - 32768);
    }
    filtered_[ch] = filtered;
    if (ch + 1 == channels_.size()) {
      mains_at_ = mains_at;
      drill_phase_ = phase;
    }
  }
  drill_line_ = line_goal;
  drill_noise_ = noise_goal;
  now_ = (now_ + n) % kRing;
}

}  // namespace osteo::inline simulation
