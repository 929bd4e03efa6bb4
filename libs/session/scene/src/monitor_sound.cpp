#include "osteo/session/scene/monitor_sound.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "osteo/core/base/portable_math.h"
#include "osteo/simulation/sound/synthesizer.h"

namespace osteo::inline session {
namespace {

constexpr auto kBegins =
    static_cast<std::size_t>(0.01 * MonitorSetup::kRateHz);  // waits before it is played: blocks come every 5 ms
constexpr auto kMax = static_cast<std::size_t>(MonitorSound::kMaxWaitingS * MonitorSetup::kRateHz);

constexpr std::size_t kRing = 8192;  // a power of two: then a ring has exactly that room
static_assert(kRing >= 4 * kMax);

}  // namespace

MonitorSound::MonitorSound() : waiting_(kRing) {
  samples_.reserve(2048);
}

void MonitorSound::block(const MonitorBlock& block) {
  const std::size_t n = block.samples();
  if (n == 0) return;
  const int wanted = channel_.load(std::memory_order_relaxed);
  auto heard = static_cast<std::size_t>(std::max(0, wanted));
  if (wanted < 0) {
    int largest = -1;
    for (std::size_t ch = 0; ch < block.channels; ++ch) {
      int peak = 0;
      for (std::size_t i = 0; i < n; ++i)
        peak = std::max(peak, std::abs(static_cast<int>(block.values[i * block.channels + ch])));
      if (peak > largest) {
        largest = peak;
        heard = ch;
      }
    }
  }
  if (heard >= block.channels) return;
  samples_.clear();
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint64_t at = block.first_sample + i;
    const bool blank = at >= blank_from_ && at < blank_until_;
    const auto uv = static_cast<float>(block.values[i * block.channels + heard] * MonitorSetup::kMicrovoltsPerBit);
    samples_.push_back(blank ? 0.0F : uv / kFullScaleUv);
  }
  waiting_.push(samples_);  // no room: nobody listens
}

void MonitorSound::event(const MonitorEvent& event) {
  if (event.kind == MonitorEventKind::activity) tones_.fetch_add(1, std::memory_order_relaxed);
  if (event.kind != MonitorEventKind::stimulus) return;
  blank_from_ = event.sample;
  blank_until_ = event.sample + static_cast<std::uint64_t>(kBlankingS * MonitorSetup::kRateHz);
}

void MonitorSound::mix(std::span<float> out) noexcept {
  const bool muted = muted_.load(std::memory_order_relaxed);
  const float volume = muted ? 0.0F : std::clamp(volume_.load(std::memory_order_relaxed), 0.0F, 1.0F);
  const std::uint32_t tones = tones_.load(std::memory_order_relaxed);
  if (tones != tones_heard_) tone_left_ = static_cast<int>(kToneS * Synthesizer::kRateHz);
  tones_heard_ = tones;

  const auto more = [&] {
    if (taken_at_ == taken_size_) {
      taken_at_ = 0;
      taken_size_ = waiting_.pop(taken_);
    }
    return taken_at_ < taken_size_;
  };
  const auto waits = [&] { return kRing - waiting_.room(); };
  // What came while nobody asked is old.
  while (waits() > kMax) {
    taken_at_ = 0;
    taken_size_ = waiting_.pop(taken_);
    if (taken_size_ == 0) break;
    taken_at_ = taken_size_;
  }
  primed_ = primed_ || waits() >= kBegins;
  constexpr float kStep = static_cast<float>(MonitorSetup::kRateHz) / Synthesizer::kRateHz;
  constexpr float kTurn = kToneHz / Synthesizer::kRateHz;
  for (float& o : out) {
    float v = 0;
    if (primed_) {
      at_ += kStep;
      while (at_ >= 1) {
        at_ -= 1;
        last_ = next_;
        if (!more()) {
          primed_ = false;
          next_ = 0;
          break;
        }
        next_ = taken_[taken_at_++];
      }
      v = 0.5F * (last_ + (next_ - last_) * std::min(at_, 1.0F));
    }
    if (tone_left_ > 0) {
      // Fades in and out over 2 ms.
      const int whole = static_cast<int>(kToneS * Synthesizer::kRateHz), edge = 96;
      const float fade =
          std::min({1.0F, static_cast<float>(whole - tone_left_ + 1) / edge, static_cast<float>(tone_left_) / edge});
      v += 0.25F * fade * static_cast<float>(portable::sin_cos_turns(static_cast<double>(tone_phase_)).sin);
      tone_phase_ += kTurn;
      if (tone_phase_ >= 1) tone_phase_ -= 1;
      --tone_left_;
    }
    o = std::clamp(o + volume * std::clamp(v, -0.8F, 0.8F), -1.0F, 1.0F);
  }
}

}  // namespace osteo::inline session
