#include "osteo/simulation/bone/world_mesh.h"

#include "osteo/geometry/mesh/bone_surface.h"
#include "osteo/simulation/bone/plates.h"

namespace osteo::inline simulation {

TriMesh moved(const TriMesh& mesh, const RigidTransform& by) {
  TriMesh m = mesh;
  for (auto& p : m.points_mm) p = to_floats(by(from_floats(p)));
  for (auto& n : m.normals) n = to_floats(by.rotation * from_floats(n));
  return m;
}

void append(TriMesh& a, const TriMesh& b) {
  const auto first = static_cast<std::uint32_t>(a.points_mm.size());
  a.points_mm.insert(a.points_mm.end(), b.points_mm.begin(), b.points_mm.end());
  a.normals.insert(a.normals.end(), b.normals.begin(), b.normals.end());
  for (const auto& t : b.triangles) a.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
}

TriMesh surface_of(const PlacedBody& body, const Context& context) {
  TriMesh mesh = surface_nets(body.body->bone, 0.5F, context).mesh;
  const bool stays = body.world_from_body.rotation == Mat3{} && body.world_from_body.shift_mm == Vec3{};
  return stays ? mesh : moved(mesh, body.world_from_body);
}

TriMesh surface_of(const World& world, const Context& context) {
  TriMesh all;
  for (const PlacedBody& b : world.bodies()) append(all, surface_of(b, context));
  return all;
}

RigidTransform pose_of(const World& world, const Fixture& fixture) {
  return world.find(fixture.body)->world_from_body * fixture.body_from_plate;
}

TriMesh plate_of(const World& world, const Fixture& fixture) {
  const PlateModel& plate = plate_library()[fixture.plate];
  TriMesh mesh = plate.mesh;
  append(mesh, moved(plate.moving, {Mat3{}, {fixture.opening_mm, 0, 0}}));
  return moved(mesh, pose_of(world, fixture));
}

}  // namespace osteo::inline simulation
