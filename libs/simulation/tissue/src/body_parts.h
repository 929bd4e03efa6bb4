// What statics and both ways of going on in time need to know of a body.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "cutter.h"
#include "osteo/simulation/tissue/contact.h"
#include "osteo/simulation/tissue/detail/tissue_model.h"

namespace osteo::inline simulation::tissue {

/// Lumped: a quarter of each tetrahedron to each of its corners, in N s2/mm (tonnes).
std::vector<double> masses(const TissueModel& model, double density_kg_m3);
/// Triangles of the boundary of the tetrahedra that are still there (all without a cutter), facing outwards, over the
/// model's points.
std::vector<std::array<std::uint32_t, 3>> boundary_triangles(const TissueModel& model, const Cutter* cutter = nullptr);
/// In ascending order.
std::vector<std::uint32_t> points_of(std::span<const std::array<std::uint32_t, 3>> triangles);
/// Error(usage) for a load that is not finite or on no point.
void require_load(std::span<const std::pair<std::uint32_t, Vec3>> forces_n, std::size_t points);
/// Those of the points that lie inside the shape at rest.
std::vector<std::uint32_t> points_inside(const RigidShape& shape, std::span<const Vec3> rest,
                                         std::span<const std::uint32_t> points);

}  // namespace osteo::inline simulation::tissue
