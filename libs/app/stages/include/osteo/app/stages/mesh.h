// The stages mesh-info, mesh-repair, tetrahedralize and skin. The first three use CGAL and TetGen where the build has
// them.
#pragma once
#include "osteo/core/stage/stage.h"
#include "osteo/geometry/tets/skin.h"

namespace osteo::inline app {

struct MeshInfoParams {
  bool self_intersections = true;
};
struct MeshInfoStage {
  using Params = MeshInfoParams;
  static void describe(Params& p, auto& visit) {
    visit({"self_intersections", "count pairs of triangles that intersect (needs a build with CGAL)"},
          p.self_intersections);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

struct MeshRepairParams {
  double weld_mm = 0;
  int max_hole_edges = 200;
  bool self_intersections = true;
  bool allow_loss = false;
  double min_body_area_mm2 = 0;
  bool keep_largest = false;
};
struct MeshRepairStage {
  using Params = MeshRepairParams;
  static void describe(Params& p, auto& visit) {
    visit({"weld_mm", "points nearer than this become one (0: equal ones only)", "mm", 0, 1000}, p.weld_mm);
    visit({"max_hole_edges", "close holes of at most so many edges (0: none)", "", 0, 1000000}, p.max_hole_edges);
    visit({"self_intersections", "resolve self-intersections: cut along each other, keep what bounds the inside"},
          p.self_intersections);
    visit({"allow_loss", "keep steps that take more than 3 % of the volume; else they are undone"}, p.allow_loss);
    visit({"min_body_area_mm2", "drop bodies of smaller area", "mm2", 0, 1e12}, p.min_body_area_mm2);
    visit({"keep_largest", "keep only the body of most area"}, p.keep_largest);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

enum class TetMethod : int { grid, grid_conforming, graded, tetgen, cgal };
[[nodiscard]] constexpr std::array<std::string_view, 5> enum_names(TetMethod) {
  return {"grid", "grid-conforming", "graded", "tetgen", "cgal"};
}
struct TetrahedralizeParams {
  TetMethod method = TetMethod::grid_conforming;
  double spacing_mm = 0;
  int resolution = 40;
  bool margin = false;
  double target_dihedral_deg = 15;
  bool keep_thin = true;
  int levels = 3;
  double surface_spacing_mm = 0;
  double max_volume_mm3 = 0;
  bool clean = false;
  double time_limit_s = 600, memory_limit_gb = 8;
};
struct TetrahedralizeStage {
  using Params = TetrahedralizeParams;
  static void describe(Params& p, auto& visit) {
    visit({"method",
           "grid: five to a voxel; grid-conforming: following the surface, any surface; graded: small at the surface, "
           "large inside; "
           "tetgen: keeps the "
           "surface's triangles; cgal: Delaunay refinement"},
          p.method);
    visit({"spacing_mm", "edge of the cubes or tetrahedra (0: from --resolution)", "mm", 0, 1000}, p.spacing_mm);
    visit({"resolution", "cubes along the longest extent", "", 1, 2000}, p.resolution);
    visit({"margin", "grid: one voxel more all round, as in the thesis: the body becomes too large and too stiff"},
          p.margin);
    visit({"target_dihedral_deg", "grid-conforming: improve tetrahedra below this (0: none)", "degrees", 0, 30},
          p.target_dihedral_deg);
    visit({"keep_thin",
           "grid-conforming: halve the spacing, three times at most, where over 5 % of the volume would be lost"},
          p.keep_thin);
    visit({"levels", "graded: how often edges double inward", "", 0, 8}, p.levels);
    visit(
        {"surface_spacing_mm", "cgal: size at the surface, growing inward to spacing_mm (0: the same)", "mm", 0, 1000},
        p.surface_spacing_mm);
    visit({"max_volume_mm3", "tetgen: largest volume of a tetrahedron (0: from the spacing)", "mm3", 0, 1e12},
          p.max_volume_mm3);
    visit({"clean", "repair the surface first, as mesh-repair does"}, p.clean);
    visit({"time_limit_s", "tetgen, cgal: stopped after so long (0: never)", "s", 0, 1e7}, p.time_limit_s);
    visit({"memory_limit_gb", "tetgen, cgal: stopped when they want more (0: all there is)", "GB", 0, 1e5},
          p.memory_limit_gb);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

struct SkinParams {
  SkinMethod method = SkinMethod::embedded;
  int neighbours = 5;
};
struct EmbedSurfaceStage {
  using Params = SkinParams;
  static void describe(Params& p, auto& visit) {
    visit(
        {"method",
         "embedded: by position in the tetrahedron; frames: by frames on the nearest surface points, as in the thesis"},
        p.method);
    visit({"neighbours", "frames: how many surface points each point follows", "", 1, 16}, p.neighbours);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

/// What of CGAL and TetGen this build has, for the licence text: "", "CGAL (GPL)", "CGAL (GPL) and TetGen (AGPL)".
[[nodiscard]] std::string_view copyleft_parts();

}  // namespace osteo::inline app
