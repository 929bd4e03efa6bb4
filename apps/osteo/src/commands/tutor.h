// osteo tutor
#pragma once
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo {

/// As what one joins.
struct TutorCommand {
  struct Params {
    std::string out, script, settings, resume;
    std::string listen = "127.0.0.1";
    int port = 0;
    bool two_way = false;
    double stiffness_n_per_mm = 1, most_n = 3, wait_s = 60;
    int attend = 1;
  };
  static void describe(Params& p, auto& visit) {
    visit({"out", "folder for the session (empty: a new one in CASE/sessions; also -o)"}, p.out);
    visit({"script", "the instructor's strokes, as JSON"}, p.script);
    visit({"settings", "how it feels, as JSON (empty: haptics.json of the case where there is one)"}, p.settings);
    visit({"resume", "a session to go on from (empty: the case's bone); those who join are sent what it did"},
          p.resume);
    visit({"listen",
           "address of this machine to be heard on; 127.0.0.1 or ::1: by this machine alone, 0.0.0.0 or :: : by all "
           "that can reach it"},
          p.listen);
    visit({"port", "UDP; 0: any that is free", "", 0, 65535}, p.port);
    visit({"two_way", "the instructor's hand is pulled by the trainee's too"}, p.two_way);
    visit({"stiffness_n_per_mm",
           "stiffness of the spring to the trainee's hand with --two-way, lowered where the delay demands it", "N/mm",
           0, 10},
          p.stiffness_n_per_mm);
    visit({"max_force_n", "maximum force of the spring to the trainee's hand with --two-way", "N", 0, 20}, p.most_n);
    visit({"min_trainees", "so many are to have joined, with their copies made, when the session begins", "", 0, 9},
          p.attend);
    visit({"wait_s", "maximum time to wait for participants; then it begins with those who are there", "s", 0, 3600},
          p.wait_s);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
