// Two eyes at one microscope: parallel axes, frusta set off so that both show the same of one plane, the convergence.
// Turning the eyes towards each other instead (toe-in) would tilt the two pictures against each other, which hurts. And
// how the two pictures reach the eyes.
#pragma once
#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "osteo/core/base/param.h"
#include "osteo/simulation/camera/microscope.h"

namespace osteo::inline simulation {

enum class StereoMode : int { off, side_by_side, top_bottom, anaglyph, interlaced, quad_buffer };
[[nodiscard]] constexpr std::array<std::string_view, 6> enum_names(StereoMode) {
  return {"off", "side_by_side", "top_bottom", "anaglyph", "interlaced", "quad_buffer"};
}

struct StereoParams {
  StereoMode mode = StereoMode::off;
  double base_mm = 22;        ///< between the eyes, at the instrument; operating microscopes have 22 to 25
  double convergence_mm = 0;  ///< what lies so far in front of the focus lies in the screen
  bool swap = false;          ///< the eyes
};

/// One of the two; 0 is the left.
struct StereoEye {
  Vec3 eye_mm;
  /// Middle of the picture as part of half its width: the frustum's, as VTK's window centre has it.
  double window_centre_x = 0;
};
[[nodiscard]] StereoEye stereo_eye(const ScopeView& view, const StereoParams& stereo, const PictureArea& area, int eye);

/// Pixels by which a place lies further to the right for the left eye than for the right one: 0 in the plane of
/// convergence, more in front of it. base (C - Z) / Z times the pixels of a mm at C, with C and Z the distances of
/// convergence and place from the eyes.
[[nodiscard]] double disparity_px(const ScopeView& view, const StereoParams& stereo, const PictureArea& area,
                                  Vec3 place_mm);

/// A part of an eye's picture and where it goes; parts of 0 to 1 of the picture, y downwards.
struct StereoPiece {
  int eye = 0;
  std::array<bool, 3> channels{true, true, true};  ///< red, green, blue
  std::array<double, 4> to{0, 0, 1, 1};            ///< left, top, right, bottom
  std::array<double, 4> from{0, 0, 1, 1};
};
/// How the two pictures are put together for a screen. side_by_side and top_bottom squeeze each to half, as such
/// screens expect; anaglyph: left eye red, right eye green and blue; interlaced: even rows of the screen are the left
/// eye's. quad_buffer and off: the whole of the left eye (the right one goes to its own buffer). `rows` of the picture,
/// `first_row` of it on the screen.
[[nodiscard]] std::vector<StereoPiece> stereo_pieces(const StereoParams& stereo, int rows, int first_row);

/// Where a pixel of the screen lies in the picture of an eye: mouse over a squeezed picture.
[[nodiscard]] std::array<double, 2> unsqueezed(StereoMode mode, const PictureArea& area, double x, double y);

}  // namespace osteo::inline simulation
