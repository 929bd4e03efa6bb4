// Strokes of a burr: where a path turns.
#pragma once
#include <limits>
#include <vector>

#include "osteo/core/data/vec.h"

namespace osteo::inline assessment {

struct Stroke {
  double begin_s = 0, end_s = 0, length_mm = 0;
  Vec3 direction;  ///< unit, from its beginning to its end
  /// How smooth its speed is, nearer to 0 is smoother (statistics/curves.h); not a number below 100 ms.
  double sparc = std::numeric_limits<double>::quiet_NaN(), log_dimensionless_jerk = sparc;
};

/// Takes the burr's place while it drills; cuts the path into strokes. A stroke ends where the path turns by more than
/// 60 degrees between the 30 ms before and the 30 ms after, at the sharpest place within 30 ms, and where drilling
/// stops for 0.1 s or longer. What is shorter than 1 mm or 80 ms is none. Works on 100 samples a second, whatever the
/// rate, and on nothing but the places: shifting or turning the scene changes nothing. A hand that rests (less than
/// 0.05 mm in 30 ms) does not turn, but who comes to rest and goes back has turned. Smoothness is that of the speed of
/// places that went through a zero-phase low-pass of 20 Hz: jerk of raw places measures their noise.
class StrokeFinder {
 public:
  static constexpr double kRateHz = 100, kTurnDeg = 60, kMinMm = 1, kMinS = 0.08, kPauseS = 0.1, kStillMm = 0.05,
                          kSmoothHz = 20, kSmoothLeastS = 0.1;
  static constexpr std::size_t kReach = 3;  ///< samples, 30 ms
  /// In order of time. Not called while the burr does not drill.
  void add(double t_s, Vec3 at_mm);
  /// All of them; nothing may be added afterwards.
  [[nodiscard]] const std::vector<Stroke>& finish();

 private:
  void end_period();
  void measure(std::size_t first);  // smoothness of the strokes from here on, which are the period's
  struct Sample {
    double t_s;
    Vec3 at_mm;
  };
  std::vector<Sample> period_;
  std::vector<Stroke> strokes_;
};

/// How little strokes follow one line: over each five in a row 1 - the largest eigenvalue of the mean of d d^T, the
/// mean of these. 0: all on one line, 2/3: in all directions alike. 0 with fewer than five.
[[nodiscard]] double stroke_variance(const std::vector<Stroke>& strokes);

}  // namespace osteo::inline assessment
