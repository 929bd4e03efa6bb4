// The stages plan-reconstruction, cutting-guide and outcome.
#pragma once
#include "osteo/core/stage/stage.h"
#include "osteo/session/planning/planning.h"

namespace osteo::inline app {

struct PlanReconstructionStage {
  using Params = ReconstructionParams;
  static void describe(Params& p, auto& visit) {
    visit({"target", "mirrored: the healthy side; own: the mandible as it is, where its outline is not changed"},
          p.target);
    visit({"a_mm", "place in resection plane a, in the bone", "mm"}, p.a_mm);
    visit({"a_normal", "normal of the first plane, towards what is removed"}, p.a_normal);
    visit({"b_mm", "place in resection plane b, in the bone", "mm"}, p.b_mm);
    visit({"b_normal", "normal of the second plane, towards what is removed"}, p.b_normal);
    visit({"down", "direction from the teeth to the lower border, roughly"}, p.down);
    visit({"max_segments", "largest number of segments", "", 1, 6}, p.max_segments);
    visit({"min_length_mm", "shortest length of a segment, along its shortest side", "mm", 1, 100}, p.min_length_mm);
    visit({"max_contour_mm", "fewer segments are taken while the mean error is not above this", "mm", 0.1, 10},
          p.max_contour_mm);
    visit({"kerf_mm", "width of each saw cut", "mm", 0, 5}, p.kerf_mm);
    visit({"reserve_mm", "left at each end of the donor bone", "mm", 0, 200}, p.reserve_mm);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

struct CuttingGuideStage {
  using Params = CuttingGuideParams;
  static void describe(Params& p, auto& visit) {
    visit({"bone", "name of the bone in the plan; empty: the only one that it cuts"}, p.bone);
    visit({"planes", "names of the planes that the guide serves, separated by commas; empty: all of the bone"},
          p.planes);
    visit({"approach",
           "direction from the bone to where the guide comes from; 0,0,0: where wedges open, else away "
           "from the bone's middle"},
          p.approach);
    visit({"slot", "closed: a bridge at both ends of each slot; open: at one end"}, p.slot);
    visit({"gap_mm", "distance of the guide's underside to the bone", "mm", 0.02, 2}, p.gap_mm);
    visit({"play_mm", "width of a slot beyond the planned kerf", "mm", 0, 1}, p.play_mm);
    visit({"wall_mm", "thickness over the bone's highest place, and of the bridges", "mm", 1.5, 20}, p.wall_mm);
    visit({"margin_mm", "length of the block beyond the outermost slots", "mm", 3, 60}, p.margin_mm);
    visit({"depth_mm", "how far the guide reaches down beside the bone's highest place", "mm", 0.5, 20}, p.depth_mm);
    visit({"seat",
           "in --cuts-out the guide lies as planned, or as far off as its play lets it turn each plane: what the cuts "
           "are held against stays the plan"},
          p.seat);
    visit({"code", "engraved in the top: letters, digits and '-'"}, p.code);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

struct OutcomeStage {
  using Params = OutcomeParams;
  static void describe(Params& p, auto& visit) {
    visit({"min_drop_hu", "an edge of bone drops by at least this much", "HU", 20, 3000}, p.min_drop_hu);
    visit({"metal_hu", "what is brighter is metal; edges of bone within 8 mm of it are left out", "HU", 500, 32767},
          p.metal_hu);
    visit(
        {"max_unsure_mm", "a result is not known where the half-width of its 95 % interval is larger", "mm", 0.01, 10},
        p.max_unsure_mm);
    visit({"max_unsure_deg", "a result is not known where the half-width of its 95 % interval is larger", "degrees",
           0.01, 30},
          p.max_unsure_deg);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

}  // namespace osteo::inline app
