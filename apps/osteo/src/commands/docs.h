// osteo docs
#pragma once
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo {

struct DocsCommand {
  struct Params {
    bool check = false;
    bool shared = false;
  };
  static void describe(Params& p, auto& visit) {
    visit({"check", "compare instead of writing; fails when a page is stale"}, p.check);
    visit({"shared",
           "instead: man pages, completion of bash, zsh and fish, modules of 3D Slicer; what is there is replaced"},
          p.shared);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
