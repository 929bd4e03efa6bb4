// Unpacks archives of DICOM files. Private to libs/imaging/dicom.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "osteo/core/base/context.h"

namespace osteo::inline imaging::dicom {

struct Unpacked {
  std::filesystem::path file;
  std::string name;  // in the archive
};

/// Every regular file of the archive, under numbers in `to`; names in the archive are never used as paths.
/// Errors: corrupt, with the archive's own reason; resources when the disk would fill up.
[[nodiscard]] std::vector<Unpacked> unpack(const std::filesystem::path& archive, const std::filesystem::path& to,
                                           const Context& context);

}  // namespace osteo::inline imaging::dicom
