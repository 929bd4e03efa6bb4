// Whether a part of a scene has changed. Private to libs/display/view.
#pragma once
#include <cstdint>

class vtkProp;

namespace osteo::inline display {

/// Another number when it would be drawn otherwise.
[[nodiscard]] std::uint64_t prop_stamp(vtkProp* prop);

}  // namespace osteo::inline display
