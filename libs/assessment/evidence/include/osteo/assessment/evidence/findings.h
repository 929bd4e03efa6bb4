// What a score says, in words: the few things a person should know of a session, the most serious first.
#pragma once
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "osteo/assessment/evidence/score.h"
#include "osteo/core/base/json_document.h"

namespace osteo::inline assessment {

enum class FindingSeverity : int {
  good,     ///< as it should be
  note,     ///< worth knowing
  caution,  ///< worth doing otherwise
  serious,  ///< harm: a structure was injured
};
[[nodiscard]] std::string_view name_of(FindingSeverity severity);

/// A sentence with the figures in it, and where they come from. Everything in it is in the score; nothing is judged
/// that the score or the procedure does not judge, but for the limits of FindingLimits.
struct ScoreFinding {
  std::string id;    ///< of small letters, digits and '-': what it is about; the same for the same in every session
  std::string kind;  ///< "injury", "touch", "clearance", "hidden", "force", "speed", "instrument", "region", "item",
                     ///< "water", "time", "lost"
  FindingSeverity severity = FindingSeverity::note;
  std::string text;    ///< one sentence: "31 mm³ of bone went unseen, 9 mm³ of it within 2 mm of the sigmoid sinus."
  std::string why;     ///< how it is known, or what it is held against: one more sentence, may be empty
  std::string metric;  ///< the name of the value it comes from, or of the item; as in the score's JSON
  std::string structure;
  std::optional<double> value, limit;  ///< limit: what it is held against
  std::string unit;
  std::vector<double> times_s;   ///< moments to look at, by time; at most kMaxTimes
  std::optional<Vec3> at_mm;     ///< where to look; in the frame of the bone as it lay at the beginning
  std::vector<Vec3> places_mm;   ///< voxels or places that prove it; at most kMaxPlaces, evenly chosen
  std::size_t places_count = 0;  ///< of all
  double places_each = 0;        ///< mm2 or mm3 that one of all stands for, 0 where they are no amounts
  static constexpr std::size_t kMaxTimes = 200, kMaxPlaces = 20'000;
};

/// Where the score alone says nothing of good or bad. Proposals, fitted to nothing.
struct FindingLimits {
  double seen_well = 0.95;     ///< share of removed bone seen: at least this is good
  double hidden_near_mm3 = 1;  ///< unseen within 2 mm of a structure: from here on a caution
  double near_miss_mm = 0.5;   ///< a burr's surface that came nearer to a structure than this
  double above_band_share =
      0.2;                  ///< of drilling near a structure outside what 90 % of experts do: twice what chance gives
  double idle_share = 0.3;  ///< of the session
  double dry_share = 0.5;   ///< of drilling without water
};

struct Findings {
  std::vector<std::string> summary;  ///< sentences: how long, how much, how many items
  std::vector<ScoreFinding> list;    ///< the most serious first, then in the order of kinds, then the largest
  /// What could not be measured: why, and what (in words). One entry for each why.
  std::vector<std::pair<std::string, std::vector<std::string>>> not_measured;
  std::vector<std::string> words;  ///< of the score: what limits it

  [[nodiscard]] const ScoreFinding* find(std::string_view id) const;
};

/// `structures`, `procedure`: those the score was made with; may be null. Pure.
[[nodiscard]] Findings findings_of(const Score& score, const StructureMap* structures, const Procedure* procedure,
                                   const FindingLimits& limits = {});
/// "osteotome_findings": 1; places with `places`.
[[nodiscard]] Json findings_json(const Findings& findings, bool places);
/// A unit as people read it, of its code in tables and JSON: "mm³" of "mm3", nothing of "1" (a share or a count).
[[nodiscard]] std::string unit_text(std::string_view unit);
/// For people: "31", "4.2", "0.35", "12 min 3 s".
[[nodiscard]] std::string reported_number(double value);
[[nodiscard]] std::string reported_seconds(double seconds);

}  // namespace osteo::inline assessment
