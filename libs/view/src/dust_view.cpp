#include "osteo/view/dust_view.h"

#include <vtkActor.h>
#include <vtkFloatArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPointGaussianMapper.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>

#include <algorithm>
#include <cmath>

namespace osteo {

struct DustView::Impl {
  vtkNew<vtkPolyData> data;
  vtkNew<vtkPoints> points;
  vtkNew<vtkFloatArray> size;
  vtkNew<vtkPointGaussianMapper> mapper;
  vtkNew<vtkActor> actor;
  vtkRenderer* renderer = nullptr;
};

DustView::DustView(vtkRenderer* renderer, double cell_mm) : impl_(std::make_unique<Impl>()) {
  Impl& m = *impl_;
  m.renderer = renderer;
  m.size->SetName("size");
  m.data->SetPoints(m.points);
  m.data->GetPointData()->AddArray(m.size);
  m.mapper->SetInputData(m.data);
  m.mapper->SetScaleArray("size");
  m.mapper->SetScaleFactor(0.75 * cell_mm);
  m.mapper->EmissiveOff();
  m.mapper->ScalarVisibilityOff();
  m.actor->SetMapper(m.mapper);
  m.actor->GetProperty()->SetColor(0.86, 0.78, 0.66);
  m.actor->GetProperty()->SetOpacity(0.8);
  m.actor->PickableOff();
  renderer->AddActor(m.actor);
}

DustView::~DustView() {
  impl_->renderer->RemoveActor(impl_->actor);
}

void DustView::update(const Dust& dust) {
  Impl& m = *impl_;
  m.points->Reset();
  m.size->Reset();
  dust.visit([&](Vec3 p, double full) {
    if (full < 0.02) return;  // a haze nobody would see
    m.points->InsertNextPoint(p.x, p.y, p.z);
    m.size->InsertNextValue(static_cast<float>(std::sqrt(std::min(full, 1.5))));
  });
  m.points->Modified();
  m.size->Modified();
  m.data->Modified();
  m.actor->SetVisibility(m.points->GetNumberOfPoints() > 0);
}

}  // namespace osteo
