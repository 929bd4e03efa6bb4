#include "osteo/session/scene/session_folder.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/param.h"
#include "osteo/geometry/mesh/bone_surface.h"
#include "osteo/imaging/io/surface_io.h"
#include "osteo/simulation/bone/plates.h"
#include "osteo/simulation/bone/world_mesh.h"

namespace osteo::inline session {
namespace {

Json matrix(const RigidTransform& t) {
  Json rows = Json::list();
  for (std::size_t r = 0; r < 3; ++r)
    rows.push_back({t.rotation.column[0][r], t.rotation.column[1][r], t.rotation.column[2][r], t.shift_mm[r]});
  rows.push_back({0, 0, 0, 1});
  return rows;
}
Json point_json(Vec3 v) {
  return {v.x, v.y, v.z};
}

Json gaps_of(const World& world, const Fixture& f, const fs::path& csv) {
  const PlateModel& plate = plate_library()[f.plate];
  const RigidTransform pose = pose_of(world, f);
  std::vector<double> gaps;
  std::string text = "x_mm,y_mm,z_mm,gap_mm,piece\n";
  std::size_t none = 0;
  constexpr double kPlateReachMm = 5;
  for (const PlateGap& g : plate_gaps(world, plate, pose, f.opening_mm, 400, kPlateReachMm)) {
    const Vec3 p = pose(g.at_mm);
    const bool met = g.body != SceneAction::kNobody;
    text += format_number(p.x) + "," + format_number(p.y) + "," + format_number(p.z) + "," +
            (met ? format_number(g.gap_mm) : "") + "," + (met ? std::to_string(g.body) : "") + "\n";
    if (met) gaps.push_back(g.gap_mm);
    none += met ? 0 : 1;
  }
  write_file(csv, text);
  Json j;
  j["points"] = gaps.size() + none;
  j["points_without_bone_within_5_mm"] = none;
  if (gaps.empty()) return j;
  std::sort(gaps.begin(), gaps.end());
  double sum = 0, close = 0;
  for (const double g : gaps) {
    sum += g;
    close += std::abs(g) <= 0.5 ? 1 : 0;
  }
  j["mean_mm"] = sum / static_cast<double>(gaps.size());
  j["least_mm"] = gaps.front();
  j["median_mm"] = gaps[gaps.size() / 2];
  j["most_mm"] = gaps.back();
  j["share_within_half_a_mm"] = close / static_cast<double>(gaps.size() + none);
  return j;
}

}  // namespace

std::string write_result(const World& world, const fs::path& folder, const Context& context) {
  if (fs::exists(folder) && !(fs::is_directory(folder) && fs::is_empty(folder)))
    throw Error(ExitCode::cannot_write, "'" + folder.string() + "' exists already", "give the name of a new folder");
  std::error_code ec;
  fs::create_directories(folder, ec);
  if (ec) throw Error(ExitCode::cannot_write, "cannot make the folder '" + folder.string() + "': " + ec.message());
  Json j;
  j["osteotome_plan"] = 1;
  j["units"] = "mm, LPS; transforms take points of the case to where they are now";
  j["fragments"] = Json::list();
  j["pieces_without_bone"] = Json::list();  // by their numbers: sawn or drilled away
  constexpr double kWarnPercent = 0.1;
  const double steps = static_cast<double>(world.bodies().size() + world.fixtures().size());
  double done = 0;
  for (const PlacedBody& b : world.bodies()) {
    context.progress(done++ / steps, "fragments");
    const std::string name = "piece-" + std::to_string(b.body->id) + ".stl";
    const VolumeSurface surface = surface_of_volume(b.body->bone, context);
    if (surface.mesh.triangles.empty()) {
      context.warn("piece " + std::to_string(b.body->id) + ": no bone is left of it, so it has no file");
      j["pieces_without_bone"].push_back(b.body->id);
      continue;
    }
    save_surface(moved(surface.mesh, b.world_from_body), folder / name);
    const double off_percent = surface.bone_mm3 > 0 ? 100 * (surface.surface_mm3 / surface.bone_mm3 - 1) : 0;
    if (std::abs(off_percent) > kWarnPercent)
      context.warn("piece " + std::to_string(b.body->id) + ": its surface holds " + format_number(surface.surface_mm3) +
                   " mm3, the bone " + format_number(surface.bone_mm3) +
                   ": too few voxels for a surface of that volume");
    const LiveComponents solid(b.body->bone);
    const double voxel = b.body->bone.frame().voxel_volume_mm3();
    const auto& parts = solid.components();
    const auto largest =
        std::max_element(parts.begin(), parts.end(), [](const auto& x, const auto& y) { return x.mass < y.mass; });
    Json piece{{"number", b.body->id},
               {"file", name},
               {"volume_mm3", surface.bone_mm3},
               {"surface_volume_mm3", surface.surface_mm3},
               {"surface_volume_off_percent", off_percent},
               {"surface_at_density", static_cast<double>(surface.iso)},
               {"surface_scaled_by", surface.scale},
               {"surface_moved_mm", surface.moved_mm},
               {"region_of_interest", b.of_region},
               {"transform", matrix(b.world_from_body)},
               {"shift_mm", point_json(b.world_from_body.shift_mm)}};
    if (largest != parts.end()) {
      piece["centre_mm"] = point_json(b.world_from_body(largest->centre_mm));
      piece["inertia_g_mm2_at_1_g_per_cm3_in_the_case"] = Json::list();
      for (const double i : largest->inertia_mm2)
        piece["inertia_g_mm2_at_1_g_per_cm3_in_the_case"].push_back(i * voxel / 1000);
    }
    j["fragments"].push_back(piece);
  }
  j["plates"] = Json::list();
  for (const Fixture& f : world.fixtures()) {
    context.progress(done++ / steps, "plates");
    const PlateModel& plate = plate_library()[f.plate];
    const std::string name = "plate-" + std::to_string(f.id);
    save_surface(plate_of(world, f), folder / (name + ".stl"));
    const RigidTransform pose = pose_of(world, f);
    Json screws = Json::list();
    for (const Vec3 h : plate.holes_mm) {
      const bool moves = plate.most_opening_mm > 0 && h.x > 0;
      screws.push_back(point_json(pose(h + Vec3{moves ? f.opening_mm : 0, 0, 0})));
    }
    Json on = Json::list();
    on.push_back(f.body);
    if (f.other != SceneAction::kNobody) on.push_back(f.other);
    j["plates"].push_back({{"number", f.id},
                           {"plate", plate.name},
                           {"about", plate.about},
                           {"file", name + ".stl"},
                           {"fragments", on},
                           {"transform", matrix(pose)},
                           {"opening_mm", f.opening_mm},
                           {"screw_diameter_mm", plate.screw_mm},
                           {"screws_at_mm", screws},
                           {"screws_towards", point_json(pose.rotation.column[2] * -1)},
                           {"gap", gaps_of(world, f, folder / (name + "-gap.csv"))}});
  }
  context.progress(1);
  const std::string text = j.dump(2) + "\n";
  write_file(folder / "plan.json", text);
  return text;
}

}  // namespace osteo::inline session
