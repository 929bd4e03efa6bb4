// Who may approve and send, where a server is shared.
#pragma once
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/base/files.h"
#include "osteo/hospital/pacs/audit.h"

namespace osteo::inline hospital {

/// What is done, and who may: names of users, and "@GROUP" for a group of the system. What is not named, anybody may.
using Roles = std::map<std::string, std::vector<std::string>, std::less<>>;

/// {"osteotome_roles": 1, "approve": ["@surgeons"], "send": ["@imaging", "anna"]}. A group or user that this machine
/// does not know lets nobody in. Errors: usage (also an empty list), no_input, cannot_read.
[[nodiscard]] Roles read_roles(const fs::path& file);

/// Whether the user that this process really is (and its groups) may.
[[nodiscard]] bool may(const Roles& roles, std::string_view what);

/// By /etc/osteo/roles.json where it is there, and by the file that OSTEO_ROLES names as well, which can only narrow.
/// Error(failed) for who may not, told to the audit trail as a use of a restricted function. Whoever may write into a
/// case's folder can do so without this program: folders have rights of their own.
void require_role(std::string_view what, const AuditTrail& trail, const Context& context);

/// A line of `doctor --server`: the files, and names in them that this machine does not know.
[[nodiscard]] ServerFinding check_roles();

}  // namespace osteo::inline hospital
