// What TetGen does for us. TetGen is AGPL: a binary with this library falls under the AGPL.
#pragma once
#include "osteo/base/context.h"
#include "osteo/data/tet_mesh.h"
#include "osteo/mesh/soup.h"

namespace osteo {

struct TetgenOptions {
  double max_volume_mm3 = 0;  ///< 0: no bound
  double radius_edge_ratio = 1.414;
  double min_dihedral_deg = 0;  ///< aimed at by adding points, often in vain and at a high price; 0: not
};
/// Constrained Delaunay tetrahedra of a closed surface without self-intersections; the surface's triangles are kept or split, never
/// moved. H. Si, TetGen, ACM Trans. Math. Softw. 2015. Errors: failed otherwise, with TetGen's reason.
[[nodiscard]] TetMesh tets_by_tetgen(const TriangleSoup& surface, const TetgenOptions& options, const Context& context = {});

}  // namespace osteo
