// Any value from and to a file, by suffix.
#pragma once
#include <filesystem>
#include <functional>
#include <span>

#include "osteo/core/base/context.h"
#include "osteo/core/data/data.h"

namespace osteo::inline imaging {

/// The value in `path`, of one of the accepted kinds. A port that accepts `source` gets the path itself.
/// Errors: as of the readers; usage when the file is of a kind that is not accepted.
[[nodiscard]] Data load_data(const std::filesystem::path& path, std::span<const DataKind> accepted,
                             const Context& context = {});

/// Writes by suffix, atomically. An image saved under a name without suffix becomes a folder of DICOM files; a folder
/// that is there already is replaced only when `may_replace` lets it pass (see write_folder_atomically).
void save_data(const Data& data, const std::filesystem::path& path, const Context& context = {},
               const std::function<void(const std::filesystem::path& old)>& may_replace = {});

/// Whether a value of this kind saved under this name becomes a folder.
[[nodiscard]] bool becomes_folder(DataKind kind, const std::filesystem::path& path);

/// Throws Error(usage) when a value of this kind cannot be saved under this name. Reads and writes nothing.
void require_savable(DataKind kind, const std::filesystem::path& path);

/// "image: .nrrd .nii.gz ..." for help texts.
[[nodiscard]] std::string suffixes_of(DataKind kind);

}  // namespace osteo::inline imaging
