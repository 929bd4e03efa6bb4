// osteo list
#pragma once
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo {

struct ListCommand {
  struct Params {};
  static void describe(Params&, auto&) {}
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
