// Who has looked at a case and stands for it. Bound to what was looked at: any later change ends it.
#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "osteo/core/base/json_document.h"

namespace osteo::inline session {

struct Approval {
  std::string by, date, note;  ///< the name as the person gave it; the day as YYYY-MM-DD
  std::string case_hash;       ///< of all files that the manifest names
  std::string report_hash;     ///< of the report as it was signed, without the signature
  friend bool operator==(const Approval&, const Approval&) = default;
};

enum class ApprovalState { none, valid, outdated };

struct ApprovalNow {
  ApprovalState state = ApprovalState::none;
  std::optional<Approval> approval;
  std::string changed;  ///< what was changed since; empty unless outdated
  /// "not approved", "approved by NAME on DATE", "approved by NAME on DATE, before the last change (the bone): no
  /// longer valid".
  [[nodiscard]] std::string words() const;
};

/// The report of a case: CASE.report.html or .pdf, beside the folder, since it shows more than bone.
[[nodiscard]] std::filesystem::path report_file(const std::filesystem::path& case_folder, const std::string& suffix);

/// Content of all files that the manifest names, as they lie there now. Error(no_input, corrupt) where it is no case.
[[nodiscard]] std::string case_hash(const std::filesystem::path& case_folder);

/// Reads every file of the case to compare. A report that is not there does not end an approval: the case may have been
/// copied without it. A record that cannot be read counts as outdated. Errors: as of case_hash.
[[nodiscard]] ApprovalNow approval_of(const std::filesystem::path& case_folder);
/// Of today. Written whole or not at all into approval.json of the case. Errors: usage for an empty name, control
/// characters, or texts beyond 80 and 300 bytes; no_input where there is no report to sign; cannot_write.
void approve(const std::filesystem::path& case_folder, const std::string& by, const std::string& note);
/// Whether there was one.
bool withdraw_approval(const std::filesystem::path& case_folder);

/// Error(failed) unless there is a valid one.
void require_approval(const ApprovalNow& now, const std::filesystem::path& case_folder);

/// For session.json: { "state": "valid", "by", "date", "note" }.
[[nodiscard]] Json approval_json(const ApprovalNow& now);

}  // namespace osteo::inline session
