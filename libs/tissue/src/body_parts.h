// What both ways of going on in time need to know of a body.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "osteo/tissue/contact.h"
#include "osteo/tissue/tissue_model.h"

namespace osteo::tissue {

/// Lumped: a quarter of each tetrahedron to each of its corners, in N s2/mm (tonnes).
std::vector<double> masses(const TissueModel& model, double density_kg_m3);
/// In ascending order.
std::vector<std::uint32_t> points_of_boundary(const TissueModel& model);
/// Those of the points that lie inside the shape at rest.
std::vector<std::uint32_t> points_inside(const RigidShape& shape, std::span<const Vec3> rest, std::span<const std::uint32_t> points);

}  // namespace osteo::tissue
