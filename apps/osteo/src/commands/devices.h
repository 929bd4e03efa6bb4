// osteo devices
#pragma once
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo {

struct DevicesCommand {
  struct Params {
    double watch = 0;
    std::string recording;
  };
  static void describe(Params& p, auto& visit) {
    visit({"watch", "print what the devices report for this long", "s", 0, 3600}, p.watch);
    visit({"recording", "instead: decode a recording made with hid-recorder"}, p.recording);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
