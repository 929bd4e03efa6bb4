// The header of a session file: JSON that describes what follows.
#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "osteo/session/recording/session_reader.h"
#include "record_codec.h"

namespace osteo::inline session {

inline constexpr int kSessionFormat = 2;

[[nodiscard]] std::string header_json(const SessionHeader& header);
/// Fills all of the outline that a header tells, and the kinds of records in the file. `name` is the file's, for errors. Throws
/// Error(corrupt), nlohmann::json::exception.
void read_header(std::string_view text, const std::string& name, SessionOutline& outline, std::vector<FileTable>& tables);

}  // namespace osteo::session
