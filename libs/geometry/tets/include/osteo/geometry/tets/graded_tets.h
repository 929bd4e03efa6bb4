// Tetrahedra that are small at the surface and large inside.
#pragma once
#include "osteo/core/base/context.h"
#include "osteo/core/data/tet_mesh.h"
#include "osteo/geometry/mesh/soup.h"

namespace osteo::inline geometry {

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

}  // namespace osteo::inline geometry
