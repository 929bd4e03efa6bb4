#include "monitor_screen.h"

#include <algorithm>

namespace osteo::inline app {
namespace {

constexpr std::size_t kUsualGain = 4;  // 500 uV
constexpr double kSameBurstS = 0.03;   // what several channels hear within that is one burst

double uv_of(std::int16_t bits) {
  return bits * MonitorSetup::kMicrovoltsPerBit;
}

}  // namespace

MonitorScreen::MonitorScreen(const MonitorSetup& setup, const MonitorWiring& wiring)
    : wiring_(wiring), gains_(wiring.channels.size(), kUsualGain) {
  now_.labels = wiring.labels();
  now_.event_uv = setup.constants.event_uv;
  now_.sweep.assign(wiring.channels.size(), std::vector<Bin>(kBins));
  now_.traces.resize(wiring.channels.size());
}

void MonitorScreen::block(const MonitorBlock& block) {
  const std::lock_guard lock(mutex_);
  const std::size_t n = block.samples();
  for (std::size_t ch = 0; ch < block.channels && ch < now_.sweep.size(); ++ch) {
    std::int16_t least = INT16_MAX, most = INT16_MIN;
    for (std::size_t i = 0; i < n; ++i) {
      const std::int16_t v = block.values[i * block.channels + ch];
      least = std::min(least, v);
      most = std::max(most, v);
    }
    now_.sweep[ch][now_.at] = {static_cast<float>(uv_of(least)), static_cast<float>(uv_of(most))};
    // The newest traces belong to the pulses that are waited for, in their order.
    std::vector<Trace>& traces = now_.traces[ch];
    for (std::size_t p = 0; p < pulses_.size() && p < traces.size(); ++p) {
      Trace& trace = traces[traces.size() - pulses_.size() + p];
      for (std::size_t i = 0; i < n && trace.uv.size() < kTraceSamples; ++i) {
        if (block.first_sample + i >= pulses_[p])
          trace.uv.push_back(static_cast<float>(uv_of(block.values[i * block.channels + ch])));
      }
    }
  }
  std::erase_if(pulses_, [&](std::uint64_t p) { return block.first_sample + n >= p + kTraceSamples; });
  now_.at = (now_.at + 1) % kBins;
  now_.now_s = static_cast<double>(block.first_sample + n) / MonitorSetup::kRateHz;
}

void MonitorScreen::write(double at_s, std::string words, bool alarm) {
  log_.push_back({at_s, std::move(words), alarm});
  if (log_.size() > kLines) log_.pop_front();
  ++lines_;
}

void MonitorScreen::event(const MonitorEvent& e) {
  const std::lock_guard lock(mutex_);
  const double at_s = static_cast<double>(e.sample) / MonitorSetup::kRateHz;
  switch (e.kind) {
    case MonitorEventKind::activity:
      alarm_until_s_ = at_s + kAlarmS;
      return;
    case MonitorEventKind::cause:
      return;  // a monitor cannot know
    case MonitorEventKind::burst:
    case MonitorEventKind::train: {
      const bool train = e.kind == MonitorEventKind::train;
      if (train) alarm_until_s_ = at_s + e.seconds + kAlarmS;
      // The channel that hears it loudest speaks for all of them.
      if (!train && burst_s_ >= 0 && std::abs(at_s - burst_s_) < kSameBurstS && !log_.empty()) {
        if (e.uv <= burst_uv_) return;
        log_.pop_back();
        --lines_;
      }
      burst_s_ = train ? -1 : at_s;
      burst_uv_ = e.uv;
      write(at_s, words_of(e, wiring_), train);
      return;
    }
    case MonitorEventKind::stimulus:
      for (auto& traces : now_.traces) {
        if (traces.size() == kTraces) traces.erase(traces.begin());
        traces.push_back({e.ma, false, false, {}});
      }
      if (pulses_.size() == kTraces) pulses_.erase(pulses_.begin());
      pulses_.push_back(e.sample);
      return;
    case MonitorEventKind::response:
    case MonitorEventKind::no_response:
      for (auto& traces : now_.traces) {
        for (Trace& t : traces) {
          if (t.judged) continue;
          t.judged = true;
          t.answered = e.kind == MonitorEventKind::response;
          break;
        }
      }
      if (burst_s_ >= 0) burst_s_ = -1;
      write(at_s, words_of(e, wiring_), false);
      return;
    case MonitorEventKind::threshold:
      threshold_ma_ = e.ma;
      break;
    default:
      break;
  }
  burst_s_ = -1;
  write(at_s, words_of(e, wiring_), e.kind == MonitorEventKind::lost);
}

MonitorScreen::View MonitorScreen::view() const {
  const std::lock_guard lock(mutex_);
  return kept_.frozen ? kept_ : now_;
}

std::vector<MonitorScreen::Line> MonitorScreen::log() const {
  const std::lock_guard lock(mutex_);
  return {log_.begin(), log_.end()};
}

bool MonitorScreen::alarm() const {
  const std::lock_guard lock(mutex_);
  return now_.now_s < alarm_until_s_;
}

std::size_t MonitorScreen::events() const {
  const std::lock_guard lock(mutex_);
  return lines_;
}

std::optional<double> MonitorScreen::threshold_ma() const {
  const std::lock_guard lock(mutex_);
  return threshold_ma_;
}

void MonitorScreen::freeze(bool on) {
  const std::lock_guard lock(mutex_);
  if (on && !kept_.frozen) kept_ = now_;
  kept_.frozen = on;
}

bool MonitorScreen::frozen() const {
  const std::lock_guard lock(mutex_);
  return kept_.frozen;
}

void MonitorScreen::change_gain(std::size_t channel, int steps) {
  if (channel >= gains_.size()) return;
  const auto last = static_cast<int>(kGains.size()) - 1;
  gains_[channel] = static_cast<std::size_t>(std::clamp(static_cast<int>(gains_[channel]) + steps, 0, last));
}

}  // namespace osteo::inline app
