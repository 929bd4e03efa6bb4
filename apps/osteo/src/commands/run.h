// osteo run
#pragma once
#include <array>
#include <string>

#include "osteo/app/cli/command.h"

namespace osteo {

enum class RunEngine : int { stages, vtk };
[[nodiscard]] constexpr std::array<std::string_view, 2> enum_names(RunEngine) {
  return {"stages", "vtk"};
}

struct RunCommand {
  struct Params {
    bool validate = false;
    bool dry_run = false;
    bool reuse = false;
    RunEngine engine = RunEngine::stages;
  };
  static void describe(Params& p, auto& visit) {
    visit({"validate", "check the whole pipeline without reading any data, answer in JSON, and stop"}, p.validate);
    visit({"dry_run", "show what would be run and written, and stop"}, p.dry_run);
    visit({"reuse", "keep outputs that exist and would come out the same"}, p.reuse);
    visit({"engine",
           "who runs the stages: stages, one after the other; vtk, as connected filters by VTK's executive, with the "
           "same results"},
          p.engine);
  }
  static cli::CommandInfo info();
  static int run(const Params& params, cli::Invocation& invocation);
};

}  // namespace osteo
