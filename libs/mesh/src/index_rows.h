// The vertex -> triangles map. Private to libs/mesh.
#pragma once
#include "osteo/mesh/bone_surface.h"

namespace osteo {

/// Groups pairs (row, item) by row, in the order given.
[[nodiscard]] IndexRows rows_from_pairs(std::size_t rows, const std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs);
[[nodiscard]] IndexRows triangles_of_vertices(const TriMesh& mesh);

}  // namespace osteo
