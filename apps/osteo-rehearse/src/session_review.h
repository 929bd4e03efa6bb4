// What the window shows of a session that is over, from its score.
#pragma once
#include "osteo/app/window/session_review.h"
#include "osteo/assessment/evidence/procedure.h"
#include "osteo/session/scene/session_folder.h"

namespace osteo {

/// `procedure` may be null. Errors: as score_session and SessionPlayer.
[[nodiscard]] SessionReview review_of(const SessionFolder& folder, const Case& the_case, const Anatomy& anatomy,
                                      const Procedure* procedure, const Context& context);

}  // namespace osteo
