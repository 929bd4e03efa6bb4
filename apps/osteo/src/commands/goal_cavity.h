// osteo goal-cavity
#pragma once
#include <array>
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo {

struct GoalCavityCommand {
  struct Params {
    std::string out;
    std::string procedure;
    bool mirror = false;
    std::string session;
    double burr_mm = 4;
    std::array<double, 3> approach{0, 0, 0};
  };
  static void describe(Params& p, auto& visit) {
    visit({"out", "label map of the cavity, .nrrd or .seg.nrrd (empty: none is written; also -o)"}, p.out);
    visit({"procedure", "what is to be done, by name (mastoidectomy, mastoid-window, mandible-split) or as JSON"},
          p.procedure);
    visit({"mirror",
           "the procedure is written for the other side of the body: its directions and curves turn about x = 0"},
          p.mirror);
    visit({"session", "session on this case whose removed bone is compared with the goal (empty: none)"}, p.session);
    visit({"burr_mm", "diameter of the smallest burr, which is to reach everywhere", "mm", 1, 8}, p.burr_mm);
    visit({"approach", "direction from the bone to the surgeon, LPS (0,0,0: the best near what the procedure names)",
           "", -1e4, 1e4},
          p.approach);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
