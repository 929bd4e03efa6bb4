// Bone's surface onto bone's surface.
#pragma once
#include "osteo/core/base/context.h"
#include "osteo/core/data/rigid_transform.h"
#include "osteo/core/data/tri_mesh.h"
#include "osteo/core/data/volume.h"

namespace osteo::inline imaging::registration {

struct SurfaceFit {
  RigidTransform second_from_first;
  double mean_mm = 0,
         p95_mm = 0;             // unsigned, of all points of the second's surface that both scans show, to the first's
  double shape_mean_mm = 0;      // the same along the normals, less the shift of the boundary
  double boundary_shift_mm = 0;  // how much larger the second bone is all round
};

struct BoneOf {
  TriMesh mesh;
  Frame scan;  // where the bone was cut off
};
/// Voxels of 0.75 mm, surface nets. `which` is for the message. Error(failed) for less than 2 cm3 of bone.
[[nodiscard]] BoneOf bone_surface_of(const Image& ct, double bone_hu, const char* which, const Context& context);

/// From a guess that is right to a few mm. Error(failed) for too little bone seen by both.
[[nodiscard]] SurfaceFit fit_surfaces(const BoneOf& first, const BoneOf& second, const RigidTransform& guess,
                                      const Context& context);

}  // namespace osteo::inline imaging::registration
