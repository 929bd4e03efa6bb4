// Private to libs/simulation/tissue.
#pragma once
#include <cstddef>

namespace osteo::inline simulation {

/// Corners of each face of a tetrahedron, seen from outside in one order of turning; S1 to S4 of C3D4 and C3D10.
inline constexpr std::size_t kTetFaces[4][3] = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};

}  // namespace osteo::inline simulation
