#include "osteo/hospital/pacs/roles.h"

#include <grp.h>
#include <pwd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>

#include "osteo/core/base/json.h"

namespace osteo::inline hospital {
namespace {

constexpr const char* kRoles = "/etc/osteo/roles.json";
constexpr std::array kActions{"approve", "send"};

std::vector<fs::path> role_files() {
  std::vector<fs::path> files;
  std::error_code error;
  if (fs::exists(kRoles, error) || error) files.emplace_back(kRoles);  // what cannot be looked at is no leave
  if (const char* const given = std::getenv("OSTEO_ROLES"); given != nullptr && *given != '\0')
    files.emplace_back(given);
  return files;
}

bool in_group(gid_t group) {
  if (::getgid() == group) return true;
  std::vector<gid_t> all(static_cast<std::size_t>(std::max(0, ::getgroups(0, nullptr))));
  const int n = ::getgroups(static_cast<int>(all.size()), all.data());
  all.resize(static_cast<std::size_t>(std::max(0, n)));
  return std::ranges::find(all, group) != all.end();
}

bool known(const std::string& name) {
  return name.starts_with('@') ? ::getgrnam(name.c_str() + 1) != nullptr : ::getpwnam(name.c_str()) != nullptr;
}

}  // namespace

Roles read_roles(const fs::path& file) {
  require_readable(file);
  const JsonFile json(read_text(file), file.string());
  json.require_format("osteotome_roles");
  std::vector<std::string> keys{"osteotome_roles"};
  keys.insert(keys.end(), kActions.begin(), kActions.end());
  json.allow(json.root(), "", keys);
  Roles roles;
  for (const char* const action : kActions) {
    const JsonValue* const list = json.root().find(action);
    if (list == nullptr) continue;
    std::vector<std::string>& names = roles[action];
    for (const JsonValue& v : json.list(*list, action)) {
      names.push_back(json.text(v, action));
      if (names.back().empty() || names.back() == "@")
        throw json.wrong(v, std::string(action) + ": an empty name", "a user, or @GROUP");
    }
    if (names.empty())
      throw json.wrong(*list, std::string(action) + ": nobody could",
                       "leave it out, and anybody may; or name somebody");
  }
  return roles;
}

bool may(const Roles& roles, std::string_view what) {
  const auto found = roles.find(what);
  if (found == roles.end()) return true;
  return std::ranges::any_of(found->second, [](const std::string& name) {
    if (name.starts_with('@')) {
      const group* const g = ::getgrnam(name.c_str() + 1);
      return g != nullptr && in_group(g->gr_gid);
    }
    const passwd* const who = ::getpwnam(name.c_str());
    return who != nullptr && who->pw_uid == ::getuid();
  });
}

void require_role(std::string_view what, const AuditTrail& trail, const Context& context) {
  for (const fs::path& file : role_files()) {
    if (may(read_roles(file), what)) continue;
    AuditEvent event;
    event.kind = AuditEvent::Kind::rejected;
    event.good = false;
    event.action = what;
    trail.notify(event, context);
    throw Error(ExitCode::failed, "you may not " + std::string(what) + " here, by '" + file.string() + "'",
                "who administers this machine names who may");
  }
}

ServerFinding check_roles() {
  using State = ServerFinding::State;
  try {
    const std::vector<fs::path> files = role_files();
    if (files.empty())
      return {"roles", State::none, std::string("anybody may approve and send: there is no ") + kRoles,
              "docs/how-to/pacs.md says how they are set"};
    std::string unknown;
    for (const fs::path& file : files)
      for (const auto& [what, names] : read_roles(file))
        for (const std::string& name : names)
          if (!known(name)) unknown += (unknown.empty() ? "" : ", ") + name;
    if (!unknown.empty())
      return {"roles", State::bad, "this machine does not know " + unknown, "mend the names, or make these groups"};
    return {"roles", State::good, "all users and groups are known", {}};
  } catch (const Error& e) {
    return bad_finding("roles", e);
  }
}

}  // namespace osteo::inline hospital
