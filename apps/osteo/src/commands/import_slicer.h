// osteo import-slicer
#pragma once
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo {

struct ImportSlicerCommand {
  struct Params {
    std::string source;
    bool match_by_position = false;
    bool check = false;
  };
  static void describe(Params& p, auto& visit) {
    visit({"source", "the scan of the case, where it is not known on this machine"}, p.source);
    visit({"match_by_position", "take segments that bear no mark of the scan, when most of the bone lies where it was"},
          p.match_by_position);
    visit({"check", "say what changed, and leave the case as it is"}, p.check);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
