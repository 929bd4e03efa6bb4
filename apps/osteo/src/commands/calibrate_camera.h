// osteo calibrate-camera
#pragma once
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo {

struct CalibrateCameraCommand {
  struct Params {
    std::string out = "camera.json";
    double seconds = 60;
    int width = 1280;
    int height = 720;
    double fps = 30;
    double latency_ms = -1;
  };
  static void describe(Params& p, auto& visit) {
    visit({"out", "the camera as JSON (also -o)"}, p.out);
    visit({"seconds", "how long to record from a camera", "s", 1, 3600}, p.seconds);
    visit({"width", "asked of a camera; files have their own", "pixels", 160, 8192}, p.width);
    visit({"height", "asked of a camera; files have their own", "pixels", 120, 8192}, p.height);
    visit({"fps", "pictures a second that it is asked for, here and later", "Hz", 1, 240}, p.fps);
    visit({"latency_ms",
           "camera latency, from the middle of an exposure until the picture is here (-1: not known, one period is "
           "taken)",
           "ms", -1, 500},
          p.latency_ms);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
