// The plane about which a bone is most nearly its own mirror image, without landmarks.
#pragma once
#include "osteo/core/base/context.h"
#include "osteo/geometry/mesh/soup.h"

namespace osteo::inline session {

struct SymmetryPlane {
  Vec3 at_mm, normal;      ///< unit; towards the patient's left (+x)
  double residual_mm = 0;  ///< root mean square along the normals, of the better two thirds of the surface
  double within_1_mm = 0;  ///< share of the surface whose mirror image lies within 1 mm of it
  [[nodiscard]] Vec3 mirrored(Vec3 p) const { return p - normal * (2 * dot(p - at_mm, normal)); }
};

/// Reflective registration: the surface's mirror image is brought upon the surface by closest points along their
/// normals (Y. Chen, G. Medioni, IVC 1992), the worst third left out (D. Chetverikov et al., The trimmed ICP
/// algorithm, ICPR 2002), so that a defect or tumour of one side does not pull. Three unknowns: the plane itself.
/// Started from the principal axes and turns of 15 degrees from them. Error(failed): less than half of the surface
/// has its mirror image within 1 mm; or another plane, by more than 15 degrees, does as well (a ball).
/// O(triangles log triangles). Same bytes for any number of threads.
[[nodiscard]] SymmetryPlane find_symmetry_plane(const TriangleSoup& bone, const Context& context = {});

/// The other side: the mirror image of all of it, still facing outward. O(points).
[[nodiscard]] TriangleSoup mirrored(const TriangleSoup& bone, const SymmetryPlane& plane);

}  // namespace osteo::inline session
