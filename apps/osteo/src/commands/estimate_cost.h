// osteo estimate-cost
#pragma once
#include <string>

#include "osteo/app/cli/command.h"
#include "osteo/simulation/haptics/contact.h"

namespace osteo {

struct EstimateCostCommand {
  struct Params {
    std::string settings;
    ContactMethod contact = ContactMethod::overlap;
    bool dust = false;
    bool heat = false;
  };
  static void describe(Params& p, auto& visit) {
    visit({"settings", "how it feels, as JSON (empty: haptics.json of the case where there is one)"}, p.settings);
    visit({"contact", "how the burr feels bone"}, p.contact);
    visit({"dust", "include bone dust"}, p.dust);
    visit({"heat", "include heat of drilling"}, p.heat);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
