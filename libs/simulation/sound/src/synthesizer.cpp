#include "osteo/simulation/sound/synthesizer.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "osteo/core/base/portable_math.h"

namespace osteo::inline simulation {
namespace {

constexpr double kRate = Synthesizer::kRateHz;
constexpr double kRough = 0.3;  // of the noise's amplitude that turns with the burr

/// Below half of full scale as it is, above it bent so that it never reaches full scale.
double soft_clip(double x) noexcept {
  const double a = std::abs(x);
  if (a <= 0.5) return x;
  const double over = (a - 0.5) / 0.5;
  return std::copysign(0.5 + 0.5 * over / (1 + over), x);
}

}  // namespace

// Butterworth by the bilinear transform, orders 2, 4, 6.
void Synthesizer::Filter::low_pass(double hz, int order) {
  const portable::SinCos w = portable::sin_cos_turns(hz / kRate);
  for (int k = 0; k < order / 2; ++k) {
    const double q = 1 / (2 * portable::sin_cos_turns((2 * k + 1) / (4.0 * order)).cos);
    const double alpha = w.sin / (2 * q), a0 = 1 + alpha;
    sections[count++] = {
        (1 - w.cos) / 2 / a0, (1 - w.cos) / a0, (1 - w.cos) / 2 / a0, -2 * w.cos / a0, (1 - alpha) / a0, 0, 0};
  }
}

void Synthesizer::Filter::high_pass(double hz, int order) {
  const portable::SinCos w = portable::sin_cos_turns(hz / kRate);
  for (int k = 0; k < order / 2; ++k) {
    const double q = 1 / (2 * portable::sin_cos_turns((2 * k + 1) / (4.0 * order)).cos);
    const double alpha = w.sin / (2 * q), a0 = 1 + alpha;
    sections[count++] = {
        (1 + w.cos) / 2 / a0, -(1 + w.cos) / a0, (1 + w.cos) / 2 / a0, -2 * w.cos / a0, (1 - alpha) / a0, 0, 0};
  }
}

void Synthesizer::Filter::settle() {
  double power = 0;
  for (int i = 0; i < 8192; ++i) {
    const double y = (*this)(i == 0 ? 1 : 0);
    power += y * y;
  }
  gain = 1 / std::sqrt(power);
  for (Section& s : sections) s.z1 = s.z2 = 0;
}

double Synthesizer::Filter::operator()(double x) noexcept {
  for (std::size_t i = 0; i < count; ++i) {
    Section& s = sections[i];
    const double y = s.b0 * x + s.z1;
    s.z1 = s.b1 * x - s.a1 * y + s.z2;
    s.z2 = s.b2 * x - s.a2 * y;
    x = y;
  }
  return x * gain;
}

Synthesizer::Synthesizer(const SoundModel& model, std::uint64_t seed, const SafeLevel& safe)
    : model_(model), safe_(safe), random_(seed * 0x9e3779b97f4a7c15ULL + 1) {
  for (Burr& b : burrs_) {
    b.bright_filter.high_pass(700, 2);
    b.bright_filter.low_pass(4600, 6);
    b.bright_filter.settle();
    b.dull_filter.high_pass(400, 2);
    b.dull_filter.low_pass(1600, 6);
    b.dull_filter.settle();
  }
  for (std::size_t i = 0; i < SoundState::kMaxVoices; ++i) {
    suckers_[i].filter.high_pass(400, 2);
    suckers_[i].filter.low_pass(6000, 2);
    suckers_[i].filter.settle();
    irrigators_[i].filter.high_pass(2500, 2);
    irrigators_[i].filter.low_pass(9000, 2);
    irrigators_[i].filter.settle();
  }
}

double Synthesizer::amplitude(double db) const noexcept {
  return db <= -199 ? 0 : portable::exp((db - model_.full_scale_db) * (portable::log(10) / 20));
}

double Synthesizer::uniform() noexcept {
  random_ ^= random_ << 13;
  random_ ^= random_ >> 7;
  random_ ^= random_ << 17;
  return static_cast<double>(random_ >> 11) * 0x1p-53;
}

double Synthesizer::noise() noexcept {
  return (uniform() - 0.5) * 3.4641016151377544;  // sqrt(12)
}

void Synthesizer::start_ring(double hz, double rise, double level, double decay_s) noexcept {
  const double decay = portable::exp(-1 / (decay_s * kRate));
  rings_[next_ring_] = {0, hz, portable::exp(portable::log(rise) / (decay_s * kRate)), level, decay, 0};
  next_ring_ = (next_ring_ + 1) % rings_.size();
}

void Synthesizer::plan(const SoundState& to, double samples) noexcept {
  gurgles_per_sample_ = gurgle_level_ = 0;
  const double water = std::isfinite(to.water) ? std::clamp(to.water, 0.0, 1.0) : 0;
  for (std::size_t v = 0; v < SoundState::kMaxVoices; ++v) {
    const SoundVoice& voice = to.voices[v];
    const BurrSpectrum s = burr_spectrum(voice, model_);
    Burr& b = burrs_[v];
    if (!b.sounds) b.hz.goal = s.rotation_hz;  // from silence: at once at its height
    // Towards silence the pitch stays where it was.
    b.hz.to(s.rotation_hz > 0 ? s.rotation_hz : b.hz.goal, samples);
    b.sounds = s.rotation_hz > 0;
    for (std::size_t k = 0; k < BurrSpectrum::kLines; ++k) {
      b.lines[k].to(amplitude(s.lines[k].db) * std::numbers::sqrt2, samples);
      b.sounds = b.sounds || b.lines[k].now > 0;
    }
    const double noise = amplitude(s.noise_db);
    b.bright.to(noise * std::sqrt(1 - s.softness), samples);
    b.dull.to(noise * std::sqrt(s.softness), samples);

    const double drawn = suction_db(voice, water, model_);
    suckers_[v].level.to(amplitude(drawn), samples);
    if (drawn > -199) {
      gurgles_per_sample_ += model_.gurgles_per_s * 4 * water * (1 - water) / kRate;
      gurgle_level_ = std::max(gurgle_level_, amplitude(drawn + 6));
      // From air to water and back: a bang.
      if ((water > 0.5) != (water_ > 0.5)) start_ring(220, 1.6, 2 * amplitude(drawn + 8), 0.02);
    }
    const bool wets = voice.kind == SoundKind::irrigator && voice.draws > 0.001;
    irrigators_[v].level.to(wets ? amplitude(model_.irrigation_db) * std::clamp(voice.draws, 0.0, 1.0) : 0, samples);
  }
  water_ = water;

  const double metal = std::isfinite(to.metal_n) ? to.metal_n : 0;
  if (metal > 0.05 && metal_n_ <= 0.05 && sample_ >= metal_sample_) {
    const double level = amplitude(model_.metal_db) * std::sqrt(std::min(metal, 10.0));
    start_ring(1130, 1, level, 0.06);
    start_ring(2870, 1, 0.6 * level, 0.04);
    start_ring(5230, 1, 0.35 * level, 0.025);
    metal_sample_ = sample_ + static_cast<std::uint64_t>(0.08 * kRate);
  }
  metal_n_ = metal;

  if (to.alarm != alarm_) {
    // A beep that sounds is let down before another begins.
    if (beep_.level.now == 0) {
      alarm_ = to.alarm;
      beep_.sample = 0;
    }
  }
}

double Synthesizer::burr(Burr& b) noexcept {
  b.phase += b.hz.next() / kRate;
  b.phase -= std::floor(b.phase);
  const portable::SinCos turn = portable::sin_cos_turns(b.phase);
  const portable::SinCos tooth = portable::sin_cos_turns(b.phase * model_.teeth);
  double sum = b.lines[0].next() * turn.sin + b.lines[1].next() * 2 * turn.sin * turn.cos;
  // sin(k + 1) = 2 cos sin(k) - sin(k - 1)
  double before = 0, now = tooth.sin;
  for (std::size_t k = BurrSpectrum::kRotationLines; k < BurrSpectrum::kLines; ++k) {
    sum += b.lines[k].next() * now;
    const double next = 2 * tooth.cos * now - before;
    before = now;
    now = next;
  }
  const double n = noise(), rough = (1 + kRough * turn.sin) / std::sqrt(1 + kRough * kRough / 2);
  return sum + rough * (b.bright.next() * b.bright_filter(n) + b.dull.next() * b.dull_filter(n));
}

void Synthesizer::render(const SoundState& to, double volume, std::span<float> out) noexcept {
  if (out.empty()) return;
  const auto samples = static_cast<double>(out.size());
  plan(to, samples);
  volume_.to(std::isfinite(volume) ? std::clamp(volume, 0.0, 1.0) : 0, samples);
  const double keep = portable::exp(-1 / (safe_.over_s * kRate)),
               most = portable::exp(safe_.most_db * (portable::log(10) / 10));
  for (float& sample : out) {
    double x = 0;
    for (Burr& b : burrs_) {
      if (b.sounds) x += burr(b);
    }
    for (auto* const waters : {&suckers_, &irrigators_}) {
      for (Water& w : *waters) {
        if (w.level.goal == 0 && w.level.step == 0) continue;
        x += w.level.next() * w.filter(noise());
      }
    }
    if (gurgles_per_sample_ > 0 && uniform() < gurgles_per_sample_)
      start_ring(300 + 500 * uniform(), 1.8, gurgle_level_ * (0.5 + uniform()), 0.012 + 0.02 * uniform());
    for (Ring& r : rings_) {
      if (r.level < 1e-7) continue;
      r.attack = std::min(1.0, r.attack + 1 / (0.001 * kRate));
      r.phase += r.hz / kRate;
      x += r.attack * r.level * portable::sin_cos_turns(r.phase - std::floor(r.phase)).sin;
      r.hz *= r.rise;
      r.level *= r.decay;
    }
    // Touched: a beep of 150 ms each 600 ms; injured: two heights in turn, without a pause between.
    if (alarm_ != SoundAlarm::none || beep_.level.now > 0) {
      const bool injured = alarm_ == SoundAlarm::injured;
      const auto period = static_cast<std::uint64_t>((injured ? 0.3 : 0.6) * kRate), within = beep_.sample % period;
      const auto on = static_cast<std::uint64_t>(0.13 * kRate);
      const bool loud = alarm_ != SoundAlarm::none && within < on;
      const double hz = injured && (beep_.sample / period) % 2 == 1 ? 1320 : 880;
      // Height changes only where it is silent.
      if (beep_.level.now == 0) beep_.hz.now = hz;
      const double target = loud ? amplitude(model_.alarm_db) * std::numbers::sqrt2 : 0, rate = 1 / (0.01 * kRate);
      const double full = amplitude(model_.alarm_db) * std::numbers::sqrt2;
      beep_.level.now =
          loud ? std::min(target, beep_.level.now + full * rate) : std::max(0.0, beep_.level.now - full * rate);
      beep_.phase += beep_.hz.now / kRate;
      beep_.phase -= std::floor(beep_.phase);
      x += beep_.level.now * portable::sin_cos_turns(beep_.phase).sin;
      ++beep_.sample;
    }
    x *= volume_.next();
    power_ = power_ * keep + x * x * (1 - keep);
    if (power_ > most) x *= std::sqrt(most / power_);
    sample = static_cast<float>(soft_clip(x));
    ++sample_;
  }
}

double Synthesizer::held_down_db() const noexcept {
  const double most = portable::exp(safe_.most_db * (portable::log(10) / 10));
  return power_ > most ? 10 * portable::log(most / power_) / portable::log(10) : 0;
}

}  // namespace osteo::inline simulation
