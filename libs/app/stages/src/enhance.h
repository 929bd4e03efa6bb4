// The stages denoise and reduce-metal.
#pragma once
#include "osteo/core/stage/stage.h"
#include "osteo/imaging/image/enhance.h"

namespace osteo::inline app {

struct DenoiseStage {
  using Params = DenoiseParams;
  static void describe(Params& p, auto& visit) {
    visit({"strength", "how strong: 1 goes by the noise that is found, less keeps more of both noise and detail", "",
           0.1, 4},
          p.strength);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

struct ReduceMetalStage {
  using Params = MetalParams;
  static void describe(Params& p, auto& visit) {
    visit({"metal_hu", "metal is what is at or above this value", "HU", 500, 32767}, p.metal_hu);
    visit({"min_area_mm2", "a slice with less metal than this stays as it is", "mm2", 0, 10000}, p.min_area_mm2);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

}  // namespace osteo::inline app
