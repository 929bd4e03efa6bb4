// How a session is shown as a movie: plain values.
#pragma once
#include "osteo/base/param.h"

namespace osteo {

enum class MovieCamera : int { surgeon, fixed };
template <>
struct EnumNames<MovieCamera> {
  static constexpr std::array<std::string_view, 2> values{"surgeon", "fixed"};
};

struct MovieOptions {
  MovieCamera camera = MovieCamera::surgeon;
  int width = 1280, height = 720, fps = 30;
  double speed = 1, from_s = 0, to_s = -1;
  bool skip_idle = false;
  bool overlay = true;  ///< time, force, nearest structure, volume removed
  bool deep = false;    ///< creases shaded and edges smoothed (PictureStyle::effects)
};

}  // namespace osteo
