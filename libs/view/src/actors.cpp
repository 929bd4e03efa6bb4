#include "osteo/view/actors.h"

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkLightKit.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>

namespace osteo {

vtkSmartPointer<vtkActor> make_bone_actor(vtkPolyData* data) {
  auto actor = vtkSmartPointer<vtkActor>::New();
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(data);
  mapper->ScalarVisibilityOff();
  mapper->StaticOn();
  actor->SetMapper(mapper);
  vtkProperty* const p = actor->GetProperty();
  p->SetColor(0.93, 0.88, 0.77);
  p->SetAmbient(0.08);
  p->SetDiffuse(0.95);
  p->SetSpecular(0.12);
  p->SetSpecularPower(25);
  return actor;
}

void set_up_scene(vtkRenderer* renderer) {
  renderer->SetBackground(0.06, 0.08, 0.11);
  renderer->SetBackground2(0.16, 0.20, 0.26);
  renderer->GradientBackgroundOn();
  renderer->AutomaticLightCreationOff();
  renderer->RemoveAllLights();
  vtkNew<vtkLightKit> lights;
  lights->SetKeyLightIntensity(0.8);
  lights->SetKeyToFillRatio(2.2);
  lights->SetKeyToHeadRatio(1.6);
  lights->SetKeyLightAngle(35, -25);
  lights->AddLightsToRenderer(renderer);
}

void look_at(vtkRenderer* renderer, Vec3 centre, double radius_mm, Vec3 eye) {
  vtkCamera* const camera = renderer->GetActiveCamera();
  const double distance = radius_mm / 0.24;  // view angle of 30 degrees
  camera->SetFocalPoint(centre.x, centre.y, centre.z);
  camera->SetPosition(centre.x + eye.x * distance, centre.y + eye.y * distance, centre.z + eye.z * distance);
  const bool along_z = std::abs(eye.z) > 0.95;
  camera->SetViewUp(0, along_z ? -1 : 0, along_z ? 0 : 1);
  renderer->ResetCameraClippingRange();
}

}  // namespace osteo
