#include "osteo/app/stages/mesh.h"

#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/core/base/guarded.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/tet_mesh.h"
#include "osteo/geometry/distance/compare.h"
#include "osteo/geometry/distance/solid.h"
#include "osteo/geometry/distance/voxelize.h"
#include "osteo/geometry/mesh/mesh_info.h"
#include "osteo/geometry/tets/lattice_tets.h"
#include "osteo/geometry/tets/quality.h"
#ifdef OSTEO_WITH_CGAL
#include "osteo/geometry/cgal/mesh_cgal.h"
#endif
#ifdef OSTEO_WITH_TETGEN
#include "osteo/geometry/tetgen/mesh_tetgen.h"
#endif

namespace osteo::inline app {
namespace {

#if !defined(OSTEO_WITH_CGAL) || !defined(OSTEO_WITH_TETGEN)
Error not_built(const std::string& what, const std::string& option) {
  return {ExitCode::failed, what + " is not in this build", "build with -D" + option + "=ON, or choose another method"};
}
#endif

[[maybe_unused]] constexpr double kMaxTets = 5e7;

// Beyond this share of the surface's volume a mesh is another body: grid-conforming takes smaller cubes.
constexpr double kVolumeOff = 0.05;
// What is off by more than this is said.
constexpr double kVolumeSaid = 0.02;

void report_volume(double mesh_mm3, double surface_mm3, const Context& context) {
  context.report("surface_volume_mm3", surface_mm3);
  const double off = surface_mm3 > 0 ? mesh_mm3 / surface_mm3 - 1 : 0;
  context.report("volume_off_percent", std::round(1e4 * off) / 100);
  if (std::abs(off) > kVolumeSaid)
    context.warn("the tetrahedra fill " + format_number(std::round(10 * mesh_mm3) / 10) + " mm3, the surface " +
                 format_number(std::round(10 * surface_mm3) / 10) + ": " + format_number(std::round(1e3 * off) / 10) +
                 " %; choose a smaller spacing, or tetgen, which keeps the surface");
}

double area_of(const TriangleSoup& soup) {
  double sum = 0;
  for (const auto& t : soup.triangles) {
    const Vec3 a = soup.points_mm[t[0]];
    sum += length(cross(soup.points_mm[t[1]] - a, soup.points_mm[t[2]] - a)) / 2;
  }
  return sum;
}

// What a step of repair did to the body.
class StepCost {
 public:
  StepCost(TriangleSoup before, const Context& context)
      : before_(std::move(before)), volume_(inside_volume_mm3(before_, context)), context_(context) {}
  // Reports the step under `name`; true when it takes too much of the body.
  bool too_dear(const std::string& name, const TriangleSoup& after, bool may_grow) {
    const double volume = inside_volume_mm3(after, context_), area = area_of(before_);
    const double off = volume_ > 0 ? volume / volume_ - 1 : 0;
    const auto percent = [](double share) { return std::round(1e4 * share) / 100; };
    context_.report(name + "_volume_percent", percent(off));
    context_.report(name + "_area_percent", percent(area > 0 ? area_of(after) / area - 1 : 0));
    context_.report(name + "_hausdorff_mm", compare_surfaces(after, before_, context_).hausdorff_mm());
    said_ = format_number(percent(off)) + " % of the volume";
    large_ = std::abs(off) > kVolumeSaid;
    return off < -kMaxLost || (!may_grow && off > kMaxLost);
  }
  [[nodiscard]] const std::string& said() const { return said_; }
  // Worth a word although it is kept.
  [[nodiscard]] bool large() const { return large_; }

 private:
  static constexpr double kMaxLost = 0.03;
  TriangleSoup before_;
  double volume_;
  const Context& context_;
  std::string said_;
  bool large_ = false;
};

// mesh-repair on plain values.
TriangleSoup repair(const TriMesh& mesh, const MeshRepairParams& p, const Context& context) {
  RepairReport r;
  RepairOptions options{p.weld_mm, true, p.min_body_area_mm2, p.keep_largest};
  options.turn_bodies = false;
  TriangleSoup soup = repaired(mesh, options, r, context.sub(0, 0.1));
  const auto keeps = [&](StepCost cost, const std::string& name, const std::string& step, const TriangleSoup& after,
                         bool may_grow) {
    const bool dear = cost.too_dear(name, after, may_grow);
    if (dear && !p.allow_loss) {
      context.warn(step + " would have changed " + cost.said() + " and was undone; --allow-loss keeps it");
      return false;
    }
    if (dear) context.warn(step + " changed " + cost.said() + ", and is kept as --allow-loss asks");
    if (!dear && cost.large()) context.warn(step + " changed " + cost.said());
    return true;
  };
  RepairReport turned;
  options.turn_bodies = true;
  TriangleSoup next = repaired(mesh, options, turned, context.sub(0.1, 0.2));
  if (turned.turned_bodies == 0 || keeps({soup, context}, "turning", "turning bodies round", next, false)) {
    soup = std::move(next);
    r = turned;
  }
  const auto whole = [](std::uint64_t v) { return static_cast<std::int64_t>(v); };
  context.report("unsound_triangles_dropped", whole(r.unsound));
  context.report("points_welded", whole(r.welded));
  context.report("degenerate_dropped", whole(r.degenerate));
  context.report("duplicates_dropped", whole(r.duplicates));
  context.report("triangles_turned", whole(r.flipped));
  context.report("bodies_turned", whole(r.turned_bodies));
  context.report("bodies_dropped", whole(r.dropped_bodies));
#ifdef OSTEO_WITH_CGAL
  CgalRepairReport c;
  if (p.max_hole_edges > 0) {
    next = holes_closed(soup, p.max_hole_edges, c, context.sub(0.3, 0.5));
    if (c.holes_filled > 0) {
      if (keeps({soup, context}, "holes", "closing holes", next, true)) {
        soup = std::move(next);
      } else {
        c.holes_left += c.holes_filled;
        c.holes_filled = 0;
      }
    }
    context.report("holes_filled", whole(c.holes_filled));
    context.report("holes_left", whole(c.holes_left));
  }
  if (p.self_intersections) {
    try {
      next = intersections_resolved(soup, c, context.sub(0.5, 0.9));
      if (c.self_intersections_before > 0) {
        if (keeps({soup, context}, "self_intersections", "resolving self-intersections", next, false)) {
          soup = std::move(next);
        } else {
          c.self_intersections_after = c.self_intersections_before;
        }
      }
    } catch (const Error& e) {
      if (e.code() != ExitCode::failed) throw;
      context.warn(std::string("self-intersections are left as they are: ") + e.what());
    }
    context.report("self_intersections_before", whole(c.self_intersections_before));
    context.report("self_intersections_after", whole(c.self_intersections_after));
    if (c.self_intersections_after > 0) {
      context.warn(std::to_string(c.self_intersections_after) +
                   " self-intersections are left; grid-conforming tetrahedra and distances do not mind");
    }
  }
#else
  if (p.max_hole_edges > 0 || p.self_intersections)
    context.warn("this build has no CGAL: holes and self-intersections are left as they are");
#endif
  return soup;
}

}  // namespace

std::string_view copyleft_parts() {
#if defined(OSTEO_WITH_CGAL) && defined(OSTEO_WITH_TETGEN)
  return "CGAL (GPL) and TetGen (AGPL)";
#elif defined(OSTEO_WITH_CGAL)
  return "CGAL (GPL)";
#elif defined(OSTEO_WITH_TETGEN)
  return "TetGen (AGPL)";
#else
  return "";
#endif
}

StageInfo MeshInfoStage::info() {
  return {.name = "mesh-info",
          .version = 2,
          .synopsis = "what a surface is like: closedness, bodies, holes, bad triangles",
          .description =
              "Counts what can be wrong with a surface and what it measures. Takes any file that can be read, however "
              "bad the surface.",
          .inputs = {{"surface", {DataKind::surface}, "triangles"}},
          .outputs = {{"findings", {DataKind::document}, "the figures in JSON"}},
          .references = {},
          .example = "osteo mesh-info bone.ply findings.json"};
}

std::vector<Data> MeshInfoStage::run(const Params& p, std::span<const Data> inputs, const Context& context) {
  const Surface& surface = std::get<Surface>(inputs[0]);
  const MeshSummary s = summarize(*surface, context.sub(0, 0.5));
  Json j;
  const auto put = [&](const std::string& key, auto value) {
    j[key] = value;
    if constexpr (std::is_same_v<decltype(value), std::uint64_t>) {
      context.report(key, static_cast<std::int64_t>(value));
    } else {
      context.report(key, value);
    }
  };
  put("points", s.points);
  put("triangles", s.triangles);
  put("watertight", s.watertight);
  put("manifold", s.manifold);
  put("bodies", s.bodies);
  put("inward_bodies", s.inward_bodies);
  put("holes", s.holes);
  put("open_edges", s.open_edges);
  put("nonmanifold_edges", s.nonmanifold_edges);
  put("nonmanifold_points", s.nonmanifold_points);
  put("disagreeing_edges", s.disagreeing_edges);
  put("non_finite_points", s.non_finite_points);
  put("bad_indices", s.bad_indices);
  put("unused_points", s.unused_points);
  put("equal_points", s.equal_points);
  put("degenerate", s.degenerate);
  put("duplicates", s.duplicates);
  put("zero_area", s.zero_area);
  put("needles", s.needles);
  put("caps", s.caps);
#ifdef OSTEO_WITH_CGAL
  if (p.self_intersections && s.non_finite_points == 0 && s.bad_indices == 0) {
    const auto pairs = self_intersections(soup_of(*surface), context.sub(0.5, 1.0));
    put("self_intersections", static_cast<std::uint64_t>(pairs.size()));
    auto& first = j["first_self_intersections"] = Json::list();
    for (std::size_t i = 0; i < std::min<std::size_t>(pairs.size(), 20); ++i)
      first.push_back({pairs[i].first, pairs[i].second});
  }
#else
  if (p.self_intersections) context.warn("this build has no CGAL: self-intersections are not counted");
#endif
  put("euler_characteristic", s.euler);
  put("area_mm2", s.area_mm2);
  if (s.watertight && s.non_finite_points == 0 && s.bad_indices == 0)
    put("volume_mm3", inside_volume_mm3(soup_of(*surface), context));
  put("min_edge_mm", s.min_edge_mm);
  put("mean_edge_mm", s.mean_edge_mm);
  put("max_edge_mm", s.max_edge_mm);
  j["bounds_mm"] = {{s.lo_mm.x, s.lo_mm.y, s.lo_mm.z}, {s.hi_mm.x, s.hi_mm.y, s.hi_mm.z}};
  j["triangles_by_smallest_angle_5_deg"] = s.min_angle_histogram;
  context.progress(1.0);
  return {Document{j.dump(2) + "\n"}};
}

StageInfo MeshRepairStage::info() {
  return {.name = "mesh-repair",
          .version = 3,
          .synopsis = "mends a surface: holes, duplicates, orientation, degenerate triangles, self-intersections",
          .description =
              "Takes out unsound, degenerate and duplicate triangles, joins equal points, makes neighbours and bodies "
              "agree on what is "
              "outside, "
              "closes holes, and resolves self-intersections: triangles are cut along each other exactly, and what "
              "bounds the inside (by "
              "the winding number) stays. Holes and self-intersections need a build with CGAL. Each step is measured "
              "(volume, area, "
              "Hausdorff distance); one that takes more than 3 % of the volume is undone, more than 2 % is said. The "
              "report says what was done and what is left.",
          .inputs = {{"surface", {DataKind::surface}, "triangles"}},
          .outputs = {{"repaired", {DataKind::surface}, "the mended surface"}},
          .references = {"P. Liepa, Filling Holes in Meshes, SGP 2003", "CGAL 5.5, Polygon Mesh Processing",
                         "Q. Zhou et al., Mesh Arrangements for Solid Geometry, SIGGRAPH 2016"},
          .example = "osteo mesh-repair scan.stl repaired.ply"};
}

std::vector<Data> MeshRepairStage::run(const Params& p, std::span<const Data> inputs, const Context& context) {
  TriMesh mesh = mesh_of(repair(*std::get<Surface>(inputs[0]), p, context.sub(0, 0.9)));
  const MeshCheck c = check(mesh);
  context.report("watertight", c.watertight());
  context.report("manifold", c.manifold());
  context.report("triangles", static_cast<std::int64_t>(mesh.triangles.size()));
  if (c.watertight()) context.report("volume_mm3", inside_volume_mm3(soup_of(mesh), context));
  context.progress(1.0);
  return {std::make_shared<const TriMesh>(std::move(mesh))};
}

StageInfo TetrahedralizeStage::info() {
  return {.name = "tetrahedralize",
          .version = 3,
          .synopsis = "tetrahedra that fill a surface",
          .description =
              "Five methods. grid and graded make staircases of perfectly shaped tetrahedra, in no time; "
              "grid-conforming follows the surface "
              "with angles that "
              "stay good, whatever the surface; tetgen and cgal need a closed surface that does not intersect itself "
              "(one that "
              "does is repaired first, as by --clean), "
              "and run in a process of "
              "their own. Whatever the "
              "method, inside is where the winding number is not zero: a shell that faces inward is a cavity, a body "
              "within another changes "
              "nothing, overlaps count once. The volume is held against the surface's, with a warning beyond 2 %. "
              "Reports a quality table: "
              "angles, "
              "aspect, volumes, conformity, and the distance of the boundary to the surface.",
          .inputs = {{"surface", {DataKind::surface}, "triangles"}},
          .outputs = {{"mesh", {DataKind::tets}, "tetrahedra (.vtu, or TetGen's .node and .ele)"}},
          .references = {"D. Morris, Haptics and Physical Simulation for Virtual Bone Surgery, 2006, section 5.2",
                         "F. Labelle and J. Shewchuk, Isosurface Stuffing, SIGGRAPH 2007",
                         "J. Maubach, Local bisection refinement, SISC 1995", "H. Si, TetGen, ACM TOMS 2015",
                         "CGAL 5.5, 3D Mesh Generation"},
          .example = "osteo tetrahedralize bone.ply bone.vtu --method grid-conforming --spacing-mm 2"};
}

std::vector<Data> TetrahedralizeStage::run(const Params& p, std::span<const Data> inputs, const Context& context) {
  const Surface& surface = std::get<Surface>(inputs[0]);
  bool clean = p.clean;
#ifdef OSTEO_WITH_CGAL
  // These two reject what crosses itself: what their advice says is done at once.
  if (!clean && (p.method == TetMethod::tetgen || p.method == TetMethod::cgal)) {
    if (const std::size_t crossing = self_intersections(soup_of(*surface), context).size(); crossing > 0) {
      context.warn("the surface intersects itself in " + std::to_string(crossing) +
                   " places, which this method does not take: it was repaired first, as by --clean");
      clean = true;
    }
  }
#endif
  const TriangleSoup soup = clean ? repair(*surface, {}, context.sub(0, 0.2)) : soup_of(*surface);
  context.report("repaired_first", clean);
  const Frame around = frame_around(soup, p.resolution, 0);
  const double spacing = p.spacing_mm > 0 ? p.spacing_mm : around.spacing_mm.x;
  const Context work = context.sub(clean ? 0.2 : 0.0, 0.8);
  [[maybe_unused]] const GuardLimits limits{p.time_limit_s, p.memory_limit_gb};
  const double surface_mm3 = inside_volume_mm3(soup, context);
  TetMesh mesh;
  switch (p.method) {
    case TetMethod::grid: {
      const VoxelBits inside = voxels_inside(soup, frame_around_mm(soup, spacing, 2), work.sub(0, 0.5));
      mesh = grid_tets(p.margin ? inside.dilated() : inside, work.sub(0.5, 1));
      if (mesh.tets.empty())
        throw Error(ExitCode::failed, "no voxel's centre is inside the surface", "choose a smaller spacing");
      break;
    }
    case TetMethod::grid_conforming:
      if (p.keep_thin) {
        KeptThin kept = stuffed_tets_keeping(soup, {spacing, p.target_dihedral_deg}, surface_mm3, kVolumeOff, 3, work);
        if (kept.spacing_mm < spacing)
          context.warn("parts of the surface are too thin for a lattice of " + format_number(spacing) +
                       " mm: " + format_number(kept.spacing_mm) +
                       " mm was taken; --no-keep-thin keeps the spacing and loses them");
        context.report("spacing_taken_mm", kept.spacing_mm);
        context.report("hinges_opened", static_cast<std::int64_t>(kept.hinges));
        mesh = std::move(kept.mesh);
      } else {
        mesh = stuffed_tets(soup, {spacing, p.target_dihedral_deg}, work);
        context.report("hinges_opened", static_cast<std::int64_t>(open_hinges(mesh)));
      }
      break;
    case TetMethod::graded:
      mesh = graded_tets(soup, {spacing, p.levels}, work);
      break;
    case TetMethod::tetgen:
#ifdef OSTEO_WITH_TETGEN
      // A regular tetrahedron's volume is 0.118 of its edge's cube.
      mesh = tets_by_tetgen(
          soup,
          {p.max_volume_mm3 > 0 ? p.max_volume_mm3 : 0.118 * spacing * spacing * spacing, 1.414, 0, kMaxTets, limits},
          work);
      break;
#else
      throw not_built("TetGen", "OSTEO_TETGEN");
#endif
    case TetMethod::cgal:
#ifdef OSTEO_WITH_CGAL
      mesh = tets_by_cgal(soup, {spacing, 0, p.surface_spacing_mm, true, kMaxTets, limits}, work);
      break;
#else
      throw not_built("CGAL", "OSTEO_CGAL");
#endif
  }
  context.progress(0.8, "checking");
  const TetQuality quality = tet_quality(mesh, context);
  report_quality(quality, context);
  report_volume(quality.volume_mm3, surface_mm3, context);
  const SurfaceComparison c = compare_surfaces(soup_of(boundary_of(mesh)), soup, context.sub(0.9, 1.0));
  context.report("boundary_to_surface_mean_mm", c.a_to_b.mean_mm);
  context.report("boundary_to_surface_max_mm", c.a_to_b.max_mm);
  context.report("surface_to_boundary_mean_mm", c.b_to_a.mean_mm);
  context.report("surface_to_boundary_max_mm", c.b_to_a.max_mm);
  context.progress(1.0);
  require_sound(mesh);
  return {std::make_shared<const TetMesh>(std::move(mesh))};
}

}  // namespace osteo::inline app
