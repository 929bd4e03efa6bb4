#include "before_view.h"

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkPolyData.h>
#include <vtkRenderWindow.h>

#include "osteo/display/view/actors.h"
#include "osteo/imaging/io/vtk_data.h"

namespace osteo::inline app {

BeforeView::BeforeView(vtkRenderWindow* window, const TriMesh& mesh) : window_(window) {
  set_up_scene(renderer_);
  renderer_->AddActor(make_bone_actor(to_vtk(mesh)));
  window_->AddRenderer(renderer_);
}

BeforeView::~BeforeView() {
  if (now_ != nullptr) now_->DrawOn();
  window_->RemoveRenderer(renderer_);
}

void BeforeView::place(vtkRenderer* now, bool shown) {
  now_ = now;
  now->SetDraw(shown ? 0 : 1);
  renderer_->SetDraw(shown ? 1 : 0);
  if (!shown) return;
  renderer_->SetActiveCamera(now->GetActiveCamera());
  renderer_->SetViewport(now->GetViewport());
  renderer_->ResetCameraClippingRange();
}

}  // namespace osteo::inline app
