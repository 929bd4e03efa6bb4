// osteo ground-truth
#pragma once
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo {

struct GroundTruthCommand {
  struct Params {
    std::string out, program, experiment, bone, trajectory, surface;
    std::string columns = "t x y z fx fy fz";
    double stiffness_n_per_mm = 0.5, share = 1;
  };
  static void describe(Params& p, auto& visit) {
    visit({"out", "folder for tables, leaderboard and trajectories (also -o)"}, p.out);
    visit(
        {"program",
         "command of a renderer to measure beside ours: positions come by its standard input, forces go by its output"},
        p.program);
    visit({"experiment",
           "solids, renderers and friction as JSON, as in pipelines/ground-truth (empty: all that is built in)"},
          p.experiment);
    visit({"bone", "closed surface of a bone to add to the solids (.ply, .stl, ...; empty: none)"}, p.bone);
    visit({"trajectory", "a recorded out-trajectory with its forces to play instead, as text (needs --surface)"},
          p.trajectory);
    visit({"surface", "closed surface of what was probed, in the trajectory's own coordinates, mm"}, p.surface);
    visit({"columns", "columns of the trajectory in their order: t (s), x, y, z (mm), fx, fy, fz (N); '-' skips one"},
          p.columns);
    visit({"stiffness_n_per_mm", "stiffness of the spring by which recorded forces are read", "N/mm", 0.01, 100},
          p.stiffness_n_per_mm);
    visit({"share", "share of each trajectory that is used: less is quicker and shows less", "", 0.02, 10}, p.share);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
