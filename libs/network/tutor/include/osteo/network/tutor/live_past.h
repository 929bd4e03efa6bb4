// What the session that others join goes on from: they have the case alone.
#pragma once
#include "osteo/network/tutor/wire.h"
#include "osteo/session/scene/session_folder.h"

namespace osteo::inline network {

/// All that the sessions before `session` have done to the case's bone, as a session file of no ticks: actions and
/// changes in their order, so that undo goes back in the copy as it does in the original. Empty where it goes on from
/// none. Errors: corrupt; failed, where one of them lacks ticks, or all are more than kMaxPastBytes.
[[nodiscard]] Bytes past_bytes(const SessionFolder& session);
inline constexpr std::size_t kMaxPastBytes = std::size_t{15} << 20;

/// That of a session's settings (settings_bytes()). Error(corrupt).
[[nodiscard]] Bytes past_of(const Bytes& settings);

/// A place for a session that is joined: its folder, and where the host's goes on from others, one beside it with what
/// they did (OUT-before; or the case's next), from which it goes on. `wanted` and errors as create_session_folder.
[[nodiscard]] SessionFolder create_joined_folder(const std::filesystem::path& wanted,
                                                 const std::filesystem::path& case_folder, const Bytes& past,
                                                 const std::string& words);
/// The bone that it began with, as the host says: without a folder.
[[nodiscard]] World world_of_past(const Bytes& past, const Case& the_case, const Anatomy& anatomy);

}  // namespace osteo::inline network
