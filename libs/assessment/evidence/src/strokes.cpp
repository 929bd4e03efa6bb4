#include "osteo/assessment/evidence/detail/strokes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "osteo/core/statistics/curves.h"

namespace osteo::inline assessment {

void StrokeFinder::add(double t_s, Vec3 at_mm) {
  if (!period_.empty()) {
    const double since = t_s - period_.back().t_s;
    if (since >= kPauseS) {
      end_period();
    } else if (since < 1 / kRateHz - 1e-9) {
      return;
    }
  }
  period_.push_back({t_s, at_mm});
}

void StrokeFinder::end_period() {
  const std::size_t n = period_.size();
  // Turn at each sample, in degrees.
  std::vector<double> turn(n, 0.0);
  const auto before = [&](std::size_t i) { return period_[i].at_mm - period_[i - kReach].at_mm; };
  const auto behind = [&](std::size_t i) { return period_[i + kReach].at_mm - period_[i].at_mm; };
  const auto degrees = [](Vec3 in, Vec3 out) {
    return std::acos(std::clamp(dot(in, out) / (length(in) * length(out)), -1.0, 1.0)) * 180 / std::numbers::pi;
  };
  const auto still = [&](std::size_t i) { return length(before(i)) < kStillMm || length(behind(i)) < kStillMm; };
  for (std::size_t i = kReach; i + kReach < n; ++i) {
    if (!still(i)) {
      turn[i] = degrees(before(i), behind(i));
      continue;
    }
    // Who slows down, rests and goes back turns too: in the middle of the rest, from the way before it to the way
    // behind.
    const std::size_t from = i;
    while (i + 1 + kReach < n && still(i + 1)) ++i;
    if (from > kReach && i + 1 + kReach < n) turn[(from + i) / 2] = degrees(before(from - 1), behind(i + 1));
  }
  const std::size_t first = strokes_.size();
  std::size_t begin = 0;
  const auto put = [&](std::size_t end) {
    Stroke s{period_[begin].t_s, period_[end].t_s, 0, {}};
    // In steps that are more than the trembling of a resting hand.
    for (std::size_t i = begin + 1, from = begin; i <= end; ++i) {
      const double step = length(period_[i].at_mm - period_[from].at_mm);
      if (step < kStillMm) continue;
      s.length_mm += step;
      from = i;
    }
    s.direction = normalized(period_[end].at_mm - period_[begin].at_mm);
    if (s.length_mm >= kMinMm && s.end_s - s.begin_s >= kMinS - 1e-9) strokes_.push_back(s);
    begin = end;
  };
  for (std::size_t i = kReach; i + kReach < n; ++i) {
    if (turn[i] <= kTurnDeg) continue;
    const auto from = turn.begin() + static_cast<std::ptrdiff_t>(i - kReach),
               to = turn.begin() + static_cast<std::ptrdiff_t>(i + kReach + 1);
    if (std::max_element(from, to) == turn.begin() + static_cast<std::ptrdiff_t>(i)) put(i);  // of equals the first
  }
  if (n > 1) put(n - 1);
  measure(first);
  period_.clear();
}

void StrokeFinder::measure(std::size_t first) {
  // A filter of second order that goes both ways needs ten samples.
  if (first == strokes_.size() || period_.size() < 10) return;
  std::vector<double> times_s;
  for (const Sample& s : period_) times_s.push_back(s.t_s);
  std::vector<std::array<double, 3>> places;
  for (std::size_t a = 0; a < 3; ++a) {
    std::vector<double> values;
    for (const Sample& s : period_) values.push_back(s.at_mm[a]);
    // Where the burr left the bone for less than a pause, straight on.
    const std::vector<double> even =
        statistics::low_pass(statistics::resample(times_s, values, kRateHz), kRateHz, kSmoothHz);
    places.resize(even.size());
    for (std::size_t i = 0; i < even.size(); ++i) places[i][a] = even[i];
  }
  const std::vector<double> speed = statistics::speed_of(places, kRateHz);
  for (std::size_t s = first; s < strokes_.size(); ++s) {
    Stroke& k = strokes_[s];
    if (k.end_s - k.begin_s < kSmoothLeastS - 1e-9) continue;
    const auto step = [&](double t_s) {
      return std::min(speed.size(), static_cast<std::size_t>(std::llround((t_s - times_s[0]) * kRateHz)));
    };
    const std::span<const double> its(speed.data() + step(k.begin_s), step(k.end_s) - step(k.begin_s));
    k.sparc = statistics::sparc(its, kRateHz);
    k.log_dimensionless_jerk = statistics::log_dimensionless_jerk(its, kRateHz);
  }
}

const std::vector<Stroke>& StrokeFinder::finish() {
  if (!period_.empty()) end_period();
  return strokes_;
}

double stroke_variance(const std::vector<Stroke>& strokes) {
  constexpr std::size_t kWindow = 5;
  if (strokes.size() < kWindow) return 0;
  double sum = 0;
  for (std::size_t first = 0; first + kWindow <= strokes.size(); ++first) {
    std::array<std::array<double, 3>, 3> m{};
    for (std::size_t s = first; s < first + kWindow; ++s) {
      for (std::size_t a = 0; a < 3; ++a)
        for (std::size_t b = 0; b < 3; ++b) m[a][b] += strokes[s].direction[a] * strokes[s].direction[b] / kWindow;
    }
    // The largest eigenvalue of a symmetric matrix, in closed form.
    const double q = (m[0][0] + m[1][1] + m[2][2]) / 3, off = m[0][1] * m[0][1] + m[0][2] * m[0][2] + m[1][2] * m[1][2];
    const double p2 =
        (m[0][0] - q) * (m[0][0] - q) + (m[1][1] - q) * (m[1][1] - q) + (m[2][2] - q) * (m[2][2] - q) + 2 * off;
    const double p = std::sqrt(p2 / 6);
    double largest = q;
    if (p > 1e-12) {
      auto b = m;
      for (std::size_t a = 0; a < 3; ++a)
        for (std::size_t c = 0; c < 3; ++c) b[a][c] = (m[a][c] - (a == c ? q : 0)) / p;
      const double det = b[0][0] * (b[1][1] * b[2][2] - b[1][2] * b[2][1]) -
                         b[0][1] * (b[1][0] * b[2][2] - b[1][2] * b[2][0]) +
                         b[0][2] * (b[1][0] * b[2][1] - b[1][1] * b[2][0]);
      largest = q + 2 * p * std::cos(std::acos(std::clamp(det / 2, -1.0, 1.0)) / 3);
    }
    sum += 1 - largest;
  }
  return sum / static_cast<double>(strokes.size() - kWindow + 1);
}

}  // namespace osteo::inline assessment
