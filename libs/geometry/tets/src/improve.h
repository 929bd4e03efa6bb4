// Moves points of bad tetrahedra. Private to libs/geometry/tets.
#pragma once
#include "osteo/core/base/context.h"
#include "osteo/core/data/tet_mesh.h"
#include "osteo/geometry/mesh/soup.h"

namespace osteo::inline geometry {

/// Moves points of tetrahedra with a dihedral angle below the target (or above 180 less it) so that the worst angle
/// around each gets better, never worse. Points of the boundary move along it only: off `surface` by at most 2 % of the
/// spacing more than they were. Returns the smallest dihedral angle afterwards.
double improve_tets(TetMesh& mesh, const TriangleSoup& surface, double target_deg, double spacing_mm,
                    const Context& context);

}  // namespace osteo::inline geometry
