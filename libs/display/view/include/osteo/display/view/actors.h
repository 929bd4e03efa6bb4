// How things look in 3D, the same in snapshots and in the window.
#pragma once
#include <vtkSmartPointer.h>

#include "osteo/core/data/rigid_transform.h"
#include "osteo/core/data/tri_mesh.h"
#include "osteo/core/data/vec.h"
#include "osteo/display/view/quality.h"
#include "osteo/simulation/bone/round_cone.h"
#include "osteo/simulation/camera/stereo.h"

class vtkActor;
class vtkMatrix4x4;
class vtkPolyData;
class vtkProp;
class vtkRenderer;

namespace osteo::inline display {

/// Of bone, of its colour: what it shows of no light at all.
inline constexpr double kBoneAmbient = 0.16;
/// Dry bone under soft light. The data may be replaced later through the actor's mapper.
[[nodiscard]] vtkSmartPointer<vtkActor> make_bone_actor(vtkPolyData* data);
/// Wet: the fourth component of its colours says how dry a point is (255: dry); wet bone is darker, and mirrors the
/// lamp. It stays opaque.
void set_bone_wet(vtkActor* bone, bool wet);
/// For what one sees through: drawn when all else is, in the order in which they are added, blended over it.
enum class Late {
  nearest,  ///< where nothing is in front; of itself, and of what is added later, only what is in front shows: water,
            ///< which comes first
  all,      ///< where nothing is in front; all of it, in any order
  through_all  ///< whatever is in front
};
[[nodiscard]] vtkSmartPointer<vtkActor> make_late_actor(Late how);
[[nodiscard]] bool is_late(vtkProp* prop);
/// The surface of a round cone, its axis along +z; with normals.
[[nodiscard]] vtkSmartPointer<vtkPolyData> round_cone_surface(const RoundCone& shape);
void set_matrix(vtkMatrix4x4* matrix, const RigidTransform& transform);
/// Dark blue background; the lamp of a microscope, at the eyes and a little above and to the left, so that what lies
/// deep is lit and relief still shows; a weak fill from the other side. On bone of any colour no highlight burns out:
/// at most 250 of 255.
void set_up_scene(vtkRenderer* renderer);
/// Ambient occlusion and smooth edges, by the renderer's own flags; occlusion reaches 3.5 % of the height
/// that is seen at the focus, 0.5 to 8 mm: the creases; what is deeper BonePaint shows. Without effects both are off.
void set_depth(vtkRenderer* renderer, const PictureStyle& style);
/// What is seen at the focus from the lower to the upper edge.
[[nodiscard]] double seen_height_mm(vtkRenderer* renderer);
/// Camera that sees a ball of `radius_mm` around `centre_mm` from `eye` (unit, LPS), head up.
void look_at(vtkRenderer* renderer, Vec3 centre_mm, double radius_mm, Vec3 eye);

// -- The microscope's view as VTK's camera.

/// The renderer's camera looks as `view` says into a viewport of that size. Clipping planes are left as they were.
void aim(vtkRenderer* renderer, const ScopeView& view, const PictureArea& area);
/// The same for one eye of two (0: left).
void aim_eye(vtkRenderer* renderer, const ScopeView& view, const StereoParams& stereo, const PictureArea& area,
             int eye);

}  // namespace osteo::inline display
