// osteo playback
#pragma once
#include <string>

#include "osteo/app/cli/command.h"
#include "osteo/network/tutor/playback_params.h"
#include "window_flags.h"

namespace osteo {

struct PlaybackCommand {
  struct Params : PlaybackParams {
    std::string out;
    bool headless = false;
    std::string hand = "simulated:250";
    double from_s = 0, to_s = 0;
    std::string experts;
    Hand device = Hand::automatic;
    std::string case_folder;
    std::string state_file;
  };
  static void describe(Params& p, auto& visit) {
    visit({"out", "folder for the guided session (empty: a new one in CASE/sessions; also -o)"}, p.out);
    PlaybackParams::describe(p, visit);
    visit({"from_s", "start of the lesson in the session, with the bone of that time", "s", 0, 1e6}, p.from_s);
    visit({"to_s", "and where it ends (0: with the session)", "s", 0, 1e6}, p.to_s);
    visit({"experts",
           "fading, amplify: more sessions of the same step, by commas; three quarters of the distances between their "
           "ways and the lesson's "
           "are the dead zone"},
          p.experts);
    visit({"headless", "run without a window, as fast as possible: a simulated hand is guided"}, p.headless);
    visit({"hand", "headless: simulated:STIFFNESS, in N/m (100 to 500 is a grip); it has no will of its own"}, p.hand);
    visit({"device", "device that moves the drill, as in 'rehearse'"}, p.device);
    visit({"case_folder", "the case, when it was moved since (empty: where the session says)"}, p.case_folder);
    visit({"state_file", "file to which the window writes its state as JSON after each picture, for tests"},
          p.state_file);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

/// "simulated:250", in N/m. Error(usage).
[[nodiscard]] double simulated_stiffness(const std::string& hand);

}  // namespace osteo
