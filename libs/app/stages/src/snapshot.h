// The stage snapshot.
#pragma once
#include "osteo/core/stage/stage.h"
#include "osteo/display/view/pictures.h"

namespace osteo::inline app {

struct SnapshotStage {
  using Params = SnapshotParams;
  static void describe(Params& p, auto& visit) {
    visit({"width", "width of the picture", "pixels", 200, 8192}, p.width);
    visit({"height", "height of the picture", "pixels", 200, 8192}, p.height);
    visit({"view", "side from which the 3D view looks at the patient"}, p.view);
    visit({"bone_hu", "surface shown in 3D of a CT without mask", "HU", -1000, 30000}, p.bone_hu);
    visit({"centre_mm", "point that the cuts go through, LPS (0,0,0: the middle)", "mm"}, p.centre_mm);
    visit({"title", "written in the lower right corner"}, p.title);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

}  // namespace osteo::inline app
