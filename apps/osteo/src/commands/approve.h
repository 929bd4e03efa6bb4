// osteo approve
#pragma once
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo {

struct ApproveCommand {
  struct Params {
    std::string by;
    std::string note;
    bool withdraw = false;
  };
  static void describe(Params& p, auto& visit) {
    visit({"by", "name of the person who has looked at the case; kept in the case and in each session"}, p.by);
    visit({"note", "what that person has to say"}, p.note);
    visit({"withdraw", "take the approval back"}, p.withdraw);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
