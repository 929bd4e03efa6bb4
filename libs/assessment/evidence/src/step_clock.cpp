#include "osteo/assessment/evidence/detail/step_clock.h"

#include <algorithm>
#include <cmath>

namespace osteo::inline assessment {

StepClock::StepClock(const StructureMap& structures, const Procedure& procedure, double rate_hz)
    : structures_(structures), procedure_(procedure), rate_hz_(rate_hz) {
  const std::size_t n = structures.values().size();
  any_.resize(n);
  ticks_.resize(procedure.steps.size());
  for (const ProcedureStep& step : procedure.steps) {
    std::vector<std::uint8_t>& has = has_.emplace_back(n);
    for (const ScaleItem& item : procedure.items) {
      if (std::find(step.items.begin(), step.items.end(), item.name) == step.items.end()) continue;
      for (std::size_t s = 0; s < n; ++s) {
        const std::string name = structures.name_of(structures.values()[s]);
        if (name == item.structure || name == item.second) has[s] = any_[s] = 1;
      }
    }
  }
  const auto first =
      std::find_if(has_.begin(), has_.end(), [](const auto& has) { return std::count(has.begin(), has.end(), 1) > 0; });
  now_ = first == has_.end() ? 0 : static_cast<std::size_t>(first - has_.begin());
}

void StepClock::drill(std::uint64_t now, std::span<const double> each_mm) {
  if (!drilled_) begun_ = now;
  drilled_ = true;
  last_ = now + 1;
  std::size_t nearest = each_mm.size();
  double least_mm = structures_.reach_mm();
  for (std::size_t s = 0; s < each_mm.size(); ++s) {
    if (any_[s] == 0 || each_mm[s] >= least_mm) continue;
    least_mm = each_mm[s];
    nearest = s;
  }
  if (nearest == each_mm.size()) return;
  if (has(now_, nearest)) {
    next_ticks_ = 0;
    return;
  }
  if (next_ticks_ == 0 || !has(next_, nearest)) {
    // The next one in order, else the last before.
    next_ = now_ + 1;
    while (next_ < has_.size() && !has(next_, nearest)) ++next_;
    if (next_ == has_.size()) {
      next_ = now_ - 1;
      while (!has(next_, nearest)) --next_;
    }
    next_begun_ = now;
    next_ticks_ = 0;
  }
  ++next_ticks_;
  if (static_cast<double>(next_ticks_) < kSettledS * rate_hz_) return;
  ticks_[now_] += next_begun_ - begun_;
  begun_ = next_begun_;
  now_ = next_;
  next_ticks_ = 0;
}

void StepClock::finish(std::vector<Measured>& values) const {
  for (std::size_t n = 0; n < procedure_.steps.size(); ++n) {
    const std::string& name = procedure_.steps[n].name;
    if (!drilled_) {
      values.push_back(not_measured("step_s", "no burr drilled", name));
    } else if (std::count(has_[n].begin(), has_[n].end(), 1) == 0) {
      values.push_back(not_measured("step_s", "its items are about no structure of the case", name));
    } else {
      values.push_back(
          measured("step_s", static_cast<double>(ticks_[n] + (n == now_ ? last_ - begun_ : 0)) / rate_hz_, name));
    }
  }
}

}  // namespace osteo::inline assessment
