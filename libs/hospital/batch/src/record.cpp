// Records of cases: as files, and from what a child has said.
#include "record.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json.h"
#include "osteo/core/base/param.h"

namespace osteo::inline hospital {
namespace {

constexpr std::array<std::string_view, 5> kStates{"waiting", "done", "refused", "failed", "resources"};
constexpr const char* kWithheld = "(name withheld)";

CaseState state_of(const ChildEnd& end) {
  if (end.over_time || end.over_memory || end.signal != 0) return CaseState::resources;
  switch (static_cast<ExitCode>(end.exit_code)) {
    case ExitCode::ok:
      return CaseState::done;
    case ExitCode::no_input:
    case ExitCode::corrupt:
    case ExitCode::cannot_read:
      return CaseState::refused;
    case ExitCode::resources:
      return CaseState::resources;
    case ExitCode::cancelled:
      return CaseState::waiting;
    default:
      return CaseState::failed;
  }
}

std::string text_of(const Json* value) {
  return value != nullptr && value->text() != nullptr ? *value->text() : std::string();
}

std::string whole(double value) {
  return format_number(std::round(value));
}

void read_verdict(const Json& verdict, CaseRecord& record) {
  record.verdict = text_of(verdict.find("status"));
  if (const Json* findings = verdict.find("findings")) {
    for (const Json& f : findings->items()) {
      const std::string code = text_of(f.find("code"));
      if (!code.empty() && std::find(record.findings.begin(), record.findings.end(), code) == record.findings.end())
        record.findings.push_back(code);
    }
  }
}

// Last line of what it wrote before it ended without a word on standard output.
std::string last_line(const std::string& text) {
  std::size_t to = text.size();
  while (to > 0 && (text[to - 1] == '\n' || text[to - 1] == ' ')) --to;
  const std::size_t from = text.rfind('\n', to == 0 ? 0 : to - 1);
  return text.substr(from == std::string::npos ? 0 : from + 1, to - (from == std::string::npos ? 0 : from + 1));
}

bool is_name_like(const std::string& quoted, const fs::path& source) {
  if (quoted.empty() || quoted.starts_with("--") || quoted.starts_with("osteo ")) return false;
  if (quoted.find_first_of("/\\.") != std::string::npos || quoted == source.filename() || quoted == source.string())
    return true;
  std::error_code ec;
  return fs::exists(source / quoted, ec) || ec;
}

}  // namespace

std::string_view state_name(CaseState state) {
  return kStates[static_cast<std::size_t>(state)];
}

std::string without_names(const std::string& text, const fs::path& source) {
  std::string plain = text;
  // The path wherever it stands, and what follows it up to a quotation mark, a blank or the end.
  for (const std::string& name : {source.string(), source.filename().string()}) {
    if (name.size() < 3) continue;
    for (std::size_t at = 0; (at = plain.find(name, at)) != std::string::npos;) {
      const auto is_any = [&](std::size_t i, const char* of) {
        return i < plain.size() && std::string_view(of).find(plain[i]) != std::string::npos;
      };
      // The last part alone may be a word like any other, unless it stands where names do.
      if (name[0] != '/' && !(at > 0 && is_any(at - 1, "/'\"") &&
                              (at + name.size() == plain.size() || is_any(at + name.size(), "/'\" ")))) {
        at += name.size();
        continue;
      }
      std::size_t end = at + name.size();
      if (end < plain.size() && plain[end] == '/') end = std::min(plain.find_first_of("'\"\n", end), plain.size());
      plain.replace(at, end - at, kWithheld);
      at += std::string_view(kWithheld).size();
    }
  }
  std::string out;
  for (std::size_t at = 0; at < plain.size();) {
    const std::size_t open = plain.find('\'', at);
    // An apostrophe inside a word opens nothing.
    const bool opens =
        open != std::string::npos && (open == 0 || std::isalnum(static_cast<unsigned char>(plain[open - 1])) == 0);
    const std::size_t close = opens ? plain.find('\'', open + 1) : std::string::npos;
    if (!opens || close == std::string::npos) {
      const std::size_t to = open == std::string::npos ? plain.size() : open + 1;
      out += plain.substr(at, to - at);
      at = to;
      continue;
    }
    const std::string quoted = plain.substr(open + 1, close - open - 1);
    out += plain.substr(at, open - at) + "'" + (is_name_like(quoted, source) ? kWithheld : quoted) + "'";
    at = close + 1;
  }
  return out;
}

Json CaseRecord::to_json() const {
  Json j{{"osteotome_batch_case", 1}, {"case", code},   {"key", key},         {"state", state_name(state)},
         {"exit_code", exit_code},    {"tries", tries}, {"seconds", seconds}, {"peak_memory_mb", peak_mb}};
  j["verdict"] = verdict;
  j["findings"] = Json(findings);
  j["bone_mm3"] = volume_mm3;
  j["triangles"] = triangles;
  j["why"] = why;
  j["advice"] = advice;
  j["program"] = program;
  return j;
}

CaseRecord CaseRecord::from_json(std::string_view text, const std::string& name) {
  const JsonFile file(text, name, ExitCode::corrupt);
  file.require_format("osteotome_batch_case");
  const JsonValue& root = file.root();
  const auto said = [&](const char* key) { return file.text(file.need(root, "", key), key); };
  const auto number = [&](const char* key) { return file.number(file.need(root, "", key), key); };
  CaseRecord r;
  r.code = said("case");
  r.key = said("key");
  const auto state = std::find(kStates.begin(), kStates.end(), said("state"));
  if (state == kStates.end()) throw file.wrong(file.need(root, "", "state"), "that is no state of a case");
  r.state = static_cast<CaseState>(state - kStates.begin());
  r.exit_code = static_cast<int>(number("exit_code"));
  r.tries = static_cast<int>(number("tries"));
  r.seconds = number("seconds");
  r.peak_mb = number("peak_memory_mb");
  r.verdict = said("verdict");
  for (const JsonValue& f : file.list(file.need(root, "", "findings"), "findings"))
    r.findings.push_back(file.text(f, "a finding"));
  r.volume_mm3 = number("bone_mm3");
  r.triangles = static_cast<std::int64_t>(number("triangles"));
  r.why = said("why");
  r.advice = said("advice");
  r.program = said("program");
  return r;
}

std::optional<CaseRecord> known_record(const fs::path& out, const std::string& code) {
  const fs::path file = record_file(out, code);
  std::error_code ec;
  if (!fs::is_regular_file(file, ec)) return std::nullopt;
  try {
    CaseRecord record = CaseRecord::from_json(read_text(file), file.string());
    if (record.code == code) return record;
  } catch (const Error&) {
    // Damaged, or no record: as if there were none.
  }
  return std::nullopt;
}

void count(const std::optional<CaseRecord>& record, BatchResult& result) {
  ++result.cases;
  switch (record ? record->state : CaseState::waiting) {
    case CaseState::waiting:
      ++result.waiting;
      break;
    case CaseState::done:
      ++result.done;
      break;
    case CaseState::refused:
      ++result.refused;
      break;
    case CaseState::failed:
      ++result.failed;
      break;
    case CaseState::resources:
      ++result.resources;
      break;
  }
}

CaseRecord record_of(const BatchCase& row, const std::string& key, const ChildEnd& end, int tries,
                     const ChildLimits& limits, const fs::path& folder) {
  CaseRecord r;
  r.code = row.code;
  r.key = key;
  r.state = state_of(end);
  r.exit_code = end.exit_code;
  r.tries = tries;
  r.seconds = std::round(end.seconds * 1000) / 1000;
  r.peak_mb = std::round(end.peak_mb);
  const Json said = Json::parse(end.out).value_or(Json());
  if (const Json* verdict = said.find("verdict")) read_verdict(*verdict, r);
  if (const Json* stages = said.find("stages")) {
    for (const Json& stage : stages->items()) {
      const Json* report = stage.find("report");
      if (report == nullptr) continue;
      const auto number = [&](const char* name) {
        return report->find(name) != nullptr ? report->find(name)->number() : std::nullopt;
      };
      if (const auto v = number("volume_after_mm3")) r.volume_mm3 = *v;
      if (const auto v = number("mask_volume_mm3"); v && r.volume_mm3 == 0) r.volume_mm3 = *v;
      if (const auto v = number("triangles")) r.triangles = static_cast<std::int64_t>(*v);
    }
  }
  if (r.state == CaseState::done) {
    std::error_code ec;
    if (const fs::path verdict = folder / "import.json"; fs::is_regular_file(verdict, ec))
      read_verdict(Json::parse(read_text(verdict)).value_or(Json()), r);
    return r;
  }
  if (const Json* error = said.find("error")) {
    r.why = without_names(text_of(error->find("message")), row.source);
    r.advice = without_names(text_of(error->find("advice")), row.source);
  }
  // A disk without room is no fault of the case. Some libraries do not say why a file came out short: then the advice
  // speaks of room.
  if (r.state == CaseState::failed && r.exit_code == static_cast<int>(ExitCode::cannot_write)) {
    for (const char* sign :
         {"No space left", "Disk quota exceeded", "File too large", "free some space", "the disk has room"})
      if (end.out.find(sign) != std::string::npos) r.state = CaseState::resources;
  }
  const std::string peak = " (at its highest " + whole(end.peak_mb) + " MB)";
  if (end.over_time) {
    r.why = "it was not done within " + format_number(limits.seconds / 60) + " min" + peak;
    r.advice = "--minutes gives it more time";
  } else if (end.over_memory || (end.exit_code == static_cast<int>(ExitCode::resources) && limits.memory_mb > 0)) {
    r.why = "it needs more than " + whole(limits.memory_mb) + " MB" + peak;
    r.advice = "--memory-mb gives it more, larger voxels or a smaller region need less";
  } else if (end.signal != 0) {
    r.why = "it was ended by signal " + std::to_string(end.signal) + peak;
    if (const std::string last = without_names(last_line(end.err), row.source); !last.empty()) r.why += ": " + last;
  } else if (r.why.empty()) {
    r.why = without_names(last_line(end.err), row.source);
  }
  return r;
}

}  // namespace osteo::inline hospital
