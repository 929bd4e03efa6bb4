#include "osteo/display/view/pictures.h"

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkGenericOpenGLRenderWindow.h>
#include <vtkMapper.h>
#include <vtkNew.h>
#include <vtkPlane.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "osteo/display/view/actors.h"
#include "osteo/display/view/offscreen.h"
#include "osteo/imaging/io/vtk_data.h"

namespace osteo::inline display {

std::vector<Picture> draw_stills(std::span<const StillPart> parts, std::span<const Still> stills) {
  std::vector<Picture> pictures;
  if (stills.empty()) return pictures;
  // One window for each size.
  std::map<std::pair<int, int>, std::unique_ptr<OffscreenWindow>> windows;
  std::vector<vtkSmartPointer<vtkPolyData>> data;
  for (const StillPart& p : parts) data.push_back(to_vtk(*p.mesh));
  for (const Still& s : stills) {
    auto& window = windows[{s.width, s.height}];
    if (!window) window = std::make_unique<OffscreenWindow>(s.width, s.height);
    window->make_current();
    vtkNew<vtkRenderer> renderer;
    window->window()->AddRenderer(renderer);
    set_up_scene(renderer);
    renderer->SetBackground(0.957, 0.953, 0.941);
    const Vec3 eye = normalized(s.eye);
    vtkNew<vtkPlane> plane;
    if (s.cut_mm) {
      const Vec3 at = s.centre_mm + eye * *s.cut_mm;
      plane->SetOrigin(at.x, at.y, at.z);
      plane->SetNormal(-eye.x, -eye.y, -eye.z);
    }
    for (const std::size_t n : s.parts) {
      if (parts[n].mesh->triangles.empty()) continue;
      const auto actor = make_bone_actor(data[n]);
      vtkProperty* const look = actor->GetProperty();
      look->SetColor(parts[n].rgb[0], parts[n].rgb[1], parts[n].rgb[2]);
      if (parts[n].opacity < 1) {
        look->SetOpacity(parts[n].opacity);
        look->BackfaceCullingOn();
      }
      if (s.cut_mm && parts[n].cut) {
        actor->GetMapper()->AddClippingPlane(plane);
        // What is cut open shows its inside: darker, so that it is told from the surface.
        vtkNew<vtkProperty> inside;
        inside->DeepCopy(look);
        inside->SetColor(0.62 * parts[n].rgb[0], 0.55 * parts[n].rgb[1], 0.50 * parts[n].rgb[2]);
        actor->SetBackfaceProperty(inside);
      }
      renderer->AddActor(actor);
    }
    look_at(renderer, s.centre_mm, s.radius_mm, eye);
    vtkCamera* const camera = renderer->GetActiveCamera();
    // Looking along `up` there is no up: any other will do.
    const Vec3 up = length(cross(s.up, eye)) > 0.05 ? s.up : std::abs(eye.y) < 0.9 ? Vec3{0, -1, 0} : Vec3{0, 0, 1};
    camera->SetViewUp(up.x, up.y, up.z);
    camera->SetParallelProjection(1);
    camera->SetParallelScale(s.radius_mm);
    renderer->ResetCameraClippingRange();
    set_depth(renderer, {true, 1});
    pictures.push_back(window->render());
    window->window()->RemoveRenderer(renderer);
    if (s.scale_bar) write_scale_bar(pictures.back(), 2 * s.radius_mm / s.height, 40);
  }
  return pictures;
}

}  // namespace osteo::inline display
