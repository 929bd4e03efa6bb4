// A volume as a DICOM CT series.
#pragma once
#include <filesystem>

#include "osteo/base/context.h"
#include "osteo/data/volume.h"

namespace osteo {

/// A CT series in a new folder, one file a slice, with made-up identity "OSTEOTOME^PHANTOM". Atomic.
void save_dicom_series(const Image& image, const std::filesystem::path& folder, const Context& context = {});

}  // namespace osteo
