// Volumes of real numbers, such as distance maps, for other programs.
#pragma once
#include <filesystem>

#include "osteo/core/data/volume.h"

namespace osteo::inline imaging {

/// In single precision, as .nrrd or .vti, written atomically. Errors: usage for another suffix, cannot_write.
void save_values(const Volume<float>& values, const std::filesystem::path& path);

}  // namespace osteo::inline imaging
