// A world as triangles: for pictures and for planning in other programs.
#pragma once
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/data/tri_mesh.h"
#include "osteo/simulation/bone/world.h"

namespace osteo::inline simulation {

/// Points and normals of a mesh where a transform puts them.
[[nodiscard]] TriMesh moved(const TriMesh& mesh, const RigidTransform& by);
/// Adds b behind a.
void append(TriMesh& a, const TriMesh& b);

/// The surface of a body where it is.
[[nodiscard]] TriMesh surface_of(const PlacedBody& body, const Context& context = {});
/// Of all bodies.
[[nodiscard]] TriMesh surface_of(const World& world, const Context& context = {});
/// A fixture's plate where it is, a distractor as far open as it is.
[[nodiscard]] TriMesh plate_of(const World& world, const Fixture& fixture);
[[nodiscard]] RigidTransform pose_of(const World& world, const Fixture& fixture);

}  // namespace osteo::inline simulation
