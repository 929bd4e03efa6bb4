// osteo replay
#pragma once
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo {

struct ReplayCommand {
  struct Params {
    std::string case_folder;
    std::string surface_out;
    std::string bone_out;
  };
  static void describe(Params& p, auto& visit) {
    visit({"case_folder", "the case, when it was moved since (empty: where the session says)"}, p.case_folder);
    visit({"surface_out", "also write the surface at the end of the session (.ply, .stl, ...)"}, p.surface_out);
    visit({"bone_out",
           "also write the bone at the end of the session (.vdb); of bone in fragments the first, where it was cut"},
          p.bone_out);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
