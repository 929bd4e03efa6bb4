// osteo demo
#pragma once
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo {

struct DemoCommand {
  struct Params {
    std::string out = "out/demo";
    double seconds = 10;
    std::string axes;
  };
  static void describe(Params& p, auto& visit) {
    visit({"out", "folder for everything that is made"}, p.out);
    visit({"seconds", "seconds of drilling on a CT of your own", "s", 1, 3600}, p.seconds);
    visit({"axes", "where the index axes point, for files that do not know: three letters like LPI"}, p.axes);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
