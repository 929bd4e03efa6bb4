// The stage apply-edits: what was corrected by hand, done again.
#pragma once
#include "osteo/core/stage/stage.h"
#include "osteo/imaging/edit/edit_file.h"

namespace osteo::inline app {

struct ApplyEditsStage {
  struct Params {};
  static void describe(Params&, auto&) {}
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

}  // namespace osteo::inline app
