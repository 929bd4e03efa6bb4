#include "camera_notes.h"

#include <utility>

#include "osteo/core/base/param.h"

namespace osteo::inline app {
namespace {

std::string triple(Vec3 v) {
  return "[" + format_number(v.x) + "," + format_number(v.y) + "," + format_number(v.z) + "]";
}

}  // namespace

std::optional<std::string> CameraNotes::next(const CameraView& view, double now_s, const void* session) {
  constexpr double kMinS = 0.99 / 60;  // pictures come at 60 Hz, more or less
  if (std::exchange(session_, session) != session) noted_.reset();
  if (noted_ && (*noted_ == view || now_s - noted_s_ < kMinS)) return std::nullopt;
  noted_ = view;
  noted_s_ = now_s;
  return "{\"eye_mm\":" + triple(view.eye_mm) + ",\"target_mm\":" + triple(view.target_mm) +
         ",\"up\":" + triple(view.up) + ",\"view_angle_deg\":" + format_number(view.view_angle_deg) +
         ",\"pixels_per_mm\":" + format_number(view.pixels_per_mm) +
         ",\"magnification\":" + format_number(view.magnification) + "}";
}

}  // namespace osteo::inline app
