// Values as objects of VTK and back.
#pragma once
#include <vtkSmartPointer.h>

#include <span>
#include <string>

#include "osteo/core/data/data.h"

class vtkDataObject;
class vtkInformation;

namespace osteo::inline app {

[[nodiscard]] bool is_image(DataKind kind);
/// VTK's class for a kind.
[[nodiscard]] const char* class_of(DataKind kind);
/// Makes the object of an output's information one of class_of(kind), unless it is.
void make_object(vtkInformation* info, DataKind kind);
/// Extent, spacing, origin, direction and type of an image; those of an empty one for another value.
void inform(vtkInformation* info, const Data& value);
/// Gives an object that make_object() made the value, which goes along with it (vtkOsteoDataObject::Attach).
void fill(vtkDataObject* object, const Data& value);
/// The value of an object: the one that goes along with it, else the first of these kinds that it can be.
/// Errors: usage, with `called`, when it can be none; corrupt, as of osteo/imaging/io/vtk_data.h.
[[nodiscard]] Data value_of(vtkDataObject* object, std::span<const DataKind> kinds, const std::string& called);

}  // namespace osteo::inline app
