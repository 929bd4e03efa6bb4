#include "osteo/evidence/strokes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace osteo {

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
  for (std::size_t i = kReach; i + kReach < n; ++i) {
    const Vec3 in = period_[i].at_mm - period_[i - kReach].at_mm, out = period_[i + kReach].at_mm - period_[i].at_mm;
    const double a = length(in), b = length(out);
    if (a < kStillMm || b < kStillMm) continue;
    turn[i] = std::acos(std::clamp(dot(in, out) / (a * b), -1.0, 1.0)) * 180 / std::numbers::pi;
  }
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
    if (s.length_mm >= kLeastMm && s.end_s - s.begin_s >= kLeastS - 1e-9) strokes_.push_back(s);
    begin = end;
  };
  for (std::size_t i = kReach; i + kReach < n; ++i) {
    if (turn[i] <= kTurnDeg) continue;
    const auto from = turn.begin() + static_cast<std::ptrdiff_t>(i - kReach),
               to = turn.begin() + static_cast<std::ptrdiff_t>(i + kReach + 1);
    if (std::max_element(from, to) == turn.begin() + static_cast<std::ptrdiff_t>(i)) put(i);  // of equals the first
  }
  if (n > 1) put(n - 1);
  period_.clear();
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
    const double p2 = (m[0][0] - q) * (m[0][0] - q) + (m[1][1] - q) * (m[1][1] - q) + (m[2][2] - q) * (m[2][2] - q) + 2 * off;
    const double p = std::sqrt(p2 / 6);
    double largest = q;
    if (p > 1e-12) {
      auto b = m;
      for (std::size_t a = 0; a < 3; ++a)
        for (std::size_t c = 0; c < 3; ++c) b[a][c] = (m[a][c] - (a == c ? q : 0)) / p;
      const double det = b[0][0] * (b[1][1] * b[2][2] - b[1][2] * b[2][1]) - b[0][1] * (b[1][0] * b[2][2] - b[1][2] * b[2][0]) +
                         b[0][2] * (b[1][0] * b[2][1] - b[1][1] * b[2][0]);
      largest = q + 2 * p * std::cos(std::acos(std::clamp(det / 2, -1.0, 1.0)) / 3);
    }
    sum += 1 - largest;
  }
  return sum / static_cast<double>(strokes.size() - kWindow + 1);
}

}  // namespace osteo
