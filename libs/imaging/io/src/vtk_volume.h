// vtkImageData to RawVolume and back. Private to libs/imaging/io.
#pragma once
#include <vtkSmartPointer.h>

#include "osteo/core/base/error.h"
#include "raw_volume.h"

class vtkImageData;

namespace osteo::inline imaging::io {

void set_frame(vtkImageData* image, const Frame& frame);
/// Shares the scalars.
[[nodiscard]] RawVolume raw_from_vtk(vtkImageData* image);
/// Shares the scalars for the time of the call: the result must not outlive `raw`.
[[nodiscard]] vtkSmartPointer<vtkImageData> vtk_view(const RawVolume& raw);

}  // namespace osteo::inline imaging::io
