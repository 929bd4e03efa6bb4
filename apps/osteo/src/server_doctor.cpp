#include "server_doctor.h"

#include <algorithm>
#include <iomanip>
#include <ostream>

#include "osteo/core/base/error.h"
#include "osteo/core/base/json_document.h"
#include "osteo/hospital/pacs/audit.h"
#include "osteo/hospital/pacs/roles.h"
#include "osteo/hospital/pacs/server.h"

namespace osteo {
namespace {

template <class T>
std::vector<T> listed(const std::string& text) {
  std::vector<T> all;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t comma = std::min(text.find(',', at), text.size());
    all.emplace_back(text.substr(at, comma - at));
    at = comma + 1;
  }
  return all;
}

}  // namespace

int doctor_of_server(const DoctorCommand::Params& p, cli::Invocation& io) {
  using State = ServerFinding::State;
  ServerSetup s;
  s.inbox = p.inbox;
  s.cases = p.cases;
  s.keep_free_gb = p.keep_free_gb;
  s.ae = p.ae;
  s.bind = p.bind;
  s.port = p.port;
  s.allowed = listed<std::string>(p.allow);
  s.tls = p.tls();
  s.logins = listed<fs::path>(p.login);
  s.metrics = listed<fs::path>(p.metrics);
  s.jobs = p.jobs;
  s.memory_mb = p.memory_mb;
  std::vector<ServerFinding> found = check_server(s);
  found.push_back(check_audit());
  found.push_back(check_roles());
  if (!p.rules.empty()) {
    try {
      const std::size_t n = checked_rules(p.rules).size();
      found.push_back(
          {"rules",
           State::good,
           "'" + p.rules + "': " + std::to_string(n) + (n == 1 ? " rule" : " rules") + ", and each can be carried out",
           {}});
    } catch (const Error& e) {
      found.push_back(bad_finding("rules", e));
    }
  }
  if (!p.no_report) {
    const std::string opengl = opengl_here();
    found.push_back(
        opengl.empty()
            ? ServerFinding{"pictures", State::bad, "nothing draws on this machine",
                            "install libegl1 and libgl1-mesa-dri; or --no-report, and no pictures in pipelines"}
            : ServerFinding{"pictures", State::good, opengl, {}});
  }
  io.end_progress();
  const bool good = std::ranges::none_of(found, [](const ServerFinding& f) { return f.state == State::bad; });
  Json checks = Json::list(), advice = Json::list();
  for (const ServerFinding& f : found) {
    checks.push_back(
        {{"what", f.what}, {"state", std::string(state_name(f.state))}, {"says", f.says}, {"advice", f.advice}});
    if (!f.advice.empty() && f.state != State::none) advice.push_back(f.what + ": " + f.advice);
    if (!io.common.json)
      io.out << std::left << std::setw(4) << state_name(f.state) << "  " << f.what << ": " << f.says
             << (f.advice.empty() ? "" : " -> " + f.advice) << '\n';
  }
  if (io.common.json)
    io.out << Json{{"server", true}, {"good", good}, {"checks", checks}, {"advice", advice}}.dump(2) << '\n';
  return static_cast<int>(good ? ExitCode::ok : ExitCode::failed);
}

}  // namespace osteo
