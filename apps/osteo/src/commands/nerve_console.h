// osteo nerve-console
#pragma once
#include <string>

#include "console_flags.h"
#include "osteo/app/cli/command.h"

namespace osteo {

struct NerveConsoleCommand {
  using Params = ConsoleFlags;
  static void describe(Params& p, auto& visit) { ConsoleFlags::describe(p, visit); }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
