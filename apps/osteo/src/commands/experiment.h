// osteo experiment
#pragma once
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo {

struct ExperimentCommand {
  struct Params {
    std::string out;
    int targets = 200;
    double noise = 0.1;
    double crosstalk = 0.15;
    double reaction_s = 0.25;
    std::string participant, people, device = "mouse", state_file;
    int trials = 72;
    bool headless = false, simulated = false, retention = false, null = false, chain = false;
    int experiments = 1000;
    double level = 0.95;
  };
  static void describe(Params& p, auto& visit) {
    visit({"out", "camera: every view and its time, as CSV (empty: only the table); demo: its folder (also -o)"},
          p.out);
    visit({"targets", "views to bring the camera to", "", 1, 10000}, p.targets);
    visit({"noise", "standard deviation of a move's end, of its length", "", 0, 0.5}, p.noise);
    visit({"crosstalk", "six degrees and rates: what an axis that was not meant gets of the others", "", 0, 1},
          p.crosstalk);
    visit({"reaction_s", "a look before each move", "s", 0, 2}, p.reaction_s);
    visit({"participant", "force-skill: whose trials, by code"}, p.participant);
    visit({"people", "codes of a new experiment's participants, as 'P01, P02' (empty: twelve)"}, p.people);
    visit({"trials", "trials of each participant in a new experiment, a multiple of 9", "", 9, 999}, p.trials);
    visit({"device", "force-skill: what the hand holds: mouse, keys, woodenhaptics or spacemouse"}, p.device);
    visit({"headless", "force-skill: without a window"}, p.headless);
    visit({"simulated", "force-skill: a program takes part, and everything says so"}, p.simulated);
    visit({"retention", "force-skill: on another day: every stimulus once, without aid"}, p.retention);
    visit({"null", "programs that learn equally well by each training"}, p.null);
    visit({"experiments", "null: how many", "", 10, 100000}, p.experiments);
    visit({"chain",
           "null: small experiments by programs, run and scored, instead of drawn scores; 0.3 s of one core each"},
          p.chain);
    visit({"level", "level of confidence intervals", "", 0.5, 0.999}, p.level);
    visit({"state_file", "force-skill: the window writes here what it shows, for tests"}, p.state_file);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
