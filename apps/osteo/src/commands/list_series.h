// osteo list-series
#pragma once
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo {

struct ListSeriesCommand {
  struct Params {
    bool studies = false;
    std::string thumbnails;
  };
  static void describe(Params& p, auto& visit) {
    visit({"studies", "also the date and description of each study, which can tell who the patient is"}, p.studies);
    visit({"thumbnails",
           "a folder for a picture of the middle slice of each series, named by scan and series; a face may be seen in "
           "them"},
          p.thumbnails);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
