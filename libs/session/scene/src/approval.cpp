#include "osteo/session/scene/approval.h"

#include <ctime>
#include <map>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json.h"
#include "osteo/core/base/shell.h"
#include "osteo/core/base/translate.h"
#include "osteo/core/report/sheet.h"
#include "osteo/session/scene/case.h"

namespace osteo::inline session {
namespace {

constexpr std::size_t kLongestName = 80, kLongestNote = 300;

fs::path record_of(const fs::path& folder) {
  return folder / "approval.json";
}

// Role -> content, of the files as they are; what is gone has an empty hash.
std::map<std::string, std::string> contents(const fs::path& folder) {
  const fs::path manifest = folder / "manifest.json";
  if (!fs::exists(manifest))
    throw Error(ExitCode::no_input, "'" + folder.string() + "' is not a prepared case: it has no manifest.json",
                "make one with: osteo prepare CT -o " + shell_path(folder));
  std::map<std::string, std::string> hashes;
  for (const auto& [role, file] : parse_manifest(read_text(manifest), manifest.string())) {
    const fs::path path = folder / file.name;
    hashes[role] = output_exists(path) ? hash_path(path) : std::string();
  }
  return hashes;
}

std::string joined(const std::map<std::string, std::string>& hashes) {
  std::string text;
  for (const auto& [role, hash] : hashes) text += role + "=" + hash + "\n";
  return hash_text(text);
}

std::string hash_of_report(const fs::path& folder) {
  const fs::path html = report_file(folder, ".html");
  std::error_code ec;
  return fs::is_regular_file(html, ec) ? hash_text(html_without_signature(read_text(html))) : std::string();
}

std::string today() {
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  localtime_r(&now, &local);
  char text[16];
  std::strftime(text, sizeof text, "%Y-%m-%d", &local);
  return text;
}

void require_text(const std::string& what, const std::string& text, std::size_t longest) {
  if (text.size() > longest) throw Error(ExitCode::usage, what + ": at most " + std::to_string(longest) + " bytes");
  for (const char c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
      throw Error(ExitCode::usage, what + ": one line of text, without control characters");
  }
}

}  // namespace

std::string ApprovalNow::words() const {
  if (state == ApprovalState::none) return tr("not approved");
  const std::string who = approval ? filled(tr("approved by {who} on {date}"),
                                            {{"who", approval->by}, {"date", shown_date(approval->date)}})
                                   : std::string(tr("approved"));
  return state == ApprovalState::valid ? who
                                       : filled(tr("{approval}, before the last change ({changed}): no longer valid"),
                                                {{"approval", who}, {"changed", changed}});
}

fs::path report_file(const fs::path& case_folder, const std::string& suffix) {
  fs::path whole = fs::absolute(case_folder).lexically_normal();
  if (!whole.has_filename()) whole = whole.parent_path();
  return whole.parent_path() / (whole.filename().string() + ".report" + suffix);
}

std::string case_hash(const fs::path& folder) {
  return joined(contents(folder));
}

ApprovalNow approval_of(const fs::path& folder) {
  ApprovalNow now;
  const auto is = contents(folder);
  const fs::path file = record_of(folder);
  if (!output_exists(file)) return now;
  Approval a;
  try {
    const JsonFile j(read_text(file), file.string(), ExitCode::corrupt);
    j.require_format("osteotome_approval");
    const auto text = [&](const char* key) {
      return j.text(j.need(j.root(), "", key), std::string("\"") + key + "\"");
    };
    a = {text("by"), text("date"), text("note"), text("case_hash"), text("report_hash")};
    now.approval = a;
    if (joined(is) != a.case_hash) {
      // Which of them: the record holds each file's own hash as well.
      const JsonValue& files = j.need(j.root(), "", "files");
      for (const auto& [role, hash] : is) {
        const JsonValue* const was = files.find(role);
        if (was == nullptr || was->text != hash) now.changed += (now.changed.empty() ? "" : ", ") + role;
      }
      if (now.changed.empty()) now.changed = "a file that is gone";
    } else if (const std::string report = hash_of_report(folder); !report.empty() && report != a.report_hash) {
      now.changed = "the report";
    }
  } catch (const Error&) {
    now.changed = "the approval itself, which is damaged";
  }
  now.state = now.changed.empty() ? ApprovalState::valid : ApprovalState::outdated;
  return now;
}

void approve(const fs::path& folder, const std::string& by, const std::string& note) {
  if (by.empty()) throw Error(ExitCode::usage, "who approves it? --by NAME");
  require_text("--by", by, kLongestName);
  require_text("--note", note, kLongestNote);
  const auto is = contents(folder);
  const std::string report = hash_of_report(folder);
  if (report.empty()) {
    throw Error(ExitCode::no_input, "'" + folder.string() + "' has no report beside it to look at and approve",
                "make it with: osteo report " + folder.string());
  }
  const Json j{
      {"osteotome_approval", 1}, {"by", by},         {"date", today()}, {"note", note}, {"case_hash", joined(is)},
      {"report_hash", report},   {"files", Json(is)}};
  write_file(record_of(folder), j.dump(2) + "\n");
}

bool withdraw_approval(const fs::path& folder) {
  static_cast<void>(contents(folder));
  std::error_code ec;
  const bool was = fs::remove(record_of(folder), ec);
  if (ec) throw Error(ExitCode::cannot_write, "cannot remove '" + record_of(folder).string() + "': " + ec.message());
  return was;
}

void require_approval(const ApprovalNow& now, const fs::path& folder) {
  if (now.state == ApprovalState::valid) return;
  throw Error(ExitCode::failed, "'" + folder.string() + "': " + now.words() + ", and --require-approved was given",
              "look at its report, then: osteo approve " + shell_path(folder) + " --by NAME");
}

Json approval_json(const ApprovalNow& now) {
  constexpr const char* kStates[] = {"none", "valid", "outdated"};
  Json j{{"state", kStates[static_cast<int>(now.state)]}};
  if (now.approval) {
    j["by"] = now.approval->by;
    j["date"] = now.approval->date;
    j["note"] = now.approval->note;
  }
  if (!now.changed.empty()) j["changed"] = now.changed;
  return j;
}

}  // namespace osteo::inline session
