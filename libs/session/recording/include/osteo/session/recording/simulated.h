// Whether nobody drilled a session: simulated trainees say so in the stream.
#pragma once
#include <string>
#include <string_view>

#include "osteo/session/recording/session_reader.h"

namespace osteo::inline session {

/// The kind of the note at the beginning of a session by a simulated trainee; its value names skill and seed.
inline constexpr std::string_view kSimulatedNote = "simulated";

/// For whoever shows a session, in a sentence; empty where a person drilled it. Reads until the first note at most.
[[nodiscard]] std::string simulated_text(const SessionReader& session);

}  // namespace osteo::inline session
