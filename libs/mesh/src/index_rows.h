// The vertex -> triangles map. Private to libs/mesh.
#pragma once
#include "osteo/mesh/bone_surface.h"

namespace osteo {

/// One row a point: its triangles, ascending.
[[nodiscard]] IndexRows triangles_of_vertices(const TriMesh& mesh);

}  // namespace osteo
