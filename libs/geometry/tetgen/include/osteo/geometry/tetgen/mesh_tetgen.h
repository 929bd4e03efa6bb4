// What TetGen does for us. TetGen is AGPL: a binary with this library falls under the AGPL.
#pragma once
#include "osteo/core/base/context.h"
#include "osteo/core/base/guarded.h"
#include "osteo/core/data/tet_mesh.h"
#include "osteo/geometry/mesh/soup.h"

namespace osteo::inline geometry {

struct TetgenOptions {
  double max_volume_mm3 = 0;  ///< 0: no bound
  double radius_edge_ratio = 1.414;
  double min_dihedral_deg = 0;  ///< aimed at by adding points, often in vain and at a high price; 0: not
  double most_tets = 5e7;       ///< more are rejected before anything is done: volume over max_volume_mm3
  GuardLimits limits{};
};
/// Constrained Delaunay tetrahedra of a closed surface without self-intersections; the surface's triangles are kept or
/// split, never moved. H. Si, TetGen, ACM Trans. Math. Softw. 2015. Inside is where the winding number is not zero
/// (solid_surface): cavities stay empty, a body within another changes nothing. In a process of its own (run_guarded),
/// so that what crashes TetGen or never ends is an error. Errors: failed otherwise, with TetGen's reason; resources
/// beyond the limits.
[[nodiscard]] TetMesh tets_by_tetgen(const TriangleSoup& surface, const TetgenOptions& options,
                                     const Context& context = {});

}  // namespace osteo::inline geometry
