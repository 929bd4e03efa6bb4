// A mandible with a tumour and a fibula as surfaces, of which the truth is known.
#pragma once
#include <cstdint>
#include <vector>

#include "osteo/geometry/mesh/soup.h"

namespace osteo::inline session {

/// Both are swept along smooth curves, in LPS mm, closed and manifold.
struct JawPhantom {
  TriangleSoup jaw;    ///< with a tumour that bulges between the resection planes, on one side
  TriangleSoup donor;  ///< a fibula: bowed, twisted, thicker at its ends
  Vec3 symmetry_at_mm, symmetry_normal;
  Vec3 a_mm, a_normal, b_mm, b_normal;  ///< resection planes; normals towards what is removed
  /// The middle of the lower border, as high as `border_mm`, of the jaw before the tumour grew; between the planes.
  std::vector<Vec3> contour_mm;
};
/// Of one seed always the same. `asymmetry_mm`: by how much the sides of the jaw differ, as faces do. About 13000
/// triangles each.
[[nodiscard]] JawPhantom make_jaw_phantom(std::uint64_t seed, double border_mm, double asymmetry_mm = 0.4);

}  // namespace osteo::inline session
