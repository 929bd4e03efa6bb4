/// @class vtkOsteoDataObject
/// What VTK has no class for (sparse grids, pictures) in a VTK pipeline: holds one immutable value, shared by copies.
#ifndef vtkOsteoDataObject_h
#define vtkOsteoDataObject_h

#include <vtkDataObject.h>

#include "osteo/data/data.h"

class vtkOsteoDataObject : public vtkDataObject {
 public:
  static vtkOsteoDataObject* New();
  vtkTypeMacro(vtkOsteoDataObject, vtkDataObject);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  void SetValue(osteo::Data value);
  const osteo::Data& GetValue() const { return this->Value; }

  void Initialize() override;
  /// Both copies share the value: it never changes.
  void ShallowCopy(vtkDataObject* source) override;
  void DeepCopy(vtkDataObject* source) override;
  unsigned long GetActualMemorySize() override;  // kibibytes

  static vtkOsteoDataObject* GetData(vtkInformation* info);

 protected:
  vtkOsteoDataObject() = default;
  ~vtkOsteoDataObject() override = default;

 private:
  vtkOsteoDataObject(const vtkOsteoDataObject&) = delete;
  void operator=(const vtkOsteoDataObject&) = delete;

  osteo::Data Value;
};

#endif
