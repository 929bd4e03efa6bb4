// osteo console
#pragma once
#include <string>

#include "osteo/app/cli/command.h"
#include "console_flags.h"

namespace osteo {

struct ConsoleCommand {
  using Params = ConsoleFlags;
  static void describe(Params& p, auto& visit) { ConsoleFlags::describe(p, visit); }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
