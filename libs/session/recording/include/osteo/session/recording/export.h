// Sessions in the formats of other programs.
#pragma once
#include <filesystem>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/session/recording/session_reader.h"

namespace osteo::inline session {

/// The files that export_session() writes for this one: itself, and for out.csv also out-actions.csv and out-notes.csv.
[[nodiscard]] std::vector<std::filesystem::path> export_files(const std::filesystem::path& path);

/// By the ending: .csv (one row a tick; actions and notes in files of their own), .h5 (HDF5: /ticks, /actions, /gaps,
/// /notes and /voxel_changes with a column for each number and its unit, the header as attributes), .mcap (channels
/// /ticks, /actions, /gaps, /notes, messages in JSON with their schemas; chunks with indices, not compressed). Columns
/// are the fields that the file has and this version knows (records.h). Each file is written whole or not at all;
/// memory does not grow with the session. Errors: usage (unknown ending), cannot_write, corrupt.
void export_session(const SessionReader& session, const std::filesystem::path& path, const Context& context);

}  // namespace osteo::inline session
