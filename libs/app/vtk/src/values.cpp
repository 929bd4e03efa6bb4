#include "values.h"

#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkMatrix3x3.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkStreamingDemandDrivenPipeline.h>
#include <vtkUnstructuredGrid.h>

#include <algorithm>

#include "osteo/app/vtk/vtkOsteoDataObject.h"
#include "osteo/core/base/error.h"
#include "osteo/imaging/io/vtk_data.h"

namespace osteo::inline app {

bool is_image(DataKind kind) {
  return kind == DataKind::image || kind == DataKind::labels;
}

const char* class_of(DataKind kind) {
  if (is_image(kind)) return "vtkImageData";
  if (kind == DataKind::surface) return "vtkPolyData";
  if (kind == DataKind::tets) return "vtkUnstructuredGrid";
  return "vtkOsteoDataObject";
}

void make_object(vtkInformation* info, DataKind kind) {
  vtkDataObject* const present = info->Get(vtkDataObject::DATA_OBJECT());
  if (present != nullptr && present->IsA(class_of(kind))) return;
  vtkSmartPointer<vtkDataObject> fresh;
  if (is_image(kind))
    fresh = vtkSmartPointer<vtkImageData>::New();
  else if (kind == DataKind::surface)
    fresh = vtkSmartPointer<vtkPolyData>::New();
  else if (kind == DataKind::tets)
    fresh = vtkSmartPointer<vtkUnstructuredGrid>::New();
  else
    fresh = vtkSmartPointer<vtkOsteoDataObject>::New();
  info->Set(vtkDataObject::DATA_OBJECT(), fresh);
}

void inform(vtkInformation* info, const Data& value) {
  vtkSmartPointer<vtkImageData> image = vtkSmartPointer<vtkImageData>::New();
  if (const auto* i = std::get_if<Image>(&value)) image = to_vtk(*i);
  if (const auto* l = std::get_if<Labels>(&value)) image = to_vtk(*l);
  int extent[6];
  image->GetExtent(extent);
  info->Set(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), extent, 6);
  info->Set(vtkDataObject::SPACING(), image->GetSpacing(), 3);
  info->Set(vtkDataObject::ORIGIN(), image->GetOrigin(), 3);
  info->Set(vtkDataObject::DIRECTION(), image->GetDirectionMatrix()->GetData(), 9);
  if (image->GetPointData()->GetScalars() != nullptr)
    vtkDataObject::SetPointDataActiveScalarInfo(info, image->GetScalarType(), 1);
}

void fill(vtkDataObject* object, const Data& value) {
  vtkOsteoDataObject::Detach(object);
  if (std::holds_alternative<std::monostate>(value)) {  // an output that was not made, this time
    object->Initialize();
    return;
  }
  if (auto* const image = vtkImageData::SafeDownCast(object)) {
    if (const auto* i = std::get_if<Image>(&value)) image->ShallowCopy(to_vtk(*i));
    if (const auto* l = std::get_if<Labels>(&value)) image->ShallowCopy(to_vtk(*l));
  } else if (auto* const poly = vtkPolyData::SafeDownCast(object)) {
    if (const auto* s = std::get_if<Surface>(&value)) poly->ShallowCopy(to_vtk(**s));
  } else if (auto* const cells = vtkUnstructuredGrid::SafeDownCast(object)) {
    if (const auto* t = std::get_if<Tets>(&value)) cells->ShallowCopy(to_vtk(**t));
  } else if (auto* const own = vtkOsteoDataObject::SafeDownCast(object)) {
    own->SetValue(value);
    return;
  }
  vtkOsteoDataObject::Attach(object, value);
}

Data value_of(vtkDataObject* object, std::span<const DataKind> kinds, const std::string& called) {
  if (auto* const own = vtkOsteoDataObject::SafeDownCast(object)) return own->GetValue();
  const auto taken = [&](DataKind kind) { return std::find(kinds.begin(), kinds.end(), kind) != kinds.end(); };
  if (const Data* const value = vtkOsteoDataObject::GetAttached(object); value != nullptr && taken(kind_of(*value)))
    return *value;
  for (const DataKind kind : kinds) {
    if (auto* const image = vtkImageData::SafeDownCast(object)) {
      const bool bytes = image->GetScalarType() == VTK_UNSIGNED_CHAR;
      if (kind == DataKind::image && !(bytes && taken(DataKind::labels))) return image_from_vtk(image);
      if (kind == DataKind::labels) return labels_from_vtk(image);
    }
    if (auto* const poly = vtkPolyData::SafeDownCast(object); poly != nullptr && kind == DataKind::surface) {
      return std::make_shared<const TriMesh>(mesh_from_vtk(poly));
    }
    if (auto* const cells = vtkUnstructuredGrid::SafeDownCast(object); cells != nullptr && kind == DataKind::tets) {
      return std::make_shared<const TetMesh>(tets_from_vtk(cells));
    }
  }
  throw Error(ExitCode::usage, "the input '" + called + "' cannot be a " + object->GetClassName());
}

}  // namespace osteo::inline app
