// The stage register.
#pragma once
#include "osteo/core/stage/stage.h"
#include "osteo/imaging/registration/register.h"

namespace osteo::inline app {

struct RegisterStage {
  using Params = RegisterParams;
  static void describe(Params& p, auto& visit) {
    visit({"method", "mutual: by all values, for a CT or an MR; surface: by bone's surface, for two CTs"}, p.method);
    visit({"finest_mm", "voxels of the finest level; finer is slower and of little use below the scans' own", "mm", 0.3,
           8},
          p.finest_mm);
    visit({"bone_hu", "surface: bone is what is at or above this value", "HU", -1024, 32767}, p.bone_hu);
    visit({"max_residual_mm", "reject where at half of all edges the other scan's edge is farther off than this", "mm",
           0.05, 4},
          p.max_residual_mm);
    visit({"accept_poor", "write the transform even where it would be rejected, with a warning"}, p.accept_poor);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

}  // namespace osteo::inline app
