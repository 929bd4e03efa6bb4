// How smooth a movement is, and what has to be done to a recording before that can be asked.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "osteo/core/statistics/basics.h"

namespace osteo::statistics {

/// Spectral arc length (Balasubramanian, Melendez-Calderon, Roby-Brami, Burdet 2015): the length of the speed's
/// normalised magnitude spectrum up to the last frequency at which it reaches `threshold`; nearer to 0 is smoother. The
/// spectrum is that of the speed padded with zeros to 2^(ceil(log2 n) + 4) samples. Meant by its authors for one
/// movement from rest to rest: for a stroke, of at least 100 ms. Hardly moved by noise of position.
struct SparcSettings {
  double cutoff_hz = 10;    ///< > 0
  double threshold = 0.05;  ///< 0 to 1
};
/// `speed` at `rate_hz`, any unit. NaN for fewer than two samples or no movement at all. O(n log n).
[[nodiscard]] double sparc(std::span<const double> speed, double rate_hz, const SparcSettings& settings = {});

/// Log dimensionless jerk of a speed: -ln(T^3 / peak^2 * sum of (second difference / dt^2)^2 * dt), T = n dt; nearer to
/// 0 is smoother. From raw positions at 1 kHz this measures the noise: ten micrometres of it move the value by 20.
/// Filter first, and say how. NaN for fewer than three samples, no movement, or no jerk.
[[nodiscard]] double log_dimensionless_jerk(std::span<const double> speed, double rate_hz);

/// Samples at `times_s` (rising) put on a grid of `rate_hz` from the first to the last, by straight lines: whatever
/// clock they came with. Nothing is made up before the first or after the last. Error(usage) where times do not rise.
[[nodiscard]] std::vector<double> resample(std::span<const double> times_s, std::span<const double> values,
                                           double rate_hz);

/// Butterworth of second order, once forwards and once backwards, so that nothing is delayed; at `corner_hz` a half of
/// the amplitude is left. Its ends as scipy.signal.filtfilt has them: continued by turning 9 samples about the end.
/// Needs 10 samples and 0 < corner < rate / 2.
[[nodiscard]] std::vector<double> low_pass(std::span<const double> values, double rate_hz, double corner_hz);

/// Lengths of steps between positions, times the rate: n - 1 speeds for n positions, each that of the middle of its
/// step.
[[nodiscard]] std::vector<double> speed_of(std::span<const std::array<double, 3>> positions, double rate_hz);

}  // namespace osteo::statistics
