#include "osteo/simulation/nerve/stimulator.h"

#include <algorithm>
#include <cmath>

#include "osteo/simulation/nerve/detail/monitor_setup.h"

namespace osteo::inline simulation {

StimulatorSetting within_range(StimulatorSetting s) {
  const auto finite = [](double x, double lo, double hi) { return std::isfinite(x) ? std::clamp(x, lo, hi) : lo; };
  s.current_ma = s.current_ma > 0 ? finite(s.current_ma, StimulatorSetting::kMinMa, StimulatorSetting::kMaxMa) : 0;
  s.pulses_per_s = finite(s.pulses_per_s, 1, 30);
  s.width_ms = finite(s.width_ms, 0.05, 1);
  return s;
}

ThresholdSearch::ThresholdSearch(double begin_ma)
    : current_ma_(std::clamp(begin_ma, StimulatorSetting::kMinMa, StimulatorSetting::kMaxMa)) {}

void ThresholdSearch::take(bool response) {
  if (done_) return;
  ++trials_;
  responses_ += response ? 1 : 0;
  if (trials_ < kTrials) return;
  (2 * responses_ > kTrials ? answers_ma_ : silent_ma_) = current_ma_;
  trials_ = responses_ = 0;
  if (silent_ma_ && answers_ma_) {
    done_ = *answers_ma_ <= 1.1 * *silent_ma_;
    current_ma_ = std::sqrt(*silent_ma_ * *answers_ma_);
  } else if (answers_ma_) {
    done_ = current_ma_ <= StimulatorSetting::kMinMa;
    current_ma_ = std::max(StimulatorSetting::kMinMa, current_ma_ / 2);
  } else {
    done_ = current_ma_ >= StimulatorSetting::kMaxMa;
    current_ma_ = std::min(StimulatorSetting::kMaxMa, current_ma_ * 2);
  }
}

void Stimulator::set(const StimulatorSetting& setting) {
  setting_ = within_range(setting);
  search_.reset();
  if (setting_.search && setting_.current_ma > 0) search_.emplace(setting_.current_ma);
}

double Stimulator::current_ma() const {
  return search_ ? search_->current_ma() : setting_.current_ma;
}

std::optional<std::uint64_t> Stimulator::pulse(std::uint64_t first, std::uint64_t samples, bool touches) {
  if (setting_.current_ma <= 0 || !touches || next_ >= first + samples) return std::nullopt;
  const std::uint64_t at = std::max(first, next_);
  next_ = at + static_cast<std::uint64_t>(MonitorSetup::kRateHz / setting_.pulses_per_s);
  return at;
}

std::optional<Stimulator::Found> Stimulator::take(bool response) {
  if (!search_) return std::nullopt;
  search_->take(response);
  if (!search_->done()) return std::nullopt;
  const Found found{search_->threshold_ma()};
  search_.reset();
  setting_.current_ma = 0;
  setting_.search = false;
  return found;
}

}  // namespace osteo::inline simulation
