#include "osteo/session/recording/session_reader.h"

namespace osteo::inline session {

std::string simulated_text(const SessionReader& session) {
  SessionReader::Parts parts = session.parts();
  // It is the first of all notes, before the first tick: what comes behind a second has none.
  while (const SessionPart* part = parts.next()) {
    for (const Note& n : part->notes)
      if (n.kind == kSimulatedNote) return "simulated: a program drilled this, no person";
    if (!part->ticks.empty() && part->ticks.front().tick > static_cast<std::uint64_t>(session.header().rate_hz)) break;
  }
  return {};
}

}  // namespace osteo::inline session
