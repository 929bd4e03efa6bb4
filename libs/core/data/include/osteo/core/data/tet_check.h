// What a tetrahedral mesh must satisfy to be written.
#pragma once
#include "osteo/core/data/tet_mesh.h"

namespace osteo {

/// Coordinates are finite, tetrahedra name points that are there and have a volume above 0 (in double precision, from
/// the coordinates as they are kept). Error(failed) with how many do not and the first; O(tets).
void require_sound(const TetMesh& mesh);

}  // namespace osteo
