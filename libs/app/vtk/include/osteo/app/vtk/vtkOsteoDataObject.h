/// @class vtkOsteoDataObject
/// What VTK has no class for (sparse grids, pictures) in a VTK pipeline: holds one immutable value, shared by copies.
#ifndef vtkOsteoDataObject_h
#define vtkOsteoDataObject_h

#include <vtkDataObject.h>

#include "osteo/core/data/data.h"

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

  /// Lets a value go along with an object of VTK that shows it, for what VTK's classes have no place for (names of
  /// structures) and so that nothing is made again from them. It is of this very object as it is now: copies have none,
  /// and a change (vtkObject::Modified) ends it.
  static void Attach(vtkDataObject* object, osteo::Data value);
  /// The object's value; null when it has none, or was changed since. The object's own: good until it changes.
  static const osteo::Data* GetAttached(vtkDataObject* object);
  static void Detach(vtkDataObject* object);

 protected:
  vtkOsteoDataObject() = default;
  ~vtkOsteoDataObject() override = default;

 private:
  vtkOsteoDataObject(const vtkOsteoDataObject&) = delete;
  void operator=(const vtkOsteoDataObject&) = delete;

  osteo::Data Value;
  const vtkDataObject* Shown = nullptr;  // of an attached value: whose, and how old that was; compared, never followed
  vtkMTimeType ShownTime = 0;
};

#endif
