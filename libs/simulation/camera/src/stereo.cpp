#include "osteo/simulation/camera/stereo.h"

#include <algorithm>
#include <cmath>

namespace osteo::inline simulation {
namespace {

// Convergence no nearer than half way to the eye.
double convergence_mm(const ScopeView& view, const StereoParams& stereo) {
  return view.working_distance_mm - std::min(stereo.convergence_mm, 0.5 * view.working_distance_mm);
}

}  // namespace

StereoEye stereo_eye(const ScopeView& view, const StereoParams& stereo, const PictureArea& area, int eye) {
  const double side = ((eye == 0) == stereo.swap ? 0.5 : -0.5) * stereo.base_mm;
  // Half of what the picture shows across, where the two agree.
  const double half_mm =
      convergence_mm(view, stereo) / view.working_distance_mm * area.width / 2 / view.pixels_per_mm(area);
  return {view.eye_mm() + view.right() * side, -side / half_mm};
}

double disparity_px(const ScopeView& view, const StereoParams& stereo, const PictureArea& area, Vec3 place_mm) {
  const double z = dot(view.eye_mm() - place_mm, view.back), c = convergence_mm(view, stereo);
  const double px_per_mm = view.pixels_per_mm(area) * view.working_distance_mm / c;
  return (stereo.swap ? -1 : 1) * stereo.base_mm * (c - z) / z * px_per_mm;
}

std::vector<StereoPiece> stereo_pieces(const StereoParams& stereo, int rows, int first_row) {
  std::vector<StereoPiece> pieces;
  switch (stereo.mode) {
    case StereoMode::side_by_side:
      pieces.push_back({0, {true, true, true}, {0, 0, 0.5, 1}});
      pieces.push_back({1, {true, true, true}, {0.5, 0, 1, 1}});
      break;
    case StereoMode::top_bottom:
      pieces.push_back({0, {true, true, true}, {0, 0, 1, 0.5}});
      pieces.push_back({1, {true, true, true}, {0, 0.5, 1, 1}});
      break;
    case StereoMode::anaglyph:
      pieces.push_back({0, {true, false, false}});
      pieces.push_back({1, {false, true, true}});
      break;
    case StereoMode::interlaced:
      pieces.push_back({0});
      for (int row = (first_row % 2 == 0) ? 1 : 0; row < rows; row += 2) {
        const double top = static_cast<double>(row) / rows, bottom = static_cast<double>(row + 1) / rows;
        pieces.push_back({1, {true, true, true}, {0, top, 1, bottom}, {0, top, 1, bottom}});
      }
      break;
    case StereoMode::off:
    case StereoMode::quad_buffer:
      pieces.push_back({0});
      break;
  }
  return pieces;
}

std::array<double, 2> unsqueezed(StereoMode mode, const PictureArea& area, double x, double y) {
  if (mode == StereoMode::side_by_side) {
    const double half = area.width / 2;
    x = area.x + 2 * (x - area.x < half ? x - area.x : x - area.x - half);
  } else if (mode == StereoMode::top_bottom) {
    const double half = area.height / 2;
    y = area.y + 2 * (y - area.y < half ? y - area.y : y - area.y - half);
  }
  return {x, y};
}

}  // namespace osteo::inline simulation
