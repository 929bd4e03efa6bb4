// Faces of a body that no second tetrahedron has. Private to libs/simulation/tissue.
#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "osteo/simulation/tissue/contact.h"
#include "osteo/simulation/tissue/fem.h"

namespace osteo::inline simulation {

struct OuterFace {
  std::size_t element, face;  // its corners: kTetFaces
};
/// In the order of their corners.
[[nodiscard]] std::vector<OuterFace> outer_faces(const FemBody& body);

/// Corners of a face, and of t10 the middles of its edges, from the first corner on.
[[nodiscard]] std::vector<std::uint32_t> points_of(const FemBody& body, OuterFace face);

/// How many points there are to an area of the faces that look at a rigid thing (within 45 degrees), at rest; of all
/// where none does. What a stiffness for each point is to one for each mm2.
[[nodiscard]] double points_per_mm2(const FemBody& body, std::span<const OuterFace> faces, const RigidShape& thing);

}  // namespace osteo::inline simulation
