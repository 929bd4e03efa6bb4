#include "failure.h"

#include <vtkErrorCode.h>

#include "osteo/core/base/error.h"

namespace osteo::inline app {

VtkFailure vtk_failure(const std::exception_ptr& thrown) {
  const auto of = [](ExitCode code) { return vtkErrorCode::UserError + static_cast<unsigned long>(code); };
  try {
    std::rethrow_exception(thrown);
  } catch (const Error& e) {
    VtkFailure failure{of(e.code()), e.advice().empty() ? e.what() : std::string(e.what()) + ". " + e.advice()};
    if (e.code() == ExitCode::no_input) failure.code = vtkErrorCode::FileNotFoundError;
    if (e.code() == ExitCode::cannot_read) failure.code = vtkErrorCode::CannotOpenFileError;
    if (e.code() == ExitCode::corrupt) failure.code = vtkErrorCode::FileFormatError;
    return failure;
  } catch (const std::exception& e) {
    return {of(ExitCode::unspecified), e.what()};
  }
}

}  // namespace osteo::inline app
