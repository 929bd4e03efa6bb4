#include "osteo/display/view/world_view.h"

#include <vtkCamera.h>
#include <vtkLight.h>
#include <vtkLightCollection.h>
#include <vtkMatrix4x4.h>
#include <vtkProp3D.h>
#include <vtkPropCollection.h>
#include <vtkRenderer.h>

#include <cstring>

#include "stamp.h"

namespace osteo::inline display {
namespace {

class Stamp {
 public:
  void add(std::uint64_t v) {
    value_ ^= v + 0x9e3779b97f4a7c15ULL + (value_ << 6) + (value_ >> 2);
    value_ *= 0xff51afd7ed558ccdULL;
  }
  void add(double v) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &v, sizeof bits);
    add(bits);
  }
  void add(const double* v, int n) {
    for (int i = 0; i < n; ++i) add(v[i]);
  }
  [[nodiscard]] std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 1;
};

}  // namespace

std::uint64_t view_stamp(vtkRenderer* renderer) {
  Stamp stamp;
  // By values: drawing itself touches the times of camera and lights.
  vtkCamera* const camera = renderer->GetActiveCamera();
  for (const double* const v : {camera->GetPosition(), camera->GetFocalPoint(), camera->GetViewUp()}) stamp.add(v, 3);
  stamp.add(camera->GetViewAngle());
  stamp.add(camera->GetParallelProjection() != 0 ? camera->GetParallelScale() : -1.0);
  stamp.add(camera->GetWindowCenter(), 2);
  stamp.add(camera->GetEyeAngle());
  stamp.add(camera->GetEyeSeparation());
  stamp.add(renderer->GetBackground(), 3);
  vtkCollectionSimpleIterator at{};
  vtkLightCollection* const lights = renderer->GetLights();
  for (lights->InitTraversal(at); vtkLight* const light = lights->GetNextLight(at);) {
    stamp.add(static_cast<double>(light->GetSwitch()) * light->GetIntensity());
    stamp.add(light->GetPosition(), 3);
    stamp.add(light->GetFocalPoint(), 3);
    stamp.add(light->GetDiffuseColor(), 3);
  }
  return stamp.value();
}

std::uint64_t prop_stamp(vtkProp* prop) {
  Stamp stamp;
  stamp.add(static_cast<std::uint64_t>(prop->GetRedrawMTime()));
  if (auto* const placed = vtkProp3D::SafeDownCast(prop); placed != nullptr && placed->GetUserMatrix() != nullptr)
    stamp.add(static_cast<std::uint64_t>(placed->GetUserMatrix()->GetMTime()));
  return stamp.value();
}

std::uint64_t scene_stamp(vtkRenderer* renderer) {
  Stamp stamp;
  stamp.add(view_stamp(renderer));
  vtkCollectionSimpleIterator at{};
  vtkPropCollection* const props = renderer->GetViewProps();
  for (props->InitTraversal(at); vtkProp* const prop = props->GetNextProp(at);) {
    if (prop->GetVisibility() == 0) continue;
    stamp.add(reinterpret_cast<std::uintptr_t>(prop));
    stamp.add(prop_stamp(prop));
  }
  return stamp.value();
}

}  // namespace osteo::inline display
