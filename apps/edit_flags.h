// Flags of the editor's window: declared once, for 'osteo edit', which passes them on, and for osteo-edit.
#pragma once
#include <string>

#include "osteo/core/base/param.h"

namespace osteo {

struct EditFlags {
  using Params = EditFlags;
  std::string scan;
  int width = 1360;
  int height = 860;
  double scale = 0;
  std::string state_file;
  static void describe(EditFlags& p, auto& visit) {
    visit({"scan", "the scan that the case was made from (empty: where it was seen last on this machine)"}, p.scan);
    visit({"width", "width of the window", "pixels", 640, 16384}, p.width);
    visit({"height", "height of the window", "pixels", 480, 16384}, p.height);
    visit({"scale", "size of text and panels (0: by the monitor)", "", 0, 4}, p.scale);
    visit({"state_file", "what the window shows is written there as JSON after each picture, for tests"}, p.state_file);
  }
};

}  // namespace osteo
