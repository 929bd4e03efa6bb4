// All that finite elements found, for programs that draw it.
#pragma once
#include <span>
#include <string>

#include "osteo/simulation/tissue/fem.h"

namespace osteo::inline simulation {

/// A .vtu file in text (VTK's XML, read by ParaView and 3D Slicer): every node of the body where it is under the load,
/// in double precision, of t10 the middles of edges too, as cells of VTK_TETRA or VTK_QUADRATIC_TETRA;
/// "displacement_mm" at the nodes, "young_mpa" and "poisson" in the cells. `x`: places of all nodes, finite.
[[nodiscard]] std::string nodes_vtu(const FemBody& body, std::span<const Vec3> x);

}  // namespace osteo::inline simulation
