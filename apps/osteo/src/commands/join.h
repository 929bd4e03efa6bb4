// osteo join
#pragma once
#include <string>

#include "osteo/app/cli/command.h"
#include "window_flags.h"

namespace osteo {

struct JoinCommand {
  struct Params {
    std::string case_folder, code, hand = "simulated:250", out;
    Attend role = Attend::trainee;
    double stiffness_n_per_mm = 1, most_n = 3, patience_s = 10, wait_s = 60;
  };
  static void describe(Params& p, auto& visit) {
    visit(
        {"out", "folder for the session as it comes here: the host's, to the bit (empty: it is not recorded; also -o)"},
        p.out);
    visit({"case_folder", "the same case as the host's"}, p.case_folder);
    visit({"code", "code that the host shows (empty: asked for)"}, p.code);
    visit({"role", "trainee: the second hand; watcher: a copy of the bone, and no hand"}, p.role);
    visit({"hand", "trainee: simulated:STIFFNESS, in N/m; it has no will of its own"}, p.hand);
    visit({"stiffness_n_per_mm", "stiffness of the spring to the instructor's hand, lowered where the delay demands it",
           "N/mm", 0, 10},
          p.stiffness_n_per_mm);
    visit({"max_force_n", "maximum force of the spring to the instructor's hand", "N", 0, 20}, p.most_n);
    visit({"wait_s", "maximum time to wait for the host's answer", "s", 0, 3600}, p.wait_s);
    visit({"silence_s",
           "the session counts as over when nothing was heard of the host for so long; else when the host says so", "s",
           0.5, 600},
          p.patience_s);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
