// Whether the values are Hounsfield units. Private to libs/imaging/dicom.
#pragma once
#include "osteo/imaging/dicom/verdict.h"
#include "pixels.h"

namespace osteo::inline imaging::dicom {

/// Fills verdict.values and adds what is to be said about them. Needs verdict.output. Values that are no HU by about a
/// thousand, or turned, are errors unless `any_values`.
void check_values(Verdict& verdict, const ValueCount& count, double voxel_mm3, bool any_values);

}  // namespace osteo::inline imaging::dicom
