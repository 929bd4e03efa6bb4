#include "osteo/app/stages/mesh.h"

#include <algorithm>
#include <chrono>

#include "osteo/geometry/tets/skin.h"

namespace osteo::inline app {
namespace {

Vec3 vec(const std::array<float, 3>& p) {
  return {p[0], p[1], p[2]};
}

}  // namespace

StageInfo EmbedSurfaceStage::info() {
  return {.name = "embed-surface",
          .version = 2,
          .synopsis = "a surface that follows a tetrahedral mesh when it deforms",
          .description =
              "Binds the surface to the mesh at rest and moves it with the deformed mesh, which must have the same "
              "points in the same order.",
          .inputs = {{"surface", {DataKind::surface}, "surface at rest"},
                     {"rest", {DataKind::tets}, "mesh at rest"},
                     {"deformed", {DataKind::tets}, "the same mesh, its points moved"}},
          .outputs = {{"skinned", {DataKind::surface}, "the surface, moved"}},
          .references = {"D. Morris, Haptics and Physical Simulation for Virtual Bone Surgery, 2006, section 5.4.2"},
          .example = "osteo embed-surface bone.ply rest.vtu deformed.vtu moved.ply"};
}

std::vector<Data> EmbedSurfaceStage::run(const Params& p, std::span<const Data> inputs, const Context& context) {
  const TriMesh& surface = *std::get<Surface>(inputs[0]);
  const TetMesh &rest = *std::get<Tets>(inputs[1]), &deformed = *std::get<Tets>(inputs[2]);
  const Skin skin(surface, rest, {p.method, p.neighbours}, context);
  TriMesh moved = surface;
  moved.normals.clear();
  const auto begin = std::chrono::steady_clock::now();
  skin.apply({deformed.points_mm.data(), deformed.points_mm.size()}, moved.points_mm);
  const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  double most = 0;
  for (std::size_t i = 0; i < moved.points_mm.size(); ++i)
    most = std::max(most, length(vec(moved.points_mm[i]) - vec(surface.points_mm[i])));
  context.report("points", static_cast<std::int64_t>(moved.points_mm.size()));
  context.report("points_outside", static_cast<std::int64_t>(skin.outside()));
  context.report("largest_move_mm", most);
  context.info("moved in " + format_number(std::round(ms * 1000) / 1000) + " ms");
  context.progress(1.0);
  return {std::make_shared<const TriMesh>(std::move(moved))};
}

}  // namespace osteo::inline app
