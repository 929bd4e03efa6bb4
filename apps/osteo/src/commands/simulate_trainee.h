// osteo simulate-trainee
#pragma once
#include <array>
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo {

struct SimulateTraineeCommand {
  struct Params {
    std::string out;
    std::string skill = "expert";
    std::string procedure;
    bool mirror = false;
    double minutes = 3;
    std::array<double, 3> approach{0, 0, 0};
    double window_mm = 4.5;
    bool goal = false;
  };
  static void describe(Params& p, auto& visit) {
    visit({"out", "folder of the session (empty: CASE/sessions/N; also -o)"}, p.out);
    visit({"skill",
           "expert or novice, then KEY=VALUE by commas, like 'novice, undercut=0.8'; what is not named is an expert's"},
          p.skill);
    visit({"procedure", "what is to be done, by name (mastoidectomy, mastoid-window, mandible-split) or as JSON"},
          p.procedure);
    visit({"mirror",
           "the procedure is written for the other side of the body: its directions and curves turn about x = 0"},
          p.mirror);
    visit({"minutes", "then it stops, wherever it is", "min", 0.05, 60}, p.minutes);
    visit({"approach", "direction from the bone to the surgeon, LPS (0,0,0: as the procedure's items have it)", "",
           -1e4, 1e4},
          p.approach);
    visit({"goal", "drill the whole goal cavity of the procedure ('osteo goal-cavity') and not a window"}, p.goal);
    visit({"window_mm", "radius of what it opens, for the burr's middle", "mm", 1, 20}, p.window_mm);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
