// How a session is shown as a movie: plain values.
#pragma once
#include "osteo/core/base/param.h"

namespace osteo::inline assessment {

enum class MovieCamera : int { surgeon, fixed };
[[nodiscard]] constexpr std::array<std::string_view, 2> enum_names(MovieCamera) {
  return {"surgeon", "fixed"};
}

struct MovieOptions {
  MovieCamera camera = MovieCamera::surgeon;
  int width = 1280, height = 720, fps = 30;
  double speed = 1, from_s = 0, to_s = -1;
  bool skip_idle = false;
  bool overlay = true;  ///< time, force, nearest structure, volume removed
  bool deep = false;    ///< creases shaded and edges smoothed (PictureStyle::effects)
};

}  // namespace osteo::inline assessment
