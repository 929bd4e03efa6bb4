// Two curves of force over time laid onto each other by dynamic programming (D. Morris 2006, section 4.3).
#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace osteo::inline assessment::experiment {

/// What a pair of samples costs, in N: `force` times the difference of forces, plus `slope_s` times that of slopes,
/// plus `distortion_n` where one of both curves stands still. So a shift by a second costs as much as being
/// `distortion_n` off for a second. All finite and >= 0.
struct AlignCosts {
  double force = 1;
  double slope_s = 0.25;    ///< N for each N/s; a guess, the dissertation's is not printed
  double distortion_n = 2;  ///< a guess, likewise
};

/// A curve at a fixed rate: N, N/s, and how much each sample counts (0: kept out, empty: all count 1). Borrowed.
struct Curve {
  std::span<const double> force_n, slope_n_per_s, weight;
};

struct Pairing {
  std::uint32_t target = 0, applied = 0;  ///< samples
};

/// How the optimum was had: in a band about the diagonal, outside of which distortion alone costs more than the way
/// that was found; or, where that band would not be much smaller, in the whole matrix.
enum class AlignBy : int { band, matrix };

struct Alignment {
  double cost_n = 0;  ///< summed over the path, N
  std::vector<Pairing>
      path;  ///< from both first samples to both last ones; each step goes on by one in one curve or in both
  AlignBy by = AlignBy::band;
  std::size_t places = 0;  ///< of the matrix that were looked at, those of a first try too
};

/// Keeps its memory between calls; one thread. The same curves give the same bits on every processor.
class Aligner {
 public:
  /// `first_band`: half width of the first try in share of the longer curve, beyond the difference of both lengths; >=
  /// 1 is the whole matrix. What it finds says how wide a band must be to be certain.
  explicit Aligner(const AlignCosts& costs = {}, double first_band = 0.02);
  /// The cheapest way, of equally cheap ones that which keeps to both curves' pace. Error(usage) for curves without
  /// samples, of which parts have different lengths, hold what is not finite or a negative weight, or whose matrix has
  /// more than 2^28 places. O(places looked at), 8 bytes for each.
  const Alignment& align(const Curve& target, const Curve& applied);
  [[nodiscard]] const AlignCosts& costs() const { return costs_; }

 private:
  double fill(long lowest, long highest);
  void trace(long lowest, long highest);
  [[nodiscard]] double least_cost() const;

  AlignCosts costs_;
  double first_band_;
  long n_ = 0, m_ = 0;
  // Target as it comes; applied backwards, so that an anti-diagonal of the matrix reads both forwards.
  std::vector<double> f_, fs_, fw_, g_, gs_, gw_;
  bool weighted_ = false;
  // Anti-diagonals one behind the other, each between two places that cannot be reached; the way back is read off them.
  // Steps kept in bytes beside the costs of three anti-diagonals took longer than these eight bytes a place.
  std::vector<double> cost_;
  std::vector<std::size_t> row_;  // of each, where target 0 would be, + n_; before them two that cannot be reached
  Alignment result_;
};

/// The same by the plain recurrence over the whole matrix: what the other is held against.
[[nodiscard]] Alignment align_plainly(const Curve& target, const Curve& applied, const AlignCosts& costs = {});

/// Central differences, one-sided at both ends; 0 of a single sample.
[[nodiscard]] std::vector<double> slopes(std::span<const double> force_n, double rate_hz);

}  // namespace osteo::inline assessment::experiment
