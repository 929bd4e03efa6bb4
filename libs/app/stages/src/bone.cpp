#include "bone.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/core/base/json_document.h"
#include "osteo/geometry/mesh/bone_surface.h"
#include "osteo/simulation/bone/pieces.h"
#include "osteo/simulation/bone/saw.h"

namespace osteo::inline app {
namespace {

Vec3 vec(const std::array<double, 3>& a) {
  return {a[0], a[1], a[2]};
}

Vec3 centre_of_mass(const BrickGrid& bone) {
  Vec3 sum{};
  double mass = 0;
  for (VoxelKey v = 0; v < bone.brick_count() * BrickGrid::kVoxels; ++v) {
    const auto m = static_cast<double>(bone.value(v));
    if (m <= 0) continue;
    const Ijk c = bone.coordinate(v);
    sum += Vec3{double(c.i), double(c.j), double(c.k)} * m;
    mass += m;
  }
  if (!(mass > 0)) throw Error(ExitCode::failed, "the grid holds no bone");
  return bone.frame().world_from_index(sum / mass);
}

}  // namespace

StageInfo SawStage::info() {
  return {.name = "saw",
          .version = 1,
          .synopsis = "a cut through bone by a plane or a blade",
          .description =
              "Removes what a box of the blade's thickness covers, voxels in part where it covers them in part. With "
              "no length and depth the "
              "cut goes all through. 'separate-fragments' lists what is no longer connected.",
          .inputs = {{"bone", {DataKind::grid}, "density, as resample makes it"}},
          .outputs = {{"cut", {DataKind::grid}, "the same with the cut"}},
          .references = {"D. Morris, Haptics and Physical Simulation for Virtual Bone Surgery, 2006, section 3.2.5"},
          .example = "osteo saw bone.vdb cut.vdb --normal 1,0,0 --kerf-mm 0.8"};
}

std::vector<Data> SawStage::run(const Params& p, std::span<const Data> inputs, const Context& context) {
  const auto& grid = std::get<SparseGrid>(inputs[0]);
  BrickGrid bone = to_bricks(grid);
  SawCut cut{vec(p.at_mm), vec(p.normal), vec(p.along), p.kerf_mm, p.length_mm, p.depth_mm};
  if (!(length(cut.normal) > 0)) throw Error(ExitCode::usage, "--normal has no length");
  if (p.from_centre) cut.at_mm += centre_of_mass(bone);
  std::vector<VoxelKey> changed;
  const double removed = apply_saw(bone, cut, changed);
  if (changed.empty()) context.warn("the blade meets no bone");
  context.report("removed_mm3", removed);
  context.report("voxels_changed", static_cast<std::int64_t>(changed.size()));
  context.progress(1.0);
  return {to_sparse(bone, grid.name)};
}

StageInfo SeparateFragmentsStage::info() {
  return {
      .name = "separate-fragments",
      .version = 2,
      .synopsis = "the fragments of a bone: its connected components",
      .description =
          "Finds the parts that are no longer connected, with mass (from density), centre and inertia; drops crumbs; "
          "writes the surface of "
          "all fragments, each enclosing what its bone measures, moved apart for a look when asked, and the bone of "
          "one "
          "or all.",
      .inputs = {{"bone", {DataKind::grid}, "density, as resample or saw make it"}},
      .outputs = {{"pieces", {DataKind::document}, "the fragments, largest first, in JSON"},
                  {"surface", {DataKind::surface}, "closed, one body or more a piece", true},
                  {"kept", {DataKind::grid}, "density of the piece that --keep names, or of all but the crumbs", true}},
      .references = {"D. Morris, Haptics and Physical Simulation for Virtual Bone Surgery, 2006, section 3.2.6"},
      .example = "osteo separate-fragments cut.vdb fragments.json --surface-out fragments.ply --apart-mm 15"};
}

std::vector<Data> SeparateFragmentsStage::run(const Params& p, std::span<const Data> inputs, const Context& context) {
  const auto& grid = std::get<SparseGrid>(inputs[0]);
  const BrickGrid bone = to_bricks(grid);
  const Split split = split_bone(bone, p.least_mm3, p.connectivity);
  const double voxel = bone.frame().voxel_volume_mm3();
  if (split.pieces.empty())
    throw Error(ExitCode::failed, "no part is as large as --min-volume-mm3", "is this a grid of bone density?");
  if (p.keep > static_cast<int>(split.pieces.size()))
    throw Error(ExitCode::usage, "--keep " + std::to_string(p.keep) + ": there are only " +
                                     std::to_string(split.pieces.size()) + " fragments");
  Vec3 middle{};
  double mass = 0;
  for (const Piece& piece : split.pieces) {
    middle += piece.solid.centre_mm * piece.solid.mass;
    mass += piece.solid.mass;
  }
  middle = middle / mass;
  Json j;
  j["fragments"] = Json::list();
  j["crumbs"] = {{"count", split.crumbs}, {"volume_mm3", split.crumbs_mm3}};
  TriMesh all;
  for (std::size_t n = 0; n < split.pieces.size(); ++n) {
    const Piece& piece = split.pieces[n];
    context.progress(static_cast<double>(n) / static_cast<double>(split.pieces.size()), "surfaces");
    const Vec3 away = split.pieces.size() > 1 ? normalized(piece.solid.centre_mm - middle) * p.apart_mm : Vec3{};
    Json inertia = Json::list();
    // About the centre, for a density of 1 g/cm3 where bone is whole: g mm2.
    for (const double i : piece.solid.inertia_mm2) inertia.push_back(i * voxel / 1000);
    const VolumeSurface surface = surface_of_volume(piece.bone, context);
    j["fragments"].push_back(
        {{"volume_mm3", piece.volume_mm3()},
         {"surface_volume_mm3", surface.surface_mm3},
         {"surface_moved_mm", surface.moved_mm},
         {"centre_mm", {piece.solid.centre_mm.x, piece.solid.centre_mm.y, piece.solid.centre_mm.z}},
         {"inertia_g_mm2_at_1_g_per_cm3", inertia},
         {"moved_mm", {away.x, away.y, away.z}}});
    const TriMesh& mesh = surface.mesh;
    const auto first = static_cast<std::uint32_t>(all.points_mm.size());
    for (const auto& q : mesh.points_mm)
      all.points_mm.push_back(
          {q[0] + static_cast<float>(away.x), q[1] + static_cast<float>(away.y), q[2] + static_cast<float>(away.z)});
    for (const auto& t : mesh.triangles) all.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  context.report("fragments", static_cast<std::int64_t>(split.pieces.size()));
  context.report("largest_mm3", split.pieces.front().volume_mm3());
  context.report("crumbs", static_cast<std::int64_t>(split.crumbs));
  context.report("crumbs_mm3", split.crumbs_mm3);
  SparseGrid kept;
  if (p.keep > 0) {
    kept = to_sparse(split.pieces[static_cast<std::size_t>(p.keep - 1)].bone, grid.name);
  } else {
    BrickGrid whole(bone);
    for (VoxelKey v = 0; v < whole.brick_count() * BrickGrid::kVoxels; ++v) {
      const Ijk c = whole.coordinate(v);
      float sum = 0;
      for (const Piece& piece : split.pieces) sum += piece.bone.at(c.i, c.j, c.k);
      whole.set(v, sum);
    }
    kept = to_sparse(whole, grid.name);
  }
  context.progress(1.0);
  return {Document{j.dump(1) + "\n"}, std::make_shared<const TriMesh>(std::move(all)), std::move(kept)};
}

}  // namespace osteo::inline app
