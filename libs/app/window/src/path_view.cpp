#include "path_view.h"

#include <vtkCellArray.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>

namespace osteo::inline app {

PathView::PathView(vtkRenderer* renderer, std::span<const Vec3> way_mm) : renderer_(renderer) {
  if (way_mm.size() < 2) return;
  auto points = vtkSmartPointer<vtkPoints>::New();
  auto lines = vtkSmartPointer<vtkCellArray>::New();
  lines->InsertNextCell(static_cast<int>(way_mm.size()));
  for (const Vec3& p : way_mm) lines->InsertCellPoint(points->InsertNextPoint(p.x, p.y, p.z));
  auto data = vtkSmartPointer<vtkPolyData>::New();
  data->SetPoints(points);
  data->SetLines(lines);
  auto mapper = vtkSmartPointer<vtkPolyDataMapper>::New();
  mapper->SetInputData(data);
  // In front of the bone that it leads into: a learner has to see where it goes on.
  mapper->SetRelativeCoincidentTopologyLineOffsetParameters(0, -60000);
  mapper->SetResolveCoincidentTopologyToPolygonOffset();
  actor_ = vtkSmartPointer<vtkActor>::New();
  actor_->SetMapper(mapper);
  actor_->GetProperty()->SetColor(0.1, 0.75, 0.9);
  actor_->GetProperty()->SetLineWidth(2);
  actor_->GetProperty()->LightingOff();
  renderer_->AddActor(actor_);
}

PathView::~PathView() {
  if (actor_) renderer_->RemoveActor(actor_);
}

}  // namespace osteo::inline app
