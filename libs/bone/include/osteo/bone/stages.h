// The stages saw and pieces.
#pragma once
#include "osteo/image/components.h"
#include "osteo/stage/stage.h"

namespace osteo {

struct SawParams {
  std::array<double, 3> at_mm{0, 0, 0};
  bool from_centre = true;
  std::array<double, 3> normal{1, 0, 0};
  std::array<double, 3> along{0, 0, 1};
  double kerf_mm = 0.6;
  double length_mm = 0;
  double depth_mm = 0;
};
struct SawStage {
  using Params = SawParams;
  static void describe(Params& p, auto& visit) {
    visit({"at_mm", "middle of the blade, LPS", "mm"}, p.at_mm);
    visit({"from_centre", "--at-mm counts from the middle of the bone instead of from the scan's origin"}, p.from_centre);
    visit({"normal", "across the blade, LPS"}, p.normal);
    visit({"along", "where the blade's length lies, LPS"}, p.along);
    visit({"kerf_mm", "thickness of what is removed", "mm", 0.01, 100}, p.kerf_mm);
    visit({"length_mm", "of the blade (0: endless)", "mm", 0, 10000}, p.length_mm);
    visit({"depth_mm", "of the blade, at right angles to its length (0: endless)", "mm", 0, 10000}, p.depth_mm);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

struct PiecesParams {
  double least_mm3 = 50;
  Connectivity connectivity = Connectivity::face;
  double apart_mm = 0;
  int keep = 0;
};
struct PiecesStage {
  using Params = PiecesParams;
  static void describe(Params& p, auto& visit) {
    visit({"least_mm3", "smaller parts are crumbs", "mm3", 0, 1e9}, p.least_mm3);
    visit({"connectivity", "face: voxels that share a face hang together; full: an edge or a corner is enough"}, p.connectivity);
    visit({"apart_mm", "move the pieces away from their common middle, to look at them", "mm", 0, 1000}, p.apart_mm);
    visit({"keep", "which piece the output bone holds, largest first (0: all but the crumbs)", "", 0, 1000000}, p.keep);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

}  // namespace osteo
