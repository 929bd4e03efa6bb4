// A session written once more, with something else in it.
#pragma once
#include <filesystem>
#include <functional>

#include "osteo/session/recording/session_reader.h"

namespace osteo::test {

inline void rewrite_session(const std::filesystem::path& from, const std::filesystem::path& to,
                            const std::function<void(SessionBatch&)>& change) {
  const SessionReader reader(from);
  std::filesystem::remove(to);
  SessionWriter writer(to, reader.header());
  auto parts = reader.parts();
  // Whole frames: a checkpoint stands behind the changes of its ticks.
  SessionBatch frame;
  const auto end_frame = [&] {
    change(frame);
    writer.append(frame);
    frame = {};
  };
  while (const SessionPart* const p = parts.next()) {
    if (!p->actions.empty() || (!p->ticks.empty() && !frame.ticks.empty()) || p->gap != nullptr) end_frame();
    if (p->gap != nullptr) writer.append(RecordingGap{p->gap->first_tick, p->gap->ticks, p->gap->bone_lost});
    frame.actions.insert(frame.actions.end(), p->actions.begin(), p->actions.end());
    frame.ticks.insert(frame.ticks.end(), p->ticks.begin(), p->ticks.end());
    frame.changes.insert(frame.changes.end(), p->changes.begin(), p->changes.end());
    frame.notes.insert(frame.notes.end(), p->notes.begin(), p->notes.end());
  }
  end_frame();
  if (reader.outline().end) writer.finish(*reader.outline().end);
}

}  // namespace osteo::test
