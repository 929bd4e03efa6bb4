// Whether a machine has what receive, watch and batch need, looked for by doing what they would do.
#pragma once
#include <string>
#include <vector>

#include "osteo/core/base/files.h"
#include "osteo/hospital/pacs/peer.h"

namespace osteo::inline hospital {

struct ServerFinding {
  enum class State {
    good,
    none,  ///< not there, and not needed unless one wants it
    care,  ///< works, but should be otherwise
    bad,   ///< what needs it will not work
  };
  std::string what;  ///< like "inbox" or "port"
  State state = State::good;
  std::string says;
  std::string advice;  ///< what to do; empty where all is well
};
/// That of an error, with something to do where the error says nothing.
[[nodiscard]] ServerFinding bad_finding(const std::string& what, const Error& error);
/// "good", "none", "care", "bad".
[[nodiscard]] std::string_view state_name(ServerFinding::State state);

/// What is named is looked at; empty: it is not.
struct ServerSetup {
  fs::path inbox, cases;  ///< folders of receive and watch
  double keep_free_gb = 1;
  std::string ae = "OSTEOTOME", bind = "127.0.0.1";
  int port = 11112;
  std::vector<std::string> allowed;  ///< titles that may send
  DicomTls tls;
  std::vector<fs::path> logins;   ///< files with USER:PASSWORD
  std::vector<fs::path> metrics;  ///< files for counters
  int jobs = 1;
  double memory_mb = 4000;  ///< that a case may have
};

/// Reads, and writes only a small file of its own into each folder, which it takes away again. Nothing that is wrong
/// throws: it is a finding. Rules and pictures are looked at by who can read the first and draw the second. Takes the
/// services' units as systemctl tells them, and speaks to no other machine.
[[nodiscard]] std::vector<ServerFinding> check_server(const ServerSetup& setup);

}  // namespace osteo::inline hospital
