// osteo track-pen
#pragma once
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo {

struct TrackPenCommand {
  struct Params {
    std::string camera = "camera.json";
    std::string pen;
    double seconds = 10;
  };
  static void describe(Params& p, auto& visit) {
    visit({"camera", "made by calibrate-camera"}, p.camera);
    visit({"pen", "made by calibrate-pen (empty: pen 1, its tip 100 mm below the middle of the prism)"}, p.pen);
    visit({"seconds", "how long to record from a camera", "s", 0.1, 86400}, p.seconds);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
