// A session on disk: its stream, what it was recorded on, and what came of it.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "osteo/session/scene/case.h"
#include "osteo/session/scene/rehearsal.h"

namespace osteo::inline session {

struct SessionFolder {
  std::filesystem::path folder;
  std::filesystem::path case_folder;
  std::filesystem::path resumed_from;  ///< the session whose end is this one's beginning, or empty
  std::string approval = {};           ///< who stood for the case when it began, in words; empty: not known
  double resumed_at_s = 0;             ///< of that session: this one begins with the scene of then; 0: of its end
  std::string guided = {};             ///< how another hand led or showed it, in words; empty: nobody did

  [[nodiscard]] std::filesystem::path stream() const { return folder / "stream.oss"; }
  [[nodiscard]] std::filesystem::path summary() const { return folder / "summary.json"; }
};

/// Makes a new, empty folder: `wanted`, or when that is empty CASE/sessions/N with the first free N. Writes
/// session.json, which ties it to the case by relative paths and says whether the case was approved.
/// Error(cannot_write) when `wanted` holds something. `guided`: words for a session in which another hand leads or is
/// shown. `resumed_at_s`: SessionFolder::resumed_at_s.
[[nodiscard]] SessionFolder create_session_folder(const std::filesystem::path& wanted,
                                                  const std::filesystem::path& case_folder,
                                                  const std::filesystem::path& resumed_from,
                                                  const std::string& guided = {}, double resumed_at_s = 0);

/// Errors: no_input, corrupt. `case_folder` overrides what the session says when it is not empty.
[[nodiscard]] SessionFolder open_session_folder(const std::filesystem::path& folder,
                                                const std::filesystem::path& case_folder = {});

/// One of the sessions that another resumes from.
struct SessionBefore {
  SessionFolder session;
  double until_s = 0;  ///< up to where the next goes on from it, in seconds from its beginning; 0: to its end
};
/// All that a session resumes from, the first of all first; empty where it began with the case. Opens their
/// session.json only. Errors: those of open_session_folder; corrupt where they lead back to one of themselves (names
/// the session.json that does).
[[nodiscard]] std::vector<SessionBefore> sessions_before(const SessionFolder& session);

/// The case's bone, with its finer region where it has one.
[[nodiscard]] World world_of(const Case& the_case, const Anatomy& anatomy);
/// The scene at the beginning of a session: the case's, as the sessions it goes on from have left it (their recorded
/// changes and actions). Errors: those of sessions_before() too, as for the two below.
[[nodiscard]] World world_at_begin(const SessionFolder& session, const Case& the_case, const Anatomy& anatomy,
                                   const Context& context);
/// The scene at the end of a session; where bone was lost on the way, the scene before that. Warns of all that the
/// session lacks. Error(corrupt) when it is damaged.
[[nodiscard]] World world_at_end(const SessionFolder& session, const Case& the_case, const Anatomy& anatomy,
                                 const Context& context);

/// The scene at a time of a session, in seconds from its beginning; exact to the tenth of a second that holds it.
/// Error(usage) behind its end; Error(corrupt) when it is damaged, or what came before is not all known.
[[nodiscard]] World world_at(const SessionFolder& session, double t_s, const Case& the_case, const Anatomy& anatomy,
                             const Context& context);

/// Settings from `file`, or where that is empty from haptics.json of the case where there is one.
void apply_haptic_settings(const std::filesystem::path& case_folder, const std::filesystem::path& file,
                           HapticSetup& setup);
/// What the case knows besides bone, as the setup asks for it. Settles in the setup whether removal goes by HU and by
/// which law, and names the structures. Warns when a case keeps no HU and nothing was asked. Errors: no_input (hardness
/// asked, no HU).
[[nodiscard]] Anatomy anatomy_of(const Case& the_case, HapticSetup& setup, const Context& context);

/// The constants of the law by which bone resists the burr, as summary.json has them, or null: all alike.
[[nodiscard]] std::string hardness_json(const Anatomy& anatomy);
/// The same in a sentence, with how to turn it off.
[[nodiscard]] std::string reported_hardness(const Anatomy& anatomy);
/// What the burr did near each critical structure, as summary.json lists it: seconds, not ticks; what was never within
/// reach is not there.
[[nodiscard]] std::string structures_json(const std::map<std::uint32_t, StructureEvents>& structures,
                                          const StructureMap& map, double rate_hz);
/// Writes summary.json and returns its text.
std::string write_summary(const SessionFolder& session, const RehearsalSummary& summary, double rate_hz,
                          const std::string& burr, const Anatomy& anatomy = {});

/// Writes into an empty or new folder: plan.json (each piece's volume, centre, inertia and transform as a 4 x 4 matrix
/// in rows; each plate's pieces, transform, opening, screw places and gaps to bone), piece-N.stl and plate-N.stl where
/// they are now, plate-N-gap.csv (points of the underside and how far below them bone begins). LPS mm. Returns the text
/// of plan.json. Error(cannot_write).
std::string write_result(const World& world, const std::filesystem::path& folder, const Context& context);

}  // namespace osteo::inline session
