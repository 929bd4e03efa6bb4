#include "osteo/simulation/nerve/activity.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace osteo::inline simulation {
namespace {

constexpr std::size_t kAfter = MonitorSpike::kLength - MonitorSpike::kBefore;

int bits_of(double uv) {
  return static_cast<int>(std::ceil(uv / MonitorSetup::kMicrovoltsPerBit));
}
double uv_of(int bits) {
  return bits * MonitorSetup::kMicrovoltsPerBit;
}
std::uint64_t samples_of(double seconds) {
  return static_cast<std::uint64_t>(seconds * MonitorSetup::kRateHz);
}

}  // namespace

std::string_view name_of(MonitorEventKind kind) {
  static constexpr std::array<std::string_view, 11> kNames{"activity",   "burst",       "train",     "stimulus",
                                                           "response",   "no response", "threshold", "no threshold",
                                                           "stimulator", "cause",       "lost"};
  return kNames[static_cast<std::size_t>(kind)];
}

ActivityDetector::ActivityDetector(const MonitorConstants& constants, std::size_t channels)
    : c_(constants),
      channels_(channels),
      event_bits_(bits_of(constants.event_uv)),
      response_bits_(bits_of(constants.response_uv)),
      gap_(samples_of(constants.event_gap_ms / 1000)),
      train_(samples_of(constants.train_from_s)),
      from_(samples_of(constants.response_from_ms / 1000)),
      to_(samples_of(constants.response_to_ms / 1000)),
      states_(channels) {}

void ActivityDetector::stimulus(std::uint64_t sample, double current_ma) {
  pulses_.push_back({sample, current_ma});
}

std::optional<bool> ActivityDetector::take_answer() {
  return std::exchange(answer_, std::nullopt);
}

void ActivityDetector::conclude() {
  if (!pulse_) return;
  MonitorEvent e;
  e.kind = answer_channel_ >= 0 ? MonitorEventKind::response : MonitorEventKind::no_response;
  e.sample = pulse_->sample;
  e.ma = pulse_->ma;
  e.channel = answer_channel_;
  if (answer_channel_ >= 0) {
    e.uv = uv_of(answer_bits_);
    e.ms = 1000.0 * static_cast<double>(answer_sample_ - pulse_->sample) / MonitorSetup::kRateHz;
  }
  events_.push_back(e);
  answer_ = answer_channel_ >= 0;
  pulse_.reset();
}

void ActivityDetector::close(std::size_t channel) {
  State& s = states_[channel];
  if (!s.active) return;
  s.active = false;
  if (s.train) return;
  MonitorEvent e;
  e.kind = MonitorEventKind::burst;
  e.sample = s.first;
  e.channel = static_cast<int>(channel);
  e.seconds = static_cast<double>(s.last - s.first + 1) / MonitorSetup::kRateHz;
  e.uv = uv_of(s.largest);
  events_.push_back(e);
}

void ActivityDetector::frame(std::uint64_t sample, const std::int16_t* values) {
  if (!pulses_.empty() && pulses_.front().sample <= sample) {
    conclude();
    pulse_ = pulses_.front();
    pulses_.erase(pulses_.begin());
    answer_bits_ = 0;
    answer_channel_ = -1;
  }
  const std::uint64_t since = pulse_ ? sample - pulse_->sample : to_;
  if (pulse_ && since >= to_) conclude();
  for (std::size_t ch = 0; ch < channels_; ++ch) {
    const int size = std::abs(static_cast<int>(values[ch]));
    State& s = states_[ch];
    if (pulse_) {
      // What comes now is the pulse's: the artefact first, then the answer.
      if (since >= from_ && size >= response_bits_) {
        if (answer_channel_ < 0) answer_sample_ = sample;
        if (size > answer_bits_) {
          answer_bits_ = size;
          answer_channel_ = static_cast<int>(ch);
        }
      }
      continue;
    }
    if (size < event_bits_) {
      if (s.active && sample - s.last > gap_) close(ch);
      continue;
    }
    if (!s.active) {
      s = {true, false, sample, sample, s.deaf_until, 0};
      MonitorEvent e;
      e.sample = sample;
      e.channel = static_cast<int>(ch);
      e.uv = uv_of(size);
      events_.push_back(e);
    }
    s.last = sample;
    s.largest = std::max(s.largest, size);
    if (!s.train && s.last - s.first >= train_) {
      s.train = true;
      MonitorEvent e;
      e.kind = MonitorEventKind::train;
      e.sample = s.first;
      e.channel = static_cast<int>(ch);
      e.seconds = static_cast<double>(s.last - s.first) / MonitorSetup::kRateHz;
      e.uv = uv_of(s.largest);
      events_.push_back(e);
    }
    if (sample >= s.deaf_until) {
      s.deaf_until = sample + MonitorSpike::kLength;
      MonitorSpike spike;
      spike.channel = static_cast<int>(ch);
      spike.sample = sample;
      const std::int16_t* const first = values - MonitorSpike::kBefore * channels_;
      for (std::size_t i = 0; i < MonitorSpike::kLength; ++i) spike.wave[i] = first[i * channels_ + ch];
      spikes_.push_back(spike);
    }
  }
}

void ActivityDetector::take(std::uint64_t first, std::span<const std::int16_t> block) {
  events_.clear();
  spikes_.clear();
  if (channels_ == 0) return;
  const std::uint64_t held = begun_ ? buffer_.size() / channels_ - MonitorSpike::kBefore : 0;
  if (!begun_ || next_ + held != first) {  // time is missing: what was before has nothing to do with this
    for (std::size_t ch = 0; begun_ && ch < channels_; ++ch) close(ch);
    if (begun_) conclude();
    buffer_.assign(MonitorSpike::kBefore * channels_, 0);
    for (State& s : states_) s = {};
    std::erase_if(pulses_, [&](const Pulse& p) { return p.sample < first; });
    next_ = first;
    begun_ = true;
  }
  buffer_.insert(buffer_.end(), block.begin(), block.end());
  const std::size_t frames = buffer_.size() / channels_;
  std::size_t at = MonitorSpike::kBefore;
  for (; at + kAfter <= frames; ++at) frame(next_++, &buffer_[at * channels_]);
  buffer_.erase(buffer_.begin(),
                buffer_.begin() + static_cast<std::ptrdiff_t>((at - MonitorSpike::kBefore) * channels_));
}

void ActivityDetector::end() {
  events_.clear();
  spikes_.clear();
  conclude();
  for (std::size_t ch = 0; ch < channels_; ++ch) close(ch);
}

}  // namespace osteo::inline simulation
