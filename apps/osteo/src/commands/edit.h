// osteo edit
#pragma once
#include <string>

#include "edit_flags.h"
#include "osteo/app/cli/command.h"

namespace osteo {

struct EditCommand {
  struct Params : EditFlags {
    std::string apply;
  };
  static void describe(Params& p, auto& visit) {
    visit({"apply", "apply the corrections of this file (edits.json) to the case again, without a window"}, p.apply);
    EditFlags::describe(p, visit);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
