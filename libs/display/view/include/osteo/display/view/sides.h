// A surface seen from several sides, for paper.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "osteo/core/data/data.h"
#include "osteo/display/view/snapshot.h"

namespace osteo::inline display {

/// In parallel, on white, all from one scale; `rgb`, where not empty, a colour for each point of the mesh. No display
/// is needed. Error(failed) when there is no OpenGL.
[[nodiscard]] std::vector<Picture> draw_sides(const TriMesh& mesh, std::span<const ViewFrom> sides, Vec3 centre_mm,
                                              double mm_per_pixel, int width, int height,
                                              std::span<const std::array<std::uint8_t, 3>> rgb = {});

/// What lies to the left and to the right of a picture from that side: "RL" from the front. Empty for left_front.
[[nodiscard]] std::string_view sides_of(ViewFrom from);
/// A bar of a round length with its name in the lower left corner. `ink` of 0 to 255.
void write_scale_bar(Picture& onto, double mm_per_pixel, int ink);

}  // namespace osteo::inline display
