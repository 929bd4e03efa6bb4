#include "osteo/vtk/vtkOsteoDataObject.h"

#include <vtkInformation.h>
#include <vtkObjectFactory.h>

vtkStandardNewMacro(vtkOsteoDataObject);

void vtkOsteoDataObject::PrintSelf(ostream& os, vtkIndent indent) {
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Kind: " << osteo::kind_name(osteo::kind_of(this->Value)) << '\n';
}

void vtkOsteoDataObject::SetValue(osteo::Data value) {
  this->Value = std::move(value);
  this->Modified();
}

void vtkOsteoDataObject::Initialize() {
  this->Superclass::Initialize();
  this->Value = {};
}

void vtkOsteoDataObject::ShallowCopy(vtkDataObject* source) {
  if (auto* const other = vtkOsteoDataObject::SafeDownCast(source)) this->Value = other->Value;
  this->Superclass::ShallowCopy(source);
}

void vtkOsteoDataObject::DeepCopy(vtkDataObject* source) {
  if (auto* const other = vtkOsteoDataObject::SafeDownCast(source)) this->Value = other->Value;
  this->Superclass::DeepCopy(source);
}

unsigned long vtkOsteoDataObject::GetActualMemorySize() {
  unsigned long kib = this->Superclass::GetActualMemorySize();
  if (const auto* grid = std::get_if<osteo::SparseGrid>(&this->Value)) kib += grid->memory_bytes / 1024;
  if (const auto* picture = std::get_if<osteo::Picture>(&this->Value)) kib += picture->rgb.size() / 1024;
  return kib;
}

vtkOsteoDataObject* vtkOsteoDataObject::GetData(vtkInformation* info) {
  return info != nullptr ? vtkOsteoDataObject::SafeDownCast(info->Get(vtkDataObject::DATA_OBJECT())) : nullptr;
}
