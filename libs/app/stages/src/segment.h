// The stages tube and find-structures.
#pragma once
#include <string>

#include "osteo/core/stage/stage.h"
#include "osteo/imaging/segment/ear.h"
#include "osteo/imaging/segment/tube.h"

namespace osteo::inline app {

/// Structure::origin of what a stage draws.
[[nodiscard]] inline std::string origin_of(const StageInfo& stage) {
  return stage.name + ", version " + std::to_string(stage.version);
}

struct TubeStageParams {
  TubeParams tube;
  std::string points_mm;
  std::string name = "facial nerve";
};

struct TubeStage {
  using Params = TubeStageParams;
  static void describe(Params& p, auto& visit) {
    visit({"points_mm", "two points on it or more, in order, LPS: 'x,y,z; x,y,z' (or a file by --points)", "mm"},
          p.points_mm);
    visit({"name", "what it is called in the label map; one of that name there is replaced"}, p.name);
    visit({"kind", "nerve: soft tissue in bone, or a strand in air; vessel: brighter than what is around it"},
          p.tube.kind);
    visit({"max_radius_mm",
           "wider tubes are not looked for; a facial nerve is held to 1.5, a chorda tympani to 0.6, an alveolar "
           "nerve to 2.5",
           "mm", 0.2, 5},
          p.tube.max_radius_mm);
    visit({"lumen_hu", "what fills a nerve's canal; the radius of thin ones goes by it", "HU", -200, 500},
          p.tube.lumen_hu);
    visit({"snap_mm",
           "a point moves this far to what looks most like a tube (0: stays), but not farther than max_radius_mm", "mm",
           0, 5},
          p.tube.snap_mm);
    visit({"max_uncertain_mm", "a longer stretch without walls and without a point is an error", "mm", 0, 1000},
          p.tube.max_uncertain_mm);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

struct FindStructuresStage {
  struct Params {
    EarParams ear;
    std::array<double, 3> labyrinth_mm{0, 0, 0};
  };
  static void describe(Params& p, auto& visit) {
    visit({"side", "the patient's"}, p.ear.side);
    visit({"what", "what to find, with commas: ear_canal, air_cells, sigmoid_sinus, tegmen, dura, labyrinth; or all"},
          p.ear.what);
    visit({"labyrinth_mm", "a point within the labyrinth, in its vestibule, LPS (0,0,0: none given)", "mm"},
          p.labyrinth_mm);
    visit({"min_quality", "what is found with less is not written (0: everything is)", "", 0, 1}, p.ear.min_quality);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

}  // namespace osteo::inline app
