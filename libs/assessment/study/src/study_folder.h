// The files of a study's folder, for all that reads or changes it.
#pragma once
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "osteo/assessment/study/study.h"

namespace osteo::inline assessment::study {

/// sessions.csv begins with these; the metrics follow those of kSourceColumns.
inline const std::vector<std::string> kSessionColumns{"blind", "participant", "case", "attempt"};
/// What a row is of: all texts. Tables of before have none of them.
inline const std::vector<std::string> kSourceColumns{"stream",      "bone",      "procedure",
                                                     "recorded_by", "scored_by", "marks"};

[[nodiscard]] inline bool among(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}
[[nodiscard]] std::string listed(const std::vector<std::string>& names);
/// Null where there is none.
[[nodiscard]] const Participant* find_participant(const Study& study, const std::string& code);

/// Null for a column that is no text of a source: a metric, or the marks.
[[nodiscard]] std::string* text_of(Source& source, const std::string& column);
[[nodiscard]] std::string marks_of(const Source& source);
/// False where a word is none of them.
[[nodiscard]] bool read_marks(std::string words, Source& source);

/// What does not hold of a plan, wherever it comes from; empty when all is well.
[[nodiscard]] std::string wrong_with(const Plan& plan);
void write_plan(const std::filesystem::path& folder, const Plan& plan);
void write_participants(const std::filesystem::path& folder, const Study& study);
void write_order(const std::filesystem::path& folder, const Study& study);
void write_sessions(const std::filesystem::path& folder, const Study& study);
/// read_study, but for what raters gave.
[[nodiscard]] Study read_without_ratings(const std::filesystem::path& folder);
/// By name.
[[nodiscard]] std::vector<std::filesystem::path> rating_files(const std::filesystem::path& folder);

}  // namespace osteo::inline assessment::study
