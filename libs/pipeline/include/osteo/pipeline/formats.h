// Any value from and to a file, by suffix.
#pragma once
#include <filesystem>
#include <span>

#include "osteo/base/context.h"
#include "osteo/data/data.h"

namespace osteo {

/// The value in `path`, of one of the accepted kinds. A port that accepts `source` gets the path itself.
/// Errors: as of the readers; usage when the file is of a kind that is not accepted.
[[nodiscard]] Data load_data(const std::filesystem::path& path, std::span<const DataKind> accepted, const Context& context = {});

/// Writes by suffix, atomically. An image saved under a name without suffix becomes a folder of DICOM files.
void save_data(const Data& data, const std::filesystem::path& path, const Context& context = {});

/// Throws Error(usage) when a value of this kind cannot be saved under this name. Reads and writes nothing.
void require_savable(DataKind kind, const std::filesystem::path& path);

/// "image: .nrrd .nii.gz ..." for help texts.
[[nodiscard]] std::string suffixes_of(DataKind kind);

}  // namespace osteo
