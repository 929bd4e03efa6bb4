// Where one looks from, told to the session when it changes. Private to libs/app/window; no VTK, no screen.
#pragma once
#include <optional>
#include <string>

#include "osteo/core/data/vec.h"

namespace osteo::inline app {

struct CameraView {
  Vec3 eye_mm, target_mm, up;
  double view_angle_deg = 30;  ///< from the picture's lower edge to its upper
  double pixels_per_mm = 0;    ///< at the target: magnification on this screen
  double magnification = 1;    ///< as an operating microscope's: field of view of 200 mm / magnification
  friend bool operator==(const CameraView&, const CameraView&) = default;
};

class CameraNotes {
 public:
  /// The value of a "camera" note, when the view is another than the last one noted in this session, and at most 60
  /// times a second. What comes too soon is noted with the next picture.
  std::optional<std::string> next(const CameraView& view, double now_s, const void* session);

 private:
  std::optional<CameraView> noted_;
  const void* session_ = nullptr;
  double noted_s_ = 0;
};

}  // namespace osteo::inline app
