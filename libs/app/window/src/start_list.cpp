#include "start_list.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

#include "osteo/core/base/error.h"
#include "osteo/core/base/json_document.h"
#include "osteo/core/base/translate.h"
#include "osteo/session/scene/session_folder.h"

namespace osteo::inline app {
namespace {

namespace fs = std::filesystem;

// 10 after 9, and names after numbers.
bool before_in_order(const fs::path& a, const fs::path& b) {
  const std::string x = a.filename().string(), y = b.filename().string();
  const auto number = [](const std::string& s) {
    return !s.empty() && s.size() < 10 && s.find_first_not_of("0123456789") == std::string::npos;
  };
  if (number(x) && number(y)) return std::stol(x) < std::stol(y);
  if (number(x) != number(y)) return number(x);
  return x < y;
}

std::string name_of(const fs::path& folder) {
  const fs::path name = folder.filename();
  return name.empty() ? folder.string() : name.string();
}

// By the first files in it: slices lie in one folder, and what else is there is not many.
bool holds_dicom(const fs::path& folder) {
  constexpr int kLookedAt = 4, kPassed = 40;
  std::error_code failed;
  int seen = 0, passed = 0;
  for (fs::directory_iterator at(folder, fs::directory_options::skip_permission_denied, failed), end;
       !failed && at != end && seen < kLookedAt && passed < kPassed; at.increment(failed), ++passed) {
    std::error_code unknown;
    if (!at->is_regular_file(unknown)) continue;
    ++seen;
    std::array<char, 132> first{};
    std::ifstream(at->path(), std::ios::binary).read(first.data(), first.size());
    if (std::string_view(first.data() + 128, 4) == "DICM") return true;
  }
  return false;
}

// By what is in its files, as far as a picture may take: names alone are those of other plans and data sets too.
// Whether it can be used is said where it is.
bool is_network(const fs::path& folder) {
  constexpr std::uintmax_t kMaxBytes = 4 << 20;
  const auto json_of = [&](const char* name) -> std::optional<Json> {
    std::error_code failed;
    const std::uintmax_t bytes = fs::file_size(folder / name, failed);
    if (failed || bytes > kMaxBytes) return std::nullopt;
    std::ifstream in(folder / name, std::ios::binary);
    return Json::parse(std::string(std::istreambuf_iterator<char>(in), {}));
  };
  const auto has = [](const std::optional<Json>& json, const char* key) { return json && json->find(key) != nullptr; };
  std::error_code failed;
  if (fs::is_regular_file(folder / "network.json", failed)) return has(json_of("network.json"), "osteotome_network");
  if (!fs::is_regular_file(folder / "plans.json", failed) || !fs::is_regular_file(folder / "dataset.json", failed))
    return false;
  return has(json_of("plans.json"), "configurations") && has(json_of("dataset.json"), "labels");
}

bool can_be_looked_into(FolderKind kind) {
  return kind == FolderKind::folder || kind == FolderKind::scan || kind == FolderKind::network;
}

}  // namespace

FolderLook look_at_path(const fs::path& path) {
  std::error_code failed;
  const fs::file_status status = fs::status(path, failed);
  if (!fs::exists(status))
    return {FolderKind::nothing, path,
            filled(tr("'{path}' is not there, or may not be read"), {{"path", path.string()}})};
  if (!fs::is_directory(status)) {
    const fs::path name = path.filename();
    if (name == "manifest.json" || name == "session.json" || name == "stream.oss")
      return look_at_path(fs::absolute(path).parent_path());
    return {FolderKind::nothing, path,
            filled(tr("'{name}' is a file: a case is a folder, made from a scan by 'osteo prepare'"),
                   {{"name", name.string()}})};
  }
  const auto has = [&](const char* name) { return fs::is_regular_file(path / name, failed); };
  if (has("manifest.json")) return {FolderKind::the_case, path, {}};
  if (has("session.json")) return {FolderKind::session, path, {}};
  if (is_network(path)) return {FolderKind::network, path, {}};
  if (holds_dicom(path)) return {FolderKind::scan, path, {}};
  return {FolderKind::folder, path, {}};
}

std::vector<fs::path> sessions_of(const fs::path& the_case) {
  std::vector<fs::path> found;
  std::error_code failed;
  for (fs::directory_iterator at(the_case / "sessions", fs::directory_options::skip_permission_denied, failed), end;
       !failed && at != end; at.increment(failed)) {
    if (look_at_path(at->path()).kind == FolderKind::session) found.push_back(at->path());
  }
  std::sort(found.begin(), found.end(), before_in_order);
  std::reverse(found.begin(), found.end());
  return found;
}

StartList::StartList(std::vector<fs::path> recent, fs::path from, fs::path demo)
    : recent_(std::move(recent)), folder_(fs::absolute(from)), demo_(std::move(demo)) {
  list();
}

void StartList::list() {
  entries_.clear();
  using Group = StartEntry::Group;
  for (const fs::path& r : recent_) {
    const FolderLook look = look_at_path(r);
    const bool there = look.kind == FolderKind::the_case;
    entries_.push_back({Group::recent, there ? FolderKind::the_case : FolderKind::nothing, r,
                        (there ? name_of(r) : filled(tr("{name}  (no longer there)"), {{"name", name_of(r)}})) + "   " +
                            r.parent_path().string()});
  }
  if (!demo_.empty() && std::find(recent_.begin(), recent_.end(), demo_) == recent_.end()) {
    const bool there = look_at_path(demo_).kind == FolderKind::the_case;
    entries_.push_back({Group::recent, there ? FolderKind::the_case : FolderKind::demo, demo_, tr("demo ear")});
  }
  // Of the case opened last, or of the one that is looked into.
  const bool inside = look_at_path(folder_).kind == FolderKind::the_case;
  const fs::path of = inside ? folder_ : recent_.empty() ? fs::path() : recent_.front();
  if (!of.empty()) {
    for (const fs::path& s : sessions_of(of)) {
      if (std::count_if(entries_.begin(), entries_.end(),
                        [](const StartEntry& e) { return e.group == Group::session; }) == 5)
        break;
      entries_.push_back(
          {Group::session, FolderKind::session, s,
           filled(tr("go on from session {session} of {case}"), {{"session", name_of(s)}, {"case", name_of(of)}})});
    }
  }
  if (folder_.has_parent_path() && folder_ != folder_.root_path())
    entries_.push_back({Group::browse, FolderKind::folder, folder_.parent_path(), ".."});
  std::vector<fs::path> below;
  std::error_code failed;
  fs::directory_iterator at(folder_, fs::directory_options::skip_permission_denied, failed);
  if (failed) {
    message_ = filled(tr("'{path}' cannot be read: {why}"), {{"path", folder_.string()}, {"why", failed.message()}});
  } else {
    for (const fs::directory_iterator end; !failed && at != end; at.increment(failed)) {
      std::error_code unknown;
      if (at->is_directory(unknown) && !at->path().filename().string().starts_with(".")) below.push_back(at->path());
    }
  }
  std::sort(below.begin(), below.end(), before_in_order);
  if (below.size() > kMaxListed) {
    message_ = filled(tr("of {all} folders the first {n} are listed"),
                      {{"all", std::to_string(below.size())}, {"n", std::to_string(kMaxListed)}});
    below.resize(kMaxListed);
  }
  if (inside)
    entries_.push_back(
        {Group::browse, FolderKind::the_case, folder_, filled(tr("this case: {name}"), {{"name", name_of(folder_)}})});
  for (const fs::path& b : below) {
    const FolderKind kind = look_at_path(b).kind;
    const char* const what = kind == FolderKind::the_case  ? tr("case: {name}")
                             : kind == FolderKind::session ? tr("session: {name}")
                             : kind == FolderKind::scan    ? tr("CT: {name}")
                             : kind == FolderKind::network ? tr("trained network: {name}")
                                                           : "{name}";
    entries_.push_back({Group::browse, kind, b, filled(what, {{"name", name_of(b)}})});
  }
  selected_ = 0;
}

void StartList::select(int entry) {
  if (entry >= 0 && entry < static_cast<int>(entries_.size())) selected_ = entry;
}

void StartList::move(int by) {
  if (!entries_.empty()) selected_ = std::clamp(selected_ + by, 0, static_cast<int>(entries_.size()) - 1);
}

void StartList::look_into(const fs::path& folder) {
  folder_ = folder;
  message_.clear();
  list();
  // To what is in it, not to the cases above.
  const auto at = std::find_if(entries_.begin(), entries_.end(),
                               [](const StartEntry& e) { return e.group == StartEntry::Group::browse; });
  if (at != entries_.end()) selected_ = static_cast<int>(at - entries_.begin());
}

void StartList::up() {
  if (folder_ != folder_.root_path()) look_into(folder_.parent_path());
}

std::optional<StartChoice> StartList::open() {
  if (selected_ >= static_cast<int>(entries_.size())) return std::nullopt;
  const StartEntry entry = entries_[static_cast<std::size_t>(selected_)];
  if (can_be_looked_into(entry.kind)) {
    look_into(entry.folder);
    return std::nullopt;
  }
  if (entry.kind == FolderKind::demo) {
    wants_demo_ = true;
    return std::nullopt;
  }
  return take_one(entry.folder);
}

void StartList::refresh(const fs::path& chosen) {
  const std::size_t at = static_cast<std::size_t>(selected_);
  const fs::path before = at < entries_.size() ? entries_[at].folder : fs::path();
  list();
  for (const fs::path& wanted : {chosen, before}) {
    const auto found =
        std::find_if(entries_.begin(), entries_.end(), [&](const auto& e) { return e.folder == wanted; });
    if (found != entries_.end()) return select(static_cast<int>(found - entries_.begin()));
  }
}

std::optional<StartChoice> choice_of(const fs::path& path, std::string& why) {
  const FolderLook look = look_at_path(path);
  if (look.kind == FolderKind::the_case) return StartChoice{look.folder, {}};
  if (look.kind == FolderKind::session) {
    try {
      return StartChoice{open_session_folder(look.folder).case_folder, look.folder};
    } catch (const Error& e) {
      why = e.what();
      return std::nullopt;
    }
  }
  why = look.kind == FolderKind::nothing
            ? look.why
            : filled(tr("'{name}' is no case: its folders are listed"), {{"name", name_of(look.folder)}});
  return std::nullopt;
}

std::optional<StartChoice> choice_of(const std::vector<fs::path>& paths, std::string& why) {
  why.clear();
  for (const fs::path& path : paths) {
    std::string other;
    const std::optional<StartChoice> choice = choice_of(path, other);
    if (choice) {
      why.clear();
      return choice;
    }
    if (why.empty()) why = other;
  }
  return std::nullopt;
}

std::optional<StartChoice> StartList::take(const std::vector<fs::path>& paths) {
  std::string why;
  if (const auto choice = choice_of(paths, why)) return choice;
  return paths.empty() ? std::nullopt : take_one(paths.front());
}

std::optional<StartChoice> StartList::take_one(const fs::path& path) {
  std::string why;
  const std::optional<StartChoice> choice = choice_of(path, why);
  if (choice) return choice;
  const FolderLook look = look_at_path(path);
  if (can_be_looked_into(look.kind)) look_into(fs::absolute(look.folder));
  message_ = why;
  return std::nullopt;
}

void StartList::forget_recent() {
  recent_.clear();
  list();
}

}  // namespace osteo::inline app
