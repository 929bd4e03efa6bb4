// Flags of the nerve monitor's console: declared once, for 'osteo nerve-console', which passes them on, and for
// osteo-console.
#pragma once
#include <string>

#include "osteo/core/base/param.h"

namespace osteo {

struct ConsoleFlags {
  using Params = ConsoleFlags;
  bool sound = true;
  int width = 1100;
  int height = 640;
  double scale = 0;
  std::string state_file, code;
  static void describe(ConsoleFlags& p, auto& visit) {
    visit({"sound",
           "the loudest channel, and a tone when activity begins, on the machine's sound card where there is one"},
          p.sound);
    visit({"code",
           "code shown by a rehearsal with --stream igtl:PORT/stimulator: the stimulator is set from here, by S and T "
           "and in the panel (empty: the console only listens)"},
          p.code);
    visit({"width", "width of the window, at most the screen's", "pixels", 480, 8192}, p.width);
    visit({"height", "height of the window, at most the screen's", "pixels", 320, 8192}, p.height);
    visit({"scale", "size of text and panels (0: by the monitor); Ctrl + and Ctrl - change it in the window", "", 0, 4},
          p.scale);
    visit(
        {"state_file", "what the window shows is written there as JSON after each picture, for tests (empty: nowhere)"},
        p.state_file);
  }
};

}  // namespace osteo
