// osteo stream
#pragma once
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo {

struct StreamCommand {
  struct Params {
    std::string to, setup;
    double speed = 1;
    int listeners = 1;
    double wait_s = 60;
    std::string case_folder;
  };
  static void describe(Params& p, auto& visit) {
    visit({"to",
           "where to: igtl:PORT, igtl:HOST:PORT (to listen on), cerebus:HOST:PORT/VERSION (3.11, 4.0, 4.1 or 4.2), "
           "lsl; several with "
           "commas between"},
          p.to);
    visit(
        {"setup", "setup of the nerve monitor, as JSON (empty: as the session was recorded with, or the built-in one)"},
        p.setup);
    visit({"speed", "times real time", "", 0.05, 20}, p.speed);
    visit({"listeners", "listeners to wait for before it begins (0: none); Cerebus packets have none", "", 0, 8},
          p.listeners);
    visit({"wait_s", "maximum time to wait for listeners", "s", 1, 86400}, p.wait_s);
    visit({"case_folder", "where the case is now, when it was moved"}, p.case_folder);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
