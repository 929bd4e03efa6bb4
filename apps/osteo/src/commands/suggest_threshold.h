// osteo suggest-threshold
#pragma once
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo {

struct SuggestThresholdCommand {
  struct Params {
    std::string series;
    double hu_offset = 0;
    std::string picture;
  };
  static void describe(Params& p, auto& visit) {
    visit({"series", "DICOM series to take, by number, UID, or scan like A1a or A1a:203 (empty: the recommended one)"},
          p.series);
    visit({"hu_offset", "added to all values, for a scan that leaves out its offset", "HU", -5000, 5000}, p.hu_offset);
    visit({"picture", "write the histogram with what was found in it, as .svg"}, p.picture);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
