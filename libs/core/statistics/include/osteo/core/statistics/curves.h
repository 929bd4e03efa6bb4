// Lines and monotone curves through points, how far two things go together, and curves over time.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "osteo/core/statistics/basics.h"

namespace osteo::statistics {

// -- Intervals that are drawn: of a mean, and of a line through points.

/// Of a mean, by Student's t; NaN of fewer than two values.
[[nodiscard]] Interval mean_interval(std::span<const double> values, double level = 0.95);

/// Least squares, with Student's interval of the line itself.
struct FittedLine {
  double slope = kUndefined, intercept = kUndefined;  ///< NaN with fewer than three pairs or where x never varies
  double mean_x = 0, sum_xx = 0, n = 0, residual_sd = kUndefined, level = 0.95;
  [[nodiscard]] Estimate at(double x) const;
};
[[nodiscard]] FittedLine fitted_line(std::span<const double> x, std::span<const double> y, double level = 0.95);

// -- Curves that only rise, or only fall: force by distance to a nerve, say.

enum class Trend : int { rising, falling };

/// A step for each different x, rising; `at` goes straight from one to the next and stays level beyond the ends.
struct MonotoneCurve {
  std::vector<double> x, y;
  /// NaN of an empty curve. O(log n).
  [[nodiscard]] double at(double where) const;
};

/// Least squares among all curves that rise (fall), by pooling adjacent violators (Ayer et al. 1955). `weights` empty:
/// all alike; else > 0. O(n log n).
[[nodiscard]] MonotoneCurve isotonic_mean(std::span<const double> x, std::span<const double> y,
                                          Trend trend = Trend::rising, std::span<const double> weights = {});
/// The same for the quantile `share` (0 < share < 1): least sum of tilted absolute errors (Koenker and Bassett 1978).
/// Exact, by halving the range of values (Stout 2013); of equally good curves the lowest. O(n log n) but for the sort
/// of its halves.
[[nodiscard]] MonotoneCurve isotonic_quantile(std::span<const double> x, std::span<const double> y, double share,
                                              Trend trend = Trend::rising);

// -- How far two things go together.

/// `r`: -1 to 1; NaN with fewer than three pairs or where one never varies. p two-sided by Student's t with n - 2, for
/// pairs that know nothing of each other: several sessions of one person do.
struct Correlation {
  std::size_t n = 0;
  double r = kUndefined, p = kUndefined;
  Interval interval;
};
/// Interval by Fisher's transformation; needs four pairs.
[[nodiscard]] Correlation pearson(std::span<const double> x, std::span<const double> y, double level = 0.95);
/// Pearson's of the ranks; no interval: take by_people.
[[nodiscard]] Correlation spearman(std::span<const double> x, std::span<const double> y);

/// What is left of both once straight lines through `given` are taken away (with a constant), and how far that goes
/// together: as -P_xy / sqrt(P_xx P_yy) of the inverse of their correlation matrix. p by Student's t with n - 2 - k,
/// interval by Fisher's transformation with n - 3 - k, k lists given. r is NaN with fewer than k + 3 rows, where the
/// lists given leave nothing of x or y, or where one of them follows from the others. Error(usage) unless all lists are
/// as long. O(n k^2).
[[nodiscard]] Correlation partial_pearson(std::span<const double> x, std::span<const double> y,
                                          std::span<const std::vector<double>> given, double level = 0.95);
/// The same of the ranks of all of them; the interval is that of Pearson's.
[[nodiscard]] Correlation partial_spearman(std::span<const double> x, std::span<const double> y,
                                           std::span<const std::vector<double>> given, double level = 0.95);

/// Both, with intervals by drawing people with all their pairs: right where people come several times. `person[i]` is
/// who pair i is of.
struct CorrelationByPeople {
  std::size_t pairs = 0, people = 0;
  Correlation pearson, spearman;
  Bootstrap pearson_by_people, spearman_by_people;
};
[[nodiscard]] CorrelationByPeople correlation_by_people(std::span<const double> x, std::span<const double> y,
                                                        std::span<const int> person, const Resampling& resampling = {});

// -- Over time: samples put on a grid and filtered, and how smooth a movement is.

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
