// A session written once more, with something else in it.
#pragma once
#include <filesystem>
#include <functional>

#include "osteo/session/session_reader.h"

namespace osteo::test {

inline void rewrite_session(const std::filesystem::path& from, const std::filesystem::path& to,
                            const std::function<void(SessionBatch&)>& change) {
  const SessionReader reader(from);
  std::filesystem::remove(to);
  SessionWriter writer(to, reader.header());
  auto parts = reader.parts();
  while (const SessionPart* const p = parts.next()) {
    if (p->gap != nullptr) writer.append(RecordingGap{p->gap->first_tick, p->gap->ticks, p->gap->bone_lost});
    SessionBatch b{{p->actions.begin(), p->actions.end()},
                   {p->ticks.begin(), p->ticks.end()},
                   {p->changes.begin(), p->changes.end()},
                   {p->notes.begin(), p->notes.end()}};
    change(b);
    writer.append(b);
  }
  if (reader.outline().end) writer.finish(*reader.outline().end);
}

}  // namespace osteo::test
