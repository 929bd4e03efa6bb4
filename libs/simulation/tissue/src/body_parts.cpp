#include "body_parts.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "osteo/core/base/error.h"
#include "osteo/core/data/tet_mesh.h"
#include "osteo/simulation/tissue/fem.h"

namespace osteo::inline simulation::tissue {

std::vector<double> masses(const TissueModel& model, double density_kg_m3) {
  std::vector<double> mass(model.point_count());
  const auto& r = model.rest();
  for (const auto& t : model.tets()) {
    const double volume = dot(r[t[1]] - r[t[0]], cross(r[t[2]] - r[t[0]], r[t[3]] - r[t[0]])) / 6;
    for (const std::uint32_t p : t) mass[p] += volume * density_kg_m3 * kTonnesPerMm3 / 4;
  }
  return mass;
}

std::vector<std::array<std::uint32_t, 3>> boundary_triangles(const TissueModel& model, const Cutter* cutter) {
  TetMesh mesh;
  for (const Vec3& p : model.rest()) mesh.points_mm.push_back(to_floats(p));
  for (std::uint32_t t = 0; t < model.tets().size(); ++t) {
    if (cutter == nullptr || cutter->there(t)) mesh.tets.push_back(model.tets()[t]);
  }
  std::vector<std::uint32_t> point_of;
  const TriMesh boundary = boundary_of(mesh, &point_of);
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (const auto& t : boundary.triangles) triangles.push_back({point_of[t[0]], point_of[t[1]], point_of[t[2]]});
  return triangles;
}

std::vector<std::uint32_t> points_of(std::span<const std::array<std::uint32_t, 3>> triangles) {
  std::vector<std::uint32_t> points;
  for (const auto& t : triangles) points.insert(points.end(), t.begin(), t.end());
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  return points;
}

void require_load(std::span<const std::pair<std::uint32_t, Vec3>> forces_n, std::size_t points) {
  for (const auto& [p, f] : forces_n) {
    if (p >= points || !std::isfinite(dot(f, f)))
      throw Error(ExitCode::usage,
                  "a load on point " + std::to_string(p) + " is not finite, or there is no such point");
  }
}

std::vector<std::uint32_t> points_inside(const RigidShape& shape, std::span<const Vec3> rest,
                                         std::span<const std::uint32_t> points) {
  std::vector<std::uint32_t> inside;
  Vec3 out;
  for (const std::uint32_t p : points) {
    if (shape.distance_mm(rest[p], out) < 0) inside.push_back(p);
  }
  return inside;
}

}  // namespace osteo::inline simulation::tissue
