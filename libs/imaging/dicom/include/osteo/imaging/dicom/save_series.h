// A volume as a DICOM CT series.
#pragma once
#include <filesystem>
#include <functional>

#include "osteo/core/base/context.h"
#include "osteo/core/data/volume.h"

namespace osteo::inline imaging {

/// A CT series in a new folder, one file a slice, with made-up identity "OSTEOTOME^PHANTOM". Atomic; `may_replace` as
/// in write_folder_atomically.
void save_dicom_series(const Image& image, const std::filesystem::path& folder, const Context& context = {},
                       const std::function<void(const std::filesystem::path& old)>& may_replace = {});

}  // namespace osteo::inline imaging
