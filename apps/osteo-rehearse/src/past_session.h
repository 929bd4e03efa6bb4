// A session that is over, to be looked at again: nothing is written into it.
#pragma once
#include "osteo/app/window/rehearsal_window.h"
#include "osteo/session/scene/session_folder.h"

namespace osteo {

class PastSession {
 public:
  /// Errors: as open_session_folder and SessionReader; a damaged session is opened as far as it goes.
  PastSession(const std::filesystem::path& folder, const std::filesystem::path& case_folder);

  [[nodiscard]] const SessionFolder& folder() const { return folder_; }
  /// What runs behind the page: a hand at rest in the bone as it was at the beginning, recorded nowhere. Errors: as
  /// world_at_begin; corrupt where the session was recorded on another bone.
  [[nodiscard]] std::unique_ptr<Rehearsal> stage(const Case& the_case, RehearsalOptions options, const HandView& view,
                                                 const Context& context) const;
  /// From its stream, and from its summary where it was saved with one.
  [[nodiscard]] SessionFacts facts(const Anatomy& anatomy) const;

 private:
  SessionFolder folder_;
};

}  // namespace osteo
