// Strokes of a burr: where a path turns.
#pragma once
#include <vector>

#include "osteo/data/vec.h"

namespace osteo {

struct Stroke {
  double begin_s = 0, end_s = 0, length_mm = 0;
  Vec3 direction;  ///< unit, from its beginning to its end
};

/// Takes the burr's place while it drills; cuts the path into strokes. A stroke ends where the path turns by more than 60 degrees between
/// the 30 ms before and the 30 ms after, at the sharpest place within 30 ms, and where drilling stops for 0.1 s or longer. What is shorter
/// than 1 mm or 80 ms is none. Works on 100 samples a second, whatever the rate, and on nothing but the places: shifting or turning the
/// scene changes nothing, and a hand that rests (less than 0.05 mm in 30 ms) does not turn.
class StrokeFinder {
 public:
  static constexpr double kRateHz = 100, kTurnDeg = 60, kLeastMm = 1, kLeastS = 0.08, kPauseS = 0.1, kStillMm = 0.05;
  static constexpr std::size_t kReach = 3;  ///< samples, 30 ms
  /// In order of time. Not called while the burr does not drill.
  void add(double t_s, Vec3 at_mm);
  /// All of them; nothing may be added afterwards.
  [[nodiscard]] const std::vector<Stroke>& finish();

 private:
  void end_period();
  struct Sample {
    double t_s;
    Vec3 at_mm;
  };
  std::vector<Sample> period_;
  std::vector<Stroke> strokes_;
};

/// How little strokes follow one line: over each five in a row 1 - the largest eigenvalue of the mean of d d^T, the mean of these. 0: all
/// on one line, 2/3: in all directions alike. 0 with fewer than five.
[[nodiscard]] double stroke_variance(const std::vector<Stroke>& strokes);

}  // namespace osteo
