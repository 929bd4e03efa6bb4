// The stage curve: where a recorded hand would be held by a curve.
#pragma once
#include "osteo/core/stage/stage.h"
#include "osteo/simulation/haptics/curve_constraint.h"

namespace osteo::inline app {

struct VirtualFixtureStage {
  using Params = CurveConstraintParams;
  static void describe(Params& p, auto& visit) {
    visit({"stiffness_n_per_mm", "pull for a mm of distance", "N/mm", 0, 100}, p.stiffness_n_per_mm);
    visit({"max_force_n", "the pull grows no further", "N", 0, 100}, p.max_force_n);
    visit({"arc_penalty", "mm of distance that a mm of way along the curve counts as", "", 0, 100}, p.arc_penalty);
    visit({"engage_mm", "takes hold when nearer than this", "mm", 0, 1e9}, p.engage_mm);
    visit({"release_mm", "lets go when farther than this", "mm", 0, 1e9}, p.release_mm);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

}  // namespace osteo::inline app
