// The stage segment-network.
#pragma once
#include "osteo/core/stage/stage.h"
#include "osteo/imaging/neural/segment_network.h"

namespace osteo::inline app {

struct SegmentNetworkStage {
  using Params = NetworkParams;
  static void describe(Params& p, auto& visit) {
    visit({"folds", "folds that are averaged (none given: all that the folder has)", "", 0, 999}, p.folds);
    visit({"mirror", "average over mirrored passes, along the axes that the training allowed"}, p.mirror);
    visit({"step", "windows overlap: a step is this part of a window", "", 0.05, 1}, p.step);
    visit({"max_memory_gb", "an image that needs more is rejected before the first window", "GB", 0.1, 10000},
          p.max_memory_gb);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

}  // namespace osteo::inline app
