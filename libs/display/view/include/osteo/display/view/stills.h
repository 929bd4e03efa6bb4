// Still pictures of meshes, for pages: some solid, some clear, from any side, with a part cut off where it is in the
// way.
#pragma once
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "osteo/core/data/data.h"

namespace osteo::inline display {

struct StillPart {
  std::shared_ptr<const TriMesh> mesh;
  std::array<double, 3> rgb{0.93, 0.88, 0.77};  ///< 0 to 1; bone's by default
  double opacity = 1;
  bool cut = false;  ///< Still::cut takes its near side off
};

struct Still {
  Vec3 centre_mm;
  double radius_mm = 30;           ///< a ball of it fills the picture's height
  Vec3 eye{1, 0, 0};               ///< unit, towards who looks
  Vec3 up{0, 0, 1};                ///< turned to be at right angles to `eye`
  std::vector<std::size_t> parts;  ///< which of the parts are in it
  std::optional<double>
      cut_mm;  ///< of parts that are `cut` all that is nearer than this to who looks, measured from the centre
  bool scale_bar = true;
  int width = 640, height = 480;
};

/// Without perspective, on a light ground, all in one OpenGL context, with creases darkened. Parts that are clear show
/// their near side only. No display is needed. Error(failed) when there is no OpenGL. About 0.3 s each for 500 000
/// triangles drawn in software.
[[nodiscard]] std::vector<Picture> draw_stills(std::span<const StillPart> parts, std::span<const Still> stills);

}  // namespace osteo::inline display
