// Tetrahedra from a lattice of cubes: five a voxel, graded by halving, or fitted to a surface (isosurface stuffing).
#pragma once
#include <functional>

#include "osteo/core/base/context.h"
#include "osteo/core/data/tet_mesh.h"
#include "osteo/geometry/distance/voxelize.h"
#include "osteo/geometry/mesh/soup.h"

namespace osteo::inline geometry {

// -- Tetrahedra from voxels: five to a cube.

/// Each voxel becomes a cube, each cube five tetrahedra: one regular in the middle, four at corners. Cubes alternate
/// between the two ways to do that, so that shared faces have the same diagonal and the mesh conforms (the thesis,
/// section 5.2.2, uses one way only, whose diagonals cross). Points are shared; numbered, as the tetrahedra are, in
/// order of z, y, x. Smallest dihedral angle 54.7 degrees for cubes. O(voxels / 64 + tets); same bytes for any thread
/// count. Errors: resources beyond 2^32 points.
[[nodiscard]] TetMesh grid_tets(const VoxelBits& voxels, const Context& context = {});

// -- Tetrahedra that are small at the surface and large inside.

struct GradedOptions {
  double spacing_mm = 1;  ///< edge of the cubes at the surface
  int levels = 3;         ///< deep inside, edges are 2^levels times longer
};

/// What the thesis leaves to future work (section 5.2): cubes of six tetrahedra, halved where they meet the surface
/// until they are as small as `spacing_mm`. Halving always takes the edge that J. Maubach's rule names (Local bisection
/// refinement, SIAM J. Sci. Comput. 1995), so that neighbours can follow, the mesh conforms, and only three shapes
/// occur: no dihedral angle below 45 degrees. A tetrahedron is kept when its centre is inside. Same mesh for any thread
/// count. Errors: as of DistanceMapper; failed when nothing is inside.
[[nodiscard]] TetMesh graded_tets(const TriangleSoup& surface, const GradedOptions& options,
                                  const Context& context = {});

// -- Tetrahedra that follow a surface, with good angles: isosurface stuffing.

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

/// What is connected by a point or an edge alone comes apart there: each of its parts gets a point of its own.
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
