#include "osteo/core/statistics/curves.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>

#include "check.h"

namespace osteo::statistics {
namespace {

void need_rate(double rate_hz) {
  if (!(rate_hz > 0 && std::isfinite(rate_hz))) refuse("a rate of samples is above 0");
}

}  // namespace

double sparc(std::span<const double> speed, double rate_hz, const SparcSettings& s) {
  need_finite(speed, "the speed");
  need_rate(rate_hz);
  if (!(s.cutoff_hz > 0) || !(s.threshold >= 0 && s.threshold <= 1))
    refuse("SPARC's cutoff is above 0, its threshold from 0 to 1");
  if (speed.size() < 2) return kUndefined;
  const std::size_t n = std::bit_ceil(speed.size()) << 4;
  std::vector<double> padded(n, 0.0);
  std::copy(speed.begin(), speed.end(), padded.begin());
  std::vector<std::complex<double>> spectrum;
  Eigen::FFT<double> fft;
  fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
  fft.fwd(spectrum, padded);
  double most = 0;
  for (const auto& v : spectrum) most = std::max(most, std::abs(v));
  if (most == 0) return kUndefined;
  const double step_hz = rate_hz / static_cast<double>(n);
  std::vector<double> kept;
  for (std::size_t i = 0; i < spectrum.size() && static_cast<double>(i) * step_hz <= s.cutoff_hz; ++i)
    kept.push_back(std::abs(spectrum[i]) / most);
  const auto above = [&](double m) { return m >= s.threshold; };
  const auto first = std::find_if(kept.begin(), kept.end(), above);
  const auto end = std::find_if(kept.rbegin(), kept.rend(), above).base();
  if (end - first < 2) return kUndefined;
  const double df = 1 / static_cast<double>(end - first - 1);
  double length = 0;
  for (auto at = first + 1; at != end; ++at) length += std::hypot(df, *at - *(at - 1));
  return -length;
}

double log_dimensionless_jerk(std::span<const double> speed, double rate_hz) {
  need_finite(speed, "the speed");
  need_rate(rate_hz);
  if (speed.size() < 3) return kUndefined;
  const double dt = 1 / rate_hz, duration = static_cast<double>(speed.size()) * dt;
  double peak = 0, jerk = 0;
  for (const double v : speed) peak = std::max(peak, std::abs(v));
  for (std::size_t i = 2; i < speed.size(); ++i) {
    const double j = (speed[i] - 2 * speed[i - 1] + speed[i - 2]) / (dt * dt);
    jerk += j * j * dt;
  }
  if (peak == 0 || jerk == 0) return kUndefined;
  return -std::log(duration * duration * duration / (peak * peak) * jerk);
}

std::vector<double> resample(std::span<const double> times_s, std::span<const double> values, double rate_hz) {
  need_same_size(times_s.size(), values.size());
  need_finite(times_s, "times");
  need_finite(values, "values to resample");
  need_rate(rate_hz);
  if (times_s.empty()) return {};
  for (std::size_t i = 1; i < times_s.size(); ++i) {
    if (!(times_s[i] > times_s[i - 1]))
      refuse("times to resample rise from each to the next; time " + std::to_string(i + 1) + " does not");
  }
  // A last sample that the rounding of a sum would lose is kept.
  const double span_s = times_s.back() - times_s.front(), steps = span_s * rate_hz;
  if (steps > 1e9) refuse("so many samples are not meant");
  const auto count = static_cast<std::size_t>(std::floor(steps + 1e-9)) + 1;
  std::vector<double> out;
  out.reserve(count);
  std::size_t at = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double t = std::min(times_s.back(), times_s.front() + static_cast<double>(i) / rate_hz);
    while (at + 2 < times_s.size() && times_s[at + 1] <= t) ++at;
    if (times_s.size() == 1) {
      out.push_back(values[0]);
      continue;
    }
    const double share = (t - times_s[at]) / (times_s[at + 1] - times_s[at]);
    out.push_back(values[at] + share * (values[at + 1] - values[at]));
  }
  return out;
}

std::vector<double> low_pass(std::span<const double> values, double rate_hz, double corner_hz) {
  need_finite(values, "values to filter");
  need_rate(rate_hz);
  if (!(corner_hz > 0 && corner_hz < rate_hz / 2))
    refuse("the corner of a filter lies between 0 and half the rate of the samples");
  constexpr std::size_t kPad = 9;
  if (values.size() <= kPad) refuse("a filter needs ten samples at least");
  // The analogue prototype by the bilinear transform, bent so that the corner stays where it is.
  const double w = std::tan(std::numbers::pi * corner_hz / rate_hz), root2 = std::numbers::sqrt2;
  const double a0 = 1 + root2 * w + w * w, b0 = w * w / a0, b1 = 2 * b0, b2 = b0;
  const double a1 = 2 * (w * w - 1) / a0, a2 = (1 - root2 * w + w * w) / a0;
  // The state in which a steady value goes through unchanged.
  const double z2 = b2 - a2, z1 = b1 - a1 + z2;
  const std::size_t n = values.size();
  std::vector<double> x;
  x.reserve(n + 2 * kPad);
  for (std::size_t i = kPad; i > 0; --i) x.push_back(2 * values[0] - values[i]);
  x.insert(x.end(), values.begin(), values.end());
  for (std::size_t i = 2; i <= kPad + 1; ++i) x.push_back(2 * values[n - 1] - values[n - i]);
  for (int pass = 0; pass < 2; ++pass) {
    double s1 = z1 * x[0], s2 = z2 * x[0];
    for (double& v : x) {
      const double y = b0 * v + s1;
      s1 = b1 * v - a1 * y + s2;
      s2 = b2 * v - a2 * y;
      v = y;
    }
    std::reverse(x.begin(), x.end());
  }
  return {x.begin() + kPad, x.end() - kPad};
}

std::vector<double> speed_of(std::span<const std::array<double, 3>> positions, double rate_hz) {
  need_rate(rate_hz);
  std::vector<double> speed;
  for (std::size_t i = 1; i < positions.size(); ++i) {
    need_finite(positions[i - 1], "a position");
    need_finite(positions[i], "a position");
    speed.push_back(std::hypot(positions[i][0] - positions[i - 1][0], positions[i][1] - positions[i - 1][1],
                               positions[i][2] - positions[i - 1][2]) *
                    rate_hz);
  }
  return speed;
}

}  // namespace osteo::statistics
