// Sessions in the formats of other programs.
#pragma once
#include <filesystem>
#include <vector>

#include "osteo/base/context.h"
#include "osteo/session/session_file.h"

namespace osteo {

/// The files that export_session() writes for this one: itself, and for out.csv also out-actions.csv.
[[nodiscard]] std::vector<std::filesystem::path> export_files(const std::filesystem::path& path);

/// By the ending: .csv (one row a tick; actions in a file of their own), .h5 (HDF5: /ticks, /actions, /gaps and /voxel_changes with a
/// column for each number and its unit, the header as attributes), .mcap (channels /ticks, /actions, /gaps, messages in JSON with their
/// schemas; chunks with indices, not compressed). Each file is written whole or not at all; memory does not grow with the session. Errors:
/// usage (unknown ending), cannot_write.
void export_session(const Session& session, const std::filesystem::path& path, const Context& context);

}  // namespace osteo
