// A study as a folder of plain files: who takes part (by code), what each does in which order, what came out, what
// raters said.
//
//   study.json          title, procedure, groups, cases, attempts, items and scale of the ratings, primary outcomes,
//   seed procedure.json      by which sessions are scored, where there is one participants.csv    participant,group
//   order.csv           participant,position,case
//   sessions.csv        blind,participant,case,attempt, what the row is of (Source), and a column for each metric; an
//                       empty field is a missing value
//   forms/RATER.html    to rate with, in any browser, without a network
//   ratings/RATER.json  what the form saves
//   movies/BLIND.mp4    what the form shows, put there by hand
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "osteo/core/base/error.h"

namespace osteo::inline assessment::study {

struct Plan {
  std::string title, procedure;
  std::vector<std::string> groups;  ///< at least one
  std::string competent;            ///< the group that is meant to pass: ROC and pass mark ask for it
  std::vector<std::string> cases;   ///< at least one
  int attempts = 1;                 ///< of each case by each participant
  std::vector<std::string> items{"overall"};
  int lowest = 1, highest = 5;  ///< of the scale of each item
  std::uint64_t seed = 1;
  bool simulated = false;  ///< sessions and ratings are by programs: the report says so on every page
  /// Outcomes that the study is about, by the names that the report has; empty: none was named. Only these are
  /// corrected together (Holm).
  std::vector<std::string> primary{};
  int primary_after = 0;  ///< so many sessions were there already when they were named
};
struct Participant {
  std::string code, group;
};
struct OrderRow {
  std::string participant;
  int position = 1;
  std::string case_name;
};
/// What a row's numbers are of. A text that is empty is not known: numbers that came from elsewhere.
struct Source {
  std::string stream;                  ///< hash of the session's file: one session is one row
  std::string bone;                    ///< hash of the bone before the first tick: one case is one bone
  std::string procedure;               ///< hash of the procedure's file, with " mirrored" for the other side; "none"
  std::string recorded_by, scored_by;  ///< versions of the program
  bool simulated = false, guided = false, cut_short = false;
  bool other_bone = false;  ///< taken though its bone is not the case's
  [[nodiscard]] bool known() const { return !stream.empty(); }
};
struct Session {
  std::string blind;  ///< by which raters know it
  std::string participant, case_name;
  int attempt = 1;
  std::map<std::string, double> metrics;  ///< those that it has
  Source source{};
};
/// A session's numbers, as a file has them.
struct Measurements {
  std::vector<std::pair<std::string, double>> metrics;
  Source source;
};
/// Item -> value, nothing where the rater could not tell.
using SessionRating = std::map<std::string, std::optional<double>>;
struct RaterSheet {
  std::string rater;
  std::map<std::string, SessionRating> sessions;  ///< by blind code
};

/// The whole folder. All errors of reading name file and line.
struct Study {
  Plan plan;
  std::vector<Participant> participants;
  std::vector<OrderRow> order;
  std::vector<Session> sessions;
  std::vector<std::string> metrics;  ///< in the order of their columns
  std::vector<RaterSheet> raters;    ///< by name
};

/// Writes a new folder with its study.json and an empty participants.csv. Error(cannot_write) where there is something
/// already.
void new_study(const std::filesystem::path& folder, const Plan& plan);
/// Error(no_input) where there is no study.json; Error(usage) for what is wrong in a file.
[[nodiscard]] Study read_study(const std::filesystem::path& folder);

/// Appends to participants.csv. An empty code gets the next free one of P01, P02, ... Returns the code. Codes are up to
/// 16 letters, digits, '-' and '_', and differ in more than capitals: they are not the place for names.
std::string add_participant(const std::filesystem::path& folder, std::string code, const std::string& group);

/// What `osteo score` writes, as JSON or as a row of CSV (the same names and source by both), or any numbers: JSON
/// ({"NAME": 1.5, ...}, {"metrics": {...}}, a list of {"name", "of", "value"}) or CSV (a line of names and one of
/// values). `name` as errors call it; CSV where it ends so. A value that is empty or null is missing; other words than
/// numbers are left out and told in `notes`. Error(usage): a name twice, one that a spreadsheet takes for a formula.
[[nodiscard]] Measurements read_measurements(const std::string& text, const std::string& name,
                                             std::vector<std::string>& notes);
/// Differences from the rest of the study with which a row is taken only where they are named: "cut-short";
/// "other-bone" (not that of the case's other rows, or that of another case); "procedure" (another file, or other side
/// on the same case); "program" (another version recorded or scored it).
[[nodiscard]] std::span<const std::string_view> acceptable_differences();
/// Appends to sessions.csv; returns the blind code. Error(usage): a session that was guided; one by a simulated trainee
/// in a study of people, or by a person in a simulated one; one that is there already; a difference that `accepted`
/// does not name. Of numbers whose source is not known nothing of this can be said: told in `notes`.
std::string add_session(const std::filesystem::path& folder, const std::string& participant,
                        const std::string& case_name, int attempt, const Measurements& measured,
                        const std::vector<std::string>& accepted, std::vector<std::string>& notes);

struct Removed {
  std::size_t sessions = 0, ratings = 0, movies = 0;
  std::vector<std::string> forms;  ///< by rater: written again, without them
};
/// Takes a person out with all that is kept of them: sessions, ratings, movies, order, forms; with a `case_name` only
/// that session. Ratings of sessions that are no longer in sessions.csv go too. Error(usage) where there is no such.
Removed remove(const std::filesystem::path& folder, const std::string& participant, const std::string& case_name = {},
               int attempt = 1);

/// Names the primary outcomes; those of before are replaced. Error(usage): none, one twice, or one that none of the
/// sessions has, where there are any.
void set_primary(const std::filesystem::path& folder, const std::vector<std::string>& outcomes);

/// Who does which case when: Williams' balanced squares (1949), whose rows are dealt at random inside each group, so
/// that each case comes as often at each place. Those who are in order.csv keep their rows. Returns how many people
/// were added.
std::size_t make_order(const std::filesystem::path& folder);
/// The square itself: n rows for even n, 2 n for odd; each case as often at each place, and as often after each other
/// one.
[[nodiscard]] std::vector<std::vector<int>> williams(int n);

/// By which a form and what it saves know their study.
[[nodiscard]] std::string study_id(const Plan& plan);
/// Blind codes of all sessions, in the order in which this rater sees them; it follows from the study's seed and the
/// rater's code.
[[nodiscard]] std::vector<std::string> rating_order(const Study& study, const std::string& rater);
/// One page with everything in it. Sessions in rating_order(), by blind codes only.
[[nodiscard]] std::string form_html(const Study& study, const std::string& rater);
/// What the form saved, checked against the study; `name` as errors call it. Tells in `notes` what is missing.
[[nodiscard]] RaterSheet read_ratings(const std::string& text, const std::string& name, const Study& study,
                                      std::vector<std::string>& notes);

/// Error(usage) for what cannot be a code.
void need_code(const std::string& code, const std::string& called);

}  // namespace osteo::inline assessment::study
