// osteo export-slicer
#pragma once
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo {

struct ExportSlicerCommand {
  struct Params {
    std::string source;
  };
  static void describe(Params& p, auto& visit) {
    visit({"source", "the scan of the case, where it is not known on this machine"}, p.source);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
