// Between pictures and a hand: poses smoothed by how well each is known, and carried on to now.
#pragma once
#include <array>
#include <cstdint>

#include "osteo/core/data/vec.h"
#include "osteo/simulation/marker/detail/tracker.h"

namespace osteo::inline simulation {

/// Where a pen's tip goes: plain, so that threads can hand it on.
struct PenMotion {
  double time_s = 0;  ///< of the last picture's exposure
  Vec3 tip_mm, velocity_mm_s;
  Mat3 rotation;  ///< camera_from_body
  Vec3 turning_rad_s;
  /// At constant velocity; no farther than `kMaxAheadS` after the last picture.
  static constexpr double kMaxAheadS = 0.1;
  [[nodiscard]] Vec3 tip_at(double time_s) const;
  [[nodiscard]] Mat3 rotation_at(double time_s) const;
};

/// How lively a hand is taken to be: the spectral density of its acceleration, less while it rests. More follows
/// quicker and lets more noise through; chosen by measured error while moving and jitter at rest
/// (docs/how-to/marker.md).
struct PenFilterParams {
  double acceleration_mm2_s3 = 2e5;
  double turning_rad2_s3 = 60;
  double rest_share = 0.001;  ///< of both at rest; all of it from these speeds on, between with their squares
  double moving_mm_s = 25, turning_rad_s = 0.25;
  double corner_px = 0.1;  ///< corners are never taken to be known better
};

/// Kalman filters of constant velocity, of tip and rotation, each measured with the covariance that the picture gives:
/// across the view a pen is known well, along it ten times worse. Starts again after a gap of 0.3 s.
class PenFilter {
 public:
  explicit PenFilter(Vec3 tip_mm, const PenFilterParams& params = {});
  /// `sight` in state seen; times must rise.
  void add(double time_s, const PenSight& sight);
  void reset() { started_ = false; }
  [[nodiscard]] bool started() const { return started_; }
  [[nodiscard]] const PenMotion& motion() const { return motion_; }

 private:
  // Of position and velocity: 6 x 6, row by row.
  using Covariance = std::array<double, 36>;
  Vec3 tip_mm_;
  PenFilterParams params_;
  PenMotion motion_;
  Covariance tip_p_{}, turn_p_{};
  bool started_ = false;
};

}  // namespace osteo::inline simulation
