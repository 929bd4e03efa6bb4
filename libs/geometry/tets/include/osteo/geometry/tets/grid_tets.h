// Tetrahedra from voxels: five to a cube.
#pragma once
#include "osteo/core/base/context.h"
#include "osteo/core/data/tet_mesh.h"
#include "osteo/geometry/distance/voxelize.h"

namespace osteo::inline geometry {

/// Each voxel becomes a cube, each cube five tetrahedra: one regular in the middle, four at corners. Cubes alternate
/// between the two ways to do that, so that shared faces have the same diagonal and the mesh conforms (the thesis,
/// section 5.2.2, uses one way only, whose diagonals cross). Points are shared; numbered, as the tetrahedra are, in
/// order of z, y, x. Smallest dihedral angle 54.7 degrees for cubes. O(voxels / 64 + tets); same bytes for any thread
/// count. Errors: resources beyond 2^32 points.
[[nodiscard]] TetMesh grid_tets(const VoxelBits& voxels, const Context& context = {});

}  // namespace osteo::inline geometry
