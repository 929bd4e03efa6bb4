// Tetrahedra that follow a surface, with good angles: isosurface stuffing.
#pragma once
#include <functional>

#include "osteo/core/base/context.h"
#include "osteo/core/data/tet_mesh.h"
#include "osteo/geometry/mesh/soup.h"

namespace osteo::inline geometry {

struct StuffingOptions {
  double spacing_mm = 1;  ///< edge of the lattice's cubes
  double target_dihedral_deg =
      15;  ///< tetrahedra below this are improved by moving points; 0: as the stencils leave them
};

/// Fills a surface with tetrahedra of a body-centred cubic lattice; lattice points near the surface are moved onto it,
/// and tetrahedra that it cuts are cut by stencils: F. Labelle and J. Shewchuk, Isosurface Stuffing, SIGGRAPH 2007.
/// Then points of the worst tetrahedra are moved (those on the surface along it) until none is below the target, as far
/// as that goes. Detail finer than the lattice is lost, the mesh is always there: open, self-intersecting and
/// inside-out surfaces are taken as voxels_inside takes them. Conforming, nothing inverted. O(lattice points +
/// triangles); same bytes for any thread count. Errors: as of DistanceMapper; failed when nothing is inside at that
/// spacing.
[[nodiscard]] TetMesh stuffed_tets(const TriangleSoup& surface, const StuffingOptions& options,
                                   const Context& context = {});

/// What hangs together by a point or an edge alone comes apart there: each of its parts gets a point of its own.
/// Afterwards the boundary is a manifold. Returns how many points were made. O(tets).
std::uint64_t open_hinges(TetMesh& mesh);

struct KeptThin {
  TetMesh mesh;
  double spacing_mm = 0;     ///< of the lattice that was taken
  std::uint64_t hinges = 0;  ///< points made by open_hinges()
};
/// The same at a lattice as fine as thin parts ask: halved, at most `halvings` times and while it has fewer than 4e7
/// points, until the tetrahedra fill the surface's volume (`volume_mm3`) to `most_lost` (a share). Hinges are opened.
[[nodiscard]] KeptThin stuffed_tets_keeping(const TriangleSoup& surface, const StuffingOptions& options,
                                            double volume_mm3, double most_lost, int halvings,
                                            const Context& context = {});

}  // namespace osteo::inline geometry
