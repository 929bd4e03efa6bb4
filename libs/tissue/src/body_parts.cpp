#include "body_parts.h"

#include <algorithm>

#include "osteo/data/tet_mesh.h"

namespace osteo::tissue {

std::vector<double> masses(const TissueModel& model, double density_kg_m3) {
  constexpr double kTonnesPerMm3 = 1e-12;  // of 1 kg/m3
  std::vector<double> mass(model.point_count());
  const auto& r = model.rest();
  for (const auto& t : model.tets()) {
    const double volume = dot(r[t[1]] - r[t[0]], cross(r[t[2]] - r[t[0]], r[t[3]] - r[t[0]])) / 6;
    for (const std::uint32_t p : t) mass[p] += volume * density_kg_m3 * kTonnesPerMm3 / 4;
  }
  return mass;
}

std::vector<std::uint32_t> points_of_boundary(const TissueModel& model) {
  TetMesh mesh;
  for (const Vec3& p : model.rest()) mesh.points_mm.push_back(to_floats(p));
  for (const auto& t : model.tets()) mesh.tets.push_back(t);
  std::vector<std::uint32_t> points;
  static_cast<void>(boundary_of(mesh, &points));
  std::sort(points.begin(), points.end());
  return points;
}

std::vector<std::uint32_t> points_inside(const RigidShape& shape, std::span<const Vec3> rest, std::span<const std::uint32_t> points) {
  std::vector<std::uint32_t> inside;
  Vec3 out;
  for (const std::uint32_t p : points) {
    if (shape.distance_mm(rest[p], out) < 0) inside.push_back(p);
  }
  return inside;
}

}  // namespace osteo::tissue
