// A server that is spoken to by HTTP, and the login for it.
#pragma once
#include <string>

#include "osteo/core/base/files.h"

namespace osteo::inline hospital {

struct WebServer {
  std::string url;        ///< http:// or https://, without user, query and fragment; what is asked for is put behind it
  std::string login;      ///< USER:PASSWORD; empty: none is asked for. Never told.
  fs::path ca;            ///< certificates that are trusted (PEM); empty: those of the system
  double timeout_s = 30;  ///< for the connection, and for less than 1000 bytes a second
  std::string flag = "--url";  ///< by which a person names it: errors say it, and that with -login behind it
};

/// The address as it is told: without slashes at its end.
[[nodiscard]] std::string web_text(const WebServer& server);

/// A login from a file that only its owner may read: one line, USER:PASSWORD. Errors: usage, no_input, cannot_read.
[[nodiscard]] std::string read_login(const fs::path& file);

}  // namespace osteo::inline hospital
