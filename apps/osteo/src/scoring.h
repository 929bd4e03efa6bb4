// A session folder scored, as 'osteo score' and 'osteo study add' do it.
#pragma once
#include <optional>

#include "osteo/assessment/evidence/score.h"

namespace osteo {

struct ScoreAsked {
  std::optional<Procedure> procedure;
  std::filesystem::path reference;  ///< folder with reference.json; empty: none
  std::string subject;              ///< whose sessions of the reference are left out
  bool heat = false;
  std::filesystem::path case_folder;  ///< empty: where the session says
  bool for_table = false;             ///< it goes into a table with others
};
struct Scored {
  Score score;
  std::string name;      ///< of its folder
  std::string guided;    ///< how another hand led it, in words; empty: nobody did
  bool damaged = false;  ///< what is there is scored
};
/// With all of Score::source. Errors: those of open_session_folder and score_session; usage (a reference or a table for
/// a guided session, a reference of another bone).
[[nodiscard]] Scored score_folder(const std::filesystem::path& session, const ScoreAsked& asked,
                                  const Context& context);
/// score_json, and "guided" where it is.
[[nodiscard]] Json json_of(const Scored& scored, bool evidence);

}  // namespace osteo
