// How things look in 3D, the same in snapshots and in the window.
#pragma once
#include <vtkSmartPointer.h>

#include "osteo/bone/rigid_transform.h"
#include "osteo/bone/round_cone.h"
#include "osteo/data/tri_mesh.h"
#include "osteo/data/vec.h"

class vtkActor;
class vtkMatrix4x4;
class vtkPolyData;
class vtkRenderer;

namespace osteo {

/// Bone under soft light. The data may be replaced later through the actor's mapper.
[[nodiscard]] vtkSmartPointer<vtkActor> make_bone_actor(vtkPolyData* data);
/// The surface of a round cone, its axis along +z; with normals.
[[nodiscard]] vtkSmartPointer<vtkPolyData> round_cone_surface(const RoundCone& shape);
void set_matrix(vtkMatrix4x4* matrix, const RigidTransform& transform);
/// Dark blue background, key, fill and head light.
void set_up_scene(vtkRenderer* renderer);
/// Camera that sees a ball of `radius_mm` around `centre_mm` from `eye` (unit, LPS), head up.
void look_at(vtkRenderer* renderer, Vec3 centre_mm, double radius_mm, Vec3 eye);

}  // namespace osteo
