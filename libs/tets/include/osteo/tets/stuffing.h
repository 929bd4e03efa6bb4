// Tetrahedra that follow a surface, with good angles: isosurface stuffing.
#pragma once
#include <functional>

#include "osteo/base/context.h"
#include "osteo/data/tet_mesh.h"
#include "osteo/mesh/soup.h"

namespace osteo {

struct StuffingOptions {
  double spacing_mm = 1;            ///< edge of the lattice's cubes
  double target_dihedral_deg = 15;  ///< tetrahedra below this are improved by moving points; 0: as the stencils leave them
};

/// Fills a surface with tetrahedra of a body-centred cubic lattice; lattice points near the surface are moved onto it, and
/// tetrahedra that it cuts are cut by stencils: F. Labelle and J. Shewchuk, Isosurface Stuffing, SIGGRAPH 2007. Then points of
/// the worst tetrahedra are moved (those on the surface along it) until none is below the target, as far as that goes.
/// Detail finer than the lattice is lost, the mesh is always there: open, self-intersecting and inside-out surfaces are taken as
/// voxels_inside takes them. Conforming, nothing inverted. O(lattice points + triangles); same bytes for any thread count.
/// Errors: as of DistanceMapper; failed when nothing is inside at that spacing.
[[nodiscard]] TetMesh stuffed_tets(const TriangleSoup& surface, const StuffingOptions& options, const Context& context = {});

}  // namespace osteo
