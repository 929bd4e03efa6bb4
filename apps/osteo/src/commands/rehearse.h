// osteo rehearse
#pragma once
#include <string>

#include "osteo/app/cli/command.h"
#include "osteo/imaging/segment/ear.h"
#include "window_flags.h"

namespace osteo {

struct RehearseCommand {
  struct Params : WindowFlags {
    bool headless = false;
    std::string script;
    bool show_settings = false;
    Side side = Side::left;
    double seconds = 60;
    bool fast = false;
    bool pieces = false;
  };
  static void describe(Params& p, auto& visit) {
    visit({"headless", "run without a window: a scripted hand moves the drill in the same servo"}, p.headless);
    visit({"script", "strokes of the scripted hand as JSON (empty: a cavity on one side of any head)"}, p.script);
    WindowFlags::describe(p, visit);
    visit({"show_settings", "print the settings that would be used, as a file to start from, and stop"},
          p.show_settings);
    visit({"side", "side of the patient for the built-in strokes"}, p.side);
    visit({"seconds", "length of the built-in strokes", "s", 1, 3600}, p.seconds);
    visit({"fast", "run as fast as possible instead of in real time; the result is the same"}, p.fast);
    visit({"fragments", "watch for separate fragments; the summary lists them (the window always does)"}, p.pieces);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
