#include "osteo/simulation/nerve/detail/nerve_model.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "osteo/core/base/portable_math.h"

namespace osteo::inline simulation {
namespace {

// Discharges at once, of each nerve: more sound the same.
constexpr std::ptrdiff_t kMaxOfANerve = 4;
constexpr double kGone = 0.05;        // what is left of a nerve is then taken as nothing
constexpr double kTrainHoldsS = 0.1;  // a train outlasts the end of its cause at least so long

}  // namespace

std::string_view name_of(NerveCause cause) {
  static constexpr std::array<std::string_view, 5> kNames{"", "mechanical", "pressure", "heat", "injury"};
  return kNames[static_cast<std::size_t>(cause)];
}

double stimulus_threshold_ma(const MonitorConstants& c, double soft_mm, double bone_mm, double width_ms) noexcept {
  const double soft = std::max(0.0, soft_mm), bone = std::max(0.0, bone_mm);
  const double at_usual = c.soft_ma + c.soft_ma_per_mm2 * soft * soft -
                          (c.soft_ma - c.bare_ma) * portable::exp(-soft / c.contact_mm) +
                          c.bone_ma_per_mm2 * bone * bone;
  constexpr double kUsualMs = 0.1;
  return at_usual * (1 + c.chronaxie_ms / width_ms) / (1 + c.chronaxie_ms / kUsualMs);
}

NerveModel::NerveModel(const MonitorConstants& constants, std::vector<NerveCourse> courses, std::uint64_t seed)
    : c_(constants),
      courses_(std::move(courses)),
      random_(seed),
      touches_(courses_.size(), false),
      touched_(courses_.size(), false) {
  for (const NerveCourse& course : courses_) integrity_.emplace_back(course.points.size(), 1.0);
}

double NerveModel::conducts(std::size_t nerve, std::size_t point) const {
  double least = 1;
  for (std::size_t p = point; p < integrity_[nerve].size(); ++p) least = std::min(least, integrity_[nerve][p]);
  return least;
}

double NerveModel::answer(std::size_t nerve, std::size_t point, double current_ma, double threshold_ma) {
  // Drawn always, so that what comes later does not depend on the answer.
  const double spread = portable::exp(c_.trial_spread * random_.normal());
  return conducts(nerve, point) * std::clamp((current_ma - threshold_ma) / c_.recruit_ma, 0.0, 1.0) * spread;
}

void NerveModel::begin(NerveCause cause, bool train, std::size_t nerve, std::size_t point, double seconds, double hz,
                       double uv) {
  const auto of_it =
      std::count_if(discharges_.begin(), discharges_.end(), [&](const Discharge& d) { return d.nerve == nerve; });
  if (of_it < kMaxOfANerve) {
    discharges_.push_back({next_id_++, cause, train, nerve, point, hz, uv, seconds});
    happenings_.push_back({cause, nerve, point, integrity_[nerve][point]});
  }
}

// A train of this cause that goes on lasts as long as the cause.
bool NerveModel::goes_on(NerveCause cause, std::size_t nerve, double at_least_s) {
  bool any = false;
  for (Discharge& d : discharges_) {
    if (!d.train || d.nerve != nerve || d.cause != cause) continue;
    d.left_s = std::max(d.left_s, at_least_s);
    any = true;
  }
  return any;
}

void NerveModel::lose(std::size_t nerve, std::size_t point, double to) {
  double& g = integrity_[nerve][point];
  to = to < kGone ? 0 : to;
  if (to >= g) return;
  // One discharge for a loss that goes on: at its beginning, and when the last fibres go.
  const bool reported = std::any_of(discharges_.begin(), discharges_.end(), [&](const Discharge& d) {
    return d.nerve == nerve && d.cause == NerveCause::injury;
  });
  const bool last = to == 0 && conducts(nerve, point) > 0;
  if (!reported && c_.injury_s > 0) {
    begin(NerveCause::injury, false, nerve, point, c_.injury_s, c_.burst_most_hz, c_.burst_most_uv);
  } else if (last) {
    happenings_.push_back({NerveCause::injury, nerve, point, 0});
  }
  g = to;
  if (!happenings_.empty() && happenings_.back().cause == NerveCause::injury) happenings_.back().integrity = g;
}

void NerveModel::stress(const NerveStress& s, double dt_s) {
  if (s.nerve >= courses_.size() || s.point >= courses_[s.nerve].points.size()) return;
  const NerveCourse& course = courses_[s.nerve];
  if (s.cuts && s.clearance_mm < 0) {
    const double share = -s.clearance_mm / std::max(0.1, 2 * course.points[s.point].radius_mm);
    lose(s.nerve, s.point, std::max(0.0, 1 - share));
  }
  if (integrity_[s.nerve][s.point] <= 0) return;
  // The first touch of the sheath is always heard.
  const bool on_sheath = s.clearance_mm <= c_.sheath_mm && s.bone_mm <= c_.sheath_mm;
  if (s.drills && on_sheath && !touched_[s.nerve])
    begin(NerveCause::mechanical, false, s.nerve, s.point, c_.burst_least_s, c_.burst_most_hz, c_.burst_most_uv);
  touches_[s.nerve] = touches_[s.nerve] || (s.drills && on_sheath);
  // Hazards: a chance in each step, small against 1.
  const double near = 1 - std::max(0.0, s.clearance_mm) / c_.burst_cover_mm;
  if (s.drills && near > 0 && random_.uniform() < c_.bursts_per_s * near * near * dt_s)
    begin(NerveCause::mechanical, false, s.nerve, s.point, random_.between(c_.burst_least_s, c_.burst_most_s),
          random_.between(c_.burst_least_hz, c_.burst_most_hz), random_.between(c_.burst_least_uv, c_.burst_most_uv));
  if (!on_sheath) return;
  const double force_n = s.press_n + std::max(0.0, -s.clearance_mm) * c_.sheath_n_per_mm;
  if (force_n < c_.train_n || goes_on(NerveCause::pressure, s.nerve, kTrainHoldsS)) return;
  if (random_.uniform() < c_.trains_per_s * dt_s)
    begin(NerveCause::pressure, true, s.nerve, s.point, random_.between(c_.train_least_s, c_.train_most_s),
          random_.between(c_.train_least_hz, c_.train_most_hz), random_.between(c_.train_least_uv, c_.train_most_uv));
}

void NerveModel::step(double dt_s, std::span<const NerveStress> stresses, std::span<const Warmth> warm) {
  happenings_.clear();
  for (Discharge& d : discharges_) d.left_s -= dt_s;
  std::erase_if(discharges_, [](const Discharge& d) { return d.left_s <= 0; });
  std::fill(touches_.begin(), touches_.end(), false);
  for (const NerveStress& s : stresses) stress(s, dt_s);
  touched_ = touches_;
  for (std::size_t n = 0; n < warm.size() && n < courses_.size(); ++n) {
    std::size_t hottest = 0;
    const Warmth& w = warm[n];
    for (std::size_t p = 0; p < w.celsius.size() && p < courses_[n].points.size(); ++p) {
      if (w.celsius[p] > w.celsius[hottest]) hottest = p;
      const double dose = w.cem43_min[p];
      if (dose <= c_.dose_from_min) continue;
      const double left = dose >= c_.dose_to_min ? 0
                                                 : 1 - portable::log(dose / c_.dose_from_min) /
                                                           portable::log(c_.dose_to_min / c_.dose_from_min);
      lose(n, p, left);
    }
    if (w.celsius.empty() || w.celsius[hottest] < c_.train_c || integrity_[n][hottest] <= 0) continue;
    if (goes_on(NerveCause::heat, n, kTrainHoldsS)) continue;
    if (random_.uniform() < c_.trains_per_s * dt_s)
      begin(NerveCause::heat, true, n, hottest, random_.between(c_.train_least_s, c_.train_most_s),
            random_.between(c_.train_least_hz, c_.train_most_hz), random_.between(c_.train_least_uv, c_.train_most_uv));
  }
}

}  // namespace osteo::inline simulation
