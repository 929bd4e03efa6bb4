// Whether the values are Hounsfield units. Private to libs/dicom.
#pragma once
#include "osteo/dicom/verdict.h"
#include "pixels.h"

namespace osteo::dicom {

/// Fills verdict.values and adds what is to be said about them.
void check_values(Verdict& verdict, const ValueCount& count, double voxel_mm3);

}  // namespace osteo::dicom
