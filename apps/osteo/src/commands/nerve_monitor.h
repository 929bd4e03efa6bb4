// osteo nerve-monitor
#pragma once
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo {

struct NerveMonitorCommand {
  struct Params {
    std::string out, setup, channel;
    double stimulator_ma = 0, pulses_per_s = 4, width_ms = 0.1;
    bool search = false;
    int hand = 0;
    bool heat = true;
    std::string case_folder;
  };
  static void describe(Params& p, auto& visit) {
    visit({"out", "folder for what it writes (also -o)"}, p.out);
    visit({"setup", "constants and channels, as JSON (empty: as the session was recorded with, or the built-in ones)"},
          p.setup);
    visit({"channel", "channel that is written to channel.wav (empty: the first); 1 mV is full scale"}, p.channel);
    visit({"stimulator_ma", "what if: a tool's tip stimulates all the time it touches (0: as the session has it)", "mA",
           0, 5},
          p.stimulator_ma);
    visit({"pulses_per_s", "pulses of the stimulator a second", "1/s", 1, 30}, p.pulses_per_s);
    visit({"width_ms", "width of the stimulator's pulses", "ms", 0.05, 1}, p.width_ms);
    visit({"search", "search for the stimulation threshold once, from --stimulator-ma on"}, p.search);
    visit({"hand", "whose tool", "", 0, 3}, p.hand);
    visit({"heat", "nerves feel the heat of burrs"}, p.heat);
    visit({"case_folder", "where the case is now, when it was moved"}, p.case_folder);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
