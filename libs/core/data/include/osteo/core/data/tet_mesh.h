// A tetrahedral mesh in LPS millimetres.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include "osteo/core/base/big_array.h"
#include "osteo/core/data/tri_mesh.h"

namespace osteo {

struct TetMesh {
  BigArray<std::array<float, 3>> points_mm;
  BigArray<std::array<std::uint32_t, 4>> tets;  ///< positive volume: (b-a) x (c-a) . (d-a) > 0
  std::vector<float> values;                    ///< empty, or one a point: what values_name says, with its unit
  std::string values_name;                      ///< like "stiffness_kpa"
};
using Tets = std::shared_ptr<const TetMesh>;

/// The triangles that only one tetrahedron has, facing out, over the same points as far as they are used.
/// `point_of` (when given) becomes: point of the surface -> point of the mesh. O(tets) and about 40 bytes a
/// tetrahedron.
[[nodiscard]] TriMesh boundary_of(const TetMesh& mesh, std::vector<std::uint32_t>* point_of = nullptr);

[[nodiscard]] double volume_mm3(const TetMesh& mesh);

// -- What a tetrahedral mesh must satisfy to be written.

/// Coordinates are finite, tetrahedra name points that are there and have a volume above 0 (in double precision, from
/// the coordinates as they are kept). Error(failed) with how many do not and the first; O(tets).
void require_sound(const TetMesh& mesh);

}  // namespace osteo
