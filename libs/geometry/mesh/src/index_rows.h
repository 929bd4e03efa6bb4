// The vertex -> triangles map. Private to libs/geometry/mesh.
#pragma once
#include "osteo/geometry/mesh/bone_surface.h"

namespace osteo::inline geometry {

/// One row a point: its triangles, ascending.
[[nodiscard]] IndexRows triangles_of_vertices(const TriMesh& mesh);

}  // namespace osteo::inline geometry
