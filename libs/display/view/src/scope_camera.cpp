#include "osteo/display/view/actors.h"

#include <vtkCamera.h>
#include <vtkRenderer.h>

namespace osteo::inline display {
namespace {

void place(vtkRenderer* renderer, const ScopeView& view, const PictureArea& area, Vec3 eye, double centre_x) {
  vtkCamera* const camera = renderer->GetActiveCamera();
  const Vec3 at = eye - view.back * view.working_distance_mm;
  camera->SetPosition(eye.x, eye.y, eye.z);
  camera->SetFocalPoint(at.x, at.y, at.z);
  camera->SetViewUp(view.up.x, view.up.y, view.up.z);
  camera->SetViewAngle(view.view_angle_deg(area));
  camera->SetWindowCenter(centre_x, 0);  // sets the frustum off; the camera itself does not turn
}

}  // namespace

void aim(vtkRenderer* renderer, const ScopeView& view, const PictureArea& area) {
  place(renderer, view, area, view.eye_mm(), 0);
}

void aim_eye(vtkRenderer* renderer, const ScopeView& view, const StereoParams& stereo, const PictureArea& area,
             int eye) {
  const StereoEye e = stereo_eye(view, stereo, area, eye);
  place(renderer, view, area, e.eye_mm, e.window_centre_x);
}

}  // namespace osteo::inline display
