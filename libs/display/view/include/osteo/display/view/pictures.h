// Pictures without a display: a snapshot of a result, a surface from several sides, still pictures of meshes.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/data.h"

namespace osteo::inline display {

// -- One picture of what a person wants to see of a result: three cuts and a lit view in 3D.

enum class ViewFrom : int { left_front, left, right, front, back, above, below };
[[nodiscard]] constexpr std::array<std::string_view, 7> enum_names(ViewFrom) {
  return {"left_front", "left", "right", "front", "back", "above", "below"};
}
/// Unit vector from the middle of the patient to the eye, LPS.
[[nodiscard]] Vec3 eye_direction(ViewFrom from);

struct SnapshotParams {
  int width = 1400;
  int height = 1000;
  ViewFrom view = ViewFrom::left_front;
  double bone_hu = 300;
  std::array<double, 3> centre_mm{0, 0, 0};
  std::string title;
};

struct SnapshotSubjects {
  Data subject;  ///< image, labels, grid, surface or tets
  Data mask;     ///< labels or grid, tinted over the cuts; optional. Labels with structures: in their colours, in 3D
                 ///< inside clear bone
  Data surface;  ///< shown in 3D instead of one made here; optional
};

/// Works without a display. Error(failed) when there is no OpenGL.
[[nodiscard]] Picture snapshot(const SnapshotSubjects& subjects, const SnapshotParams& params,
                               const Context& context = {});

// -- A surface seen from several sides, for paper.

/// Fewer triangles for pictures: what is far finer than a picture of a million pixels can show only costs time.
/// Its points are points of the whole mesh, whose numbers are kept. Not for measuring: it need not be closed.
struct PictureMesh {
  TriMesh mesh;
  std::vector<std::uint32_t> point;  ///< of the whole mesh, for each of `mesh`
};
/// Points that lie in one cube and face the same way are one, in cubes so large that 500,000 to 900,000 triangles are
/// left: of 1.2 mm for the surface of a whole head. Walls and wires thinner than that stay. A mesh of at most 800,000
/// triangles comes back as it is, else with normals in any case. 0.1 s a million triangles.
[[nodiscard]] PictureMesh mesh_for_pictures(const TriMesh& mesh);

struct SideView {
  ViewFrom from = ViewFrom::front;
  double mm_per_pixel = 1;
  bool coloured = false;  ///< by the points' colours, else as bone
};
/// In parallel, on white, all in one OpenGL context, squares of `pixels`; `rgb`: a colour for each point of the mesh,
/// or empty. No display is needed. Error(failed) when there is no OpenGL. In software 0.4 s a million triangles each.
[[nodiscard]] std::vector<Picture> draw_sides(const TriMesh& mesh, std::span<const SideView> sides, Vec3 centre_mm,
                                              int pixels, std::span<const std::array<std::uint8_t, 3>> rgb = {});

/// What lies to the left and to the right of a picture from that side: "RL" from the front. Empty for left_front.
[[nodiscard]] std::string_view sides_of(ViewFrom from);
/// A bar of a round length with its name in the lower left corner. `ink` of 0 to 255.
void write_scale_bar(Picture& onto, double mm_per_pixel, int ink);

// -- Still pictures of meshes, for pages: some solid, some clear, from any side, with a part cut off where it is in the
// way.

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
