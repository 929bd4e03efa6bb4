// What CGAL does for us. CGAL's meshing and mesh processing packages are GPL: a binary with this library falls under
// the GPL.
#pragma once
#include <cstdint>
#include <utility>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/base/guarded.h"
#include "osteo/core/data/tet_mesh.h"
#include "osteo/geometry/mesh/soup.h"

namespace osteo::inline geometry {

/// Pairs of triangles that intersect otherwise than in a shared edge or point, by exact predicates; ascending.
[[nodiscard]] std::vector<std::pair<std::uint32_t, std::uint32_t>> self_intersections(const TriangleSoup& surface,
                                                                                      const Context& context = {});

struct CgalRepairReport {
  std::uint64_t holes_filled = 0, holes_left = 0;
  std::uint64_t self_intersections_before = 0, self_intersections_after = 0;
};
/// Makes a manifold and closes holes of at most `max_hole_edges` edges (0: none). Errors: failed when no surface is
/// left.
[[nodiscard]] TriangleSoup holes_closed(const TriangleSoup& surface, int max_hole_edges, CgalRepairReport& report,
                                        const Context& context = {});
/// Triangles that meet are cut along each other in exact numbers; of the pieces those stay that bound the inside
/// (solid_surface), facing out: overlapping bodies become one, what lay within is gone, nothing else moves. New points
/// are rounded to single precision, as TriMesh and files keep them. That may leave intersections of that size, which
/// are cut again as long as they get fewer; the rest is counted. The surface as it was when nothing intersects. (Q.
/// Zhou et al., Mesh Arrangements for Solid Geometry, SIGGRAPH 2016.) Errors: as of solid_surface.
[[nodiscard]] TriangleSoup intersections_resolved(const TriangleSoup& surface, CgalRepairReport& report,
                                                  const Context& context = {});

struct CgalMeshOptions {
  double cell_mm = 2;            ///< longest circumradius of a tetrahedron
  double facet_distance_mm = 0;  ///< farthest the boundary may be from the surface; 0: a tenth of cell_mm
  double surface_cell_mm = 0;    ///< the same as cell_mm at the surface, from where it grows inward; 0: no grading
  bool optimise = true;          ///< perturb and exude, against slivers
  double most_tets = 5e7;        ///< more are rejected before anything is done, by the volume and cell_mm
  GuardLimits limits{};
};
/// Delaunay refinement (CGAL Mesh_3) of a closed surface without self-intersections, in a process of its own
/// (run_guarded). Inside is where the winding number is not zero (solid_surface). Errors: failed otherwise, naming what
/// is wrong; resources beyond the limits.
[[nodiscard]] TetMesh tets_by_cgal(const TriangleSoup& surface, const CgalMeshOptions& options,
                                   const Context& context = {});

}  // namespace osteo::inline geometry
