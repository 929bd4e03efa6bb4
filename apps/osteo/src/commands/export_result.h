// osteo export-result
#pragma once
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo {

struct ExportResultCommand {
  struct Params {
    std::string out;
    std::string case_folder;
    double at_s = -1;
  };
  static void describe(Params& p, auto& visit) {
    visit({"out", "folder for the plan (empty: SESSION/plan; also -o)"}, p.out);
    visit({"case_folder", "the case, when it was moved since (empty: where the session says)"}, p.case_folder);
    visit({"at_s", "how it was at this time of the session, exact to a tenth of a second (-1: at its end)", "s", -1,
           86400},
          p.at_s);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
