// osteo markers
#pragma once
#include <string>

#include "osteo/app/cli/command.h"
#include "osteo/simulation/marker/body.h"
#include "osteo/simulation/marker/sheet.h"

namespace osteo {

/// Markers are printed, camera and pen calibrated.
struct MarkersCommand {
  struct Params {
    Paper paper = Paper::a4;
    int pen = 1;
    int page = 1;
  };
  static void describe(Params& p, auto& visit) {
    visit({"paper", "a4 or letter"}, p.paper);
    visit({"pen", "which set of markers: another for each pen that one camera sees", "", 1, PenBody::kMaxPens}, p.pen);
    visit({"page", "page of the sheet in a .png: 1 for the pen, 2 for the plate", "", 1, kMarkerPages}, p.page);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
