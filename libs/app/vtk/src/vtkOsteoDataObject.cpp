#include "osteo/app/vtk/vtkOsteoDataObject.h"

#include <vtkInformation.h>
#include <vtkInformationObjectBaseKey.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>

vtkStandardNewMacro(vtkOsteoDataObject);

namespace {

vtkInformationObjectBaseKey* attached_key() {
  static vtkInformationObjectBaseKey* const key =
      vtkInformationObjectBaseKey::MakeKey("ATTACHED_VALUE", "osteo", "vtkOsteoDataObject");
  return key;
}

}  // namespace

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

void vtkOsteoDataObject::Attach(vtkDataObject* object, osteo::Data value) {
  const vtkNew<vtkOsteoDataObject> holder;
  holder->Value = std::move(value);
  holder->Shown = object;
  holder->ShownTime = object->GetMTime();
  object->GetInformation()->Set(attached_key(), holder);
}

const osteo::Data* vtkOsteoDataObject::GetAttached(vtkDataObject* object) {
  const auto* const holder = dynamic_cast<vtkOsteoDataObject*>(object->GetInformation()->Get(attached_key()));
  return holder != nullptr && holder->Shown == object && holder->ShownTime == object->GetMTime() ? &holder->Value
                                                                                                 : nullptr;
}

void vtkOsteoDataObject::Detach(vtkDataObject* object) {
  object->GetInformation()->Remove(attached_key());
}
