// What an exception becomes for VTK: an error code and a text.
#pragma once
#include <exception>
#include <string>

namespace osteo::inline app {

struct VtkFailure {
  unsigned long code = 0;  ///< of vtkErrorCode
  std::string text;        ///< what went wrong and what to do
};
[[nodiscard]] VtkFailure vtk_failure(const std::exception_ptr& thrown);

}  // namespace osteo::inline app
