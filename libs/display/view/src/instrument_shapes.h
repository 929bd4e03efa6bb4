// Surfaces of instruments, made of rings. Private to libs/display/view.
#pragma once
#include <vtkSmartPointer.h>

#include <functional>

#include "osteo/simulation/bone/instrument.h"

class vtkPolyData;

namespace osteo::inline display {

/// A burr's head: the round cone of its shape, flutes or grain cut into it by `sharp` (0: smooth, as it looks when it
/// turns fast); with normals and colours.
[[nodiscard]] vtkSmartPointer<vtkPolyData> burr_surface(const Burr& burr, double sharp);
/// Head and tube of what is no burr: in the instrument's own frame, with colours.
[[nodiscard]] vtkSmartPointer<vtkPolyData> tip_surface(const Instrument& instrument);
/// What is behind the head: the shaft, without the rings for which `inside` holds, those beside them tinted; and the
/// handpiece.
struct ShaftSurface {
  vtkSmartPointer<vtkPolyData> data;
  double in_bone = 0;  ///< share of the rings
};
[[nodiscard]] ShaftSurface shaft_surface(const Instrument& instrument, const std::function<bool(Vec3)>& inside = {});

}  // namespace osteo::inline display
