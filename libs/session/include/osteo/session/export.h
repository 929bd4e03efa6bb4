// Sessions in the formats of other programs.
#pragma once
#include <filesystem>

#include "osteo/base/context.h"
#include "osteo/session/session_file.h"

namespace osteo {

/// By the ending: .csv (one row a tick), .h5 (HDF5: /ticks with a column for each field, /voxel_changes, the header as attributes),
/// .mcap (channel /ticks, one message a tick in JSON with its schema; unindexed, uncompressed). Written whole or not at all.
/// Errors: usage (unknown ending), cannot_write.
void export_session(const Session& session, const std::filesystem::path& path, const Context& context);

}  // namespace osteo
