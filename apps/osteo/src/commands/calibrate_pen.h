// osteo calibrate-pen
#pragma once
#include <string>

#include "osteo/app/cli/command.h"
#include "osteo/simulation/marker/body.h"

namespace osteo {

struct CalibratePenCommand {
  struct Params {
    std::string camera = "camera.json";
    std::string out = "pen.json";
    int pen = 1;
    double ruler_mm = 100;
    double seconds = 15;
  };
  static void describe(Params& p, auto& visit) {
    visit({"camera", "made by calibrate-camera"}, p.camera);
    visit({"out", "the pen as JSON (also -o)"}, p.out);
    visit({"pen", "which set of markers it carries", "", 1, PenBody::kMaxPens}, p.pen);
    visit({"ruler_mm", "how long the line of 100 mm on its page came out", "mm", 80, 120}, p.ruler_mm);
    visit({"seconds", "how long to record from a camera", "s", 1, 3600}, p.seconds);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
