// A picture of a pen, and where it is.
#pragma once
#include <array>
#include <memory>

#include "osteo/core/data/rigid_transform.h"
#include "osteo/simulation/marker/body.h"
#include "osteo/simulation/marker/detail/camera.h"

namespace osteo::inline simulation {

/// What a picture shows of one pen.
struct PenSight {
  enum class State {
    seen,
    nothing,    ///< no marker of this pen
    ambiguous,  ///< one marker, or one flat side from afar: more than one pose explains it, and nothing before says
                ///< which
    doubled,    ///< a marker twice, and nothing before says whose: two pens with the same print
    unlike,     ///< markers, but no pose of this body explains them: another print, or another camera
  };
  State state = State::nothing;
  RigidTransform camera_from_body;  ///< mm; when seen
  double rms_px = 0;                ///< of the corners
  int markers = 0;                  ///< used
  int markers_left_out = 0;         ///< that did not fit the others
  bool doubled = false;             ///< some marker was there twice
  bool other_pen = false;           ///< markers of another pen are in the picture
  bool dark = false;                ///< too dark to see markers in
  bool mirrored = false;            ///< the picture came mirrored, and was turned
  /// Of a turn by a small vector (about the camera's axes, around the body's origin, rad) and a shift (mm), for corners
  /// known to one pixel in each direction; row by row.
  std::array<double, 36> covariance_a_px2{};
};

/// Finds markers (OpenCV's ArUco), their corners by straight lines through the edges' gradients, and the pose that
/// explains all corners. Where the pen was seen just before, only there. About 2 ms a picture then, 15 without (1280 x
/// 720). Used by one thread.
class PenTracker {
 public:
  /// `scale`: printed mm for a drawn one.
  PenTracker(const CameraModel& camera, int pen, double scale = 1);
  ~PenTracker();
  PenTracker(const PenTracker&) = delete;
  PenTracker& operator=(const PenTracker&) = delete;
  /// Error(usage) for a picture of another size than the camera's.
  [[nodiscard]] PenSight look(const GrayPicture& picture);
  /// What was seen before does not count.
  void forget();

 private:
  struct Inside;
  std::unique_ptr<Inside> inside_;
};

/// The pose by corners alone: `pixels` four of each patch, in order. Exact corners give the pose to rounding. Without a
/// guess all poses that a flat marker may have are tried. State seen, ambiguous, unlike.
struct MarkerCorners {
  MarkerPatch patch;
  std::array<std::array<double, 2>, 4> pixel;
};
[[nodiscard]] PenSight pose_of(const CameraModel& camera, const std::vector<MarkerCorners>& seen,
                               const RigidTransform* guess = nullptr);
/// Where a point of the camera's frame is seen.
[[nodiscard]] std::array<double, 2> project(const CameraModel& camera, Vec3 point_mm);

}  // namespace osteo::inline simulation
