// Component import: a CT (here a phantom's, through a file) to bone in cubes of 1 mm.
#include <cmath>
#include <cstdio>

#include "osteo/geometry/grid/resample.h"
#include "osteo/imaging/dicom/import.h"
#include "osteo/imaging/image/phantom.h"
#include "osteo/imaging/image/threshold.h"
#include "osteo/imaging/io/volume_io.h"

int main() {
  osteo::save_image(osteo::make_phantom({.region = osteo::PhantomRegion::temporal, .spacing_mm = 2}).ct, "ct.nrrd");
  const osteo::Imported ct = osteo::import_ct("ct.nrrd", {});  // or a DICOM folder, DICOMDIR, archive
  const osteo::Labels bone = osteo::threshold(ct.image, {.lower = 300});
  const osteo::ResampledBone cubes = osteo::resample_bone(ct.image, bone, {.spacing_mm = 1});
  std::printf("%.0f mm3 of bone before, %.0f after\n", cubes.volume_before_mm3, cubes.volume_after_mm3);
  return cubes.volume_before_mm3 > 1000 && std::abs(cubes.volume_after_mm3 / cubes.volume_before_mm3 - 1) < 0.01 ? 0
                                                                                                                 : 1;
}
