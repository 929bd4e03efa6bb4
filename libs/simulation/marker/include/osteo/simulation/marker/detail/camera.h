// A calibrated camera: a pinhole with lens distortion, as a file; and how it is calibrated.
#pragma once
#include <array>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "osteo/simulation/marker/detail/picture.h"

namespace osteo::inline simulation {

/// Of pictures that are not mirrored: x right, y down, z away from the lens. A point at (x, y, 1) is seen at pixel
/// (fx x' + cx, fy y' + cy) with x', y' distorted by D. Brown's model (k1, k2, p1, p2, k3).
struct CameraModel {
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  std::array<double, 5> distortion{};
  bool mirrored = false;  ///< the camera delivers mirrored pictures: they are turned before anything else
  double fps = 30;        ///< asked of the camera
  double latency_ms =
      -1;  ///< from the middle of an exposure until the picture is here; below 0: not known, one period is taken
  double rms_px = 0;  ///< of its calibration
  int views = 0;

  [[nodiscard]] double period_ms() const { return 1000 / fps; }
  [[nodiscard]] double delay_ms() const { return latency_ms < 0 ? period_ms() : latency_ms; }
};

/// Error(no_input), Error(usage) with the line for a key that is not known, a value out of range, or a lens that cannot
/// be.
[[nodiscard]] CameraModel load_camera(const std::filesystem::path& path);
[[nodiscard]] std::string camera_json(const CameraModel& camera);

/// Gathers views of the plate and calibrates by those that differ: Z. Zhang, IEEE TPAMI 22(11), 2000, by OpenCV.
class CameraCalibration {
 public:
  static constexpr int kMinViews = 10, kMaxViews = 60;
  static constexpr double kMaxRmsPx = 1.0, kMaxFocalSpread = 0.01;

  /// What became of a picture.
  enum class Look { taken, no_plate, like_another, blurred };
  Look add(const GrayPicture& picture);
  [[nodiscard]] int views() const { return static_cast<int>(views_.size()); }
  [[nodiscard]] int pictures() const { return pictures_; }

  struct Result {
    CameraModel camera;
    double worst_view_px = 0;                ///< RMS of the worst view
    double focal_spread = 0;                 ///< standard deviation of fx by fx
    double seen_width = 0, seen_height = 0;  ///< share of the picture over which corners were seen
    std::vector<std::string> doubts;
  };
  /// Error(failed), saying what to do, with fewer than kMinViews views, an RMS above kMaxRmsPx, or views so alike
  /// that the focal length stays open: a plate that is hardly ever tilted, or kMaxFocalSpread.
  [[nodiscard]] Result solve() const;

 private:
  struct View {
    std::vector<std::array<float, 3>> plate_mm;
    std::vector<std::array<float, 2>> pixel;
    std::array<double, 8> hull{};  // four corners of the plate, in shares of the picture
  };
  std::vector<View> views_;
  int width_ = 0, height_ = 0, pictures_ = 0, with_plate_ = 0, mirrored_ = 0;
};

}  // namespace osteo::inline simulation
