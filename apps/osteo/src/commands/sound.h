// osteo sound
#pragma once
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo {

struct SoundCommand {
  struct Params {
    double volume = 1;
    bool alarms = false;
    std::string case_folder;
  };
  static void describe(Params& p, auto& visit) {
    visit({"volume",
           "volume, as a share of the loudest that the model gives; long loud parts are held below the level that is "
           "safe with head-phones",
           "", 0, 1},
          p.volume);
    visit({"alarms", "beeps where a critical structure is touched, two tones where it is injured"}, p.alarms);
    visit({"case_folder", "where the case is now, when it was moved"}, p.case_folder);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
