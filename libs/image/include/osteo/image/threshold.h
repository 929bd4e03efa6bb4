// Bone mask from Hounsfield units.
#pragma once
#include "osteo/data/volume.h"
#include "osteo/image/bone_threshold.h"
#include "osteo/image/components.h"
#include "osteo/stage/stage.h"

namespace osteo {

struct ThresholdParams {
  BonePreset preset = BonePreset::fixed;
  double lower = 300;
  double upper = 32767;
  double core = -32768;
  bool remove_table = false;
  double metal_mm = 0;
  double metal_hu = 3000;
  double metal_lower = 1200;
  double close_mm = 0;
  double fill_mm3 = 0;
  double min_volume_mm3 = 10;
  int keep_largest = 0;
  Connectivity connectivity = Connectivity::full;
};

/// 1 where lower <= HU <= upper (lower as the preset says, see bone_threshold.h), then in this order: what lies outside the body cleared
/// (table, head holder), voxels below metal_lower within metal_mm of metal cleared (streaks), pieces without a voxel of at least `core` HU
/// dropped (hysteresis), gaps up to twice close_mm closed (ball in mm), enclosed cavities up to fill_mm3 filled, pieces below
/// min_volume_mm3 or beyond the keep_largest largest dropped. O(voxels). Error(failed) when nothing is left.
[[nodiscard]] Labels threshold(const Image& ct, const ThresholdParams& params, const Context& context = {});

struct ThresholdStage {
  using Params = ThresholdParams;
  static void describe(Params& p, auto& visit) {
    visit({"preset", "how the threshold is found: fixed takes --lower, the others go by this scan (see 'osteo guide')"}, p.preset);
    visit({"lower", "keep voxels at or above this value", "HU", -32768, 32767}, p.lower);
    visit({"upper", "keep voxels at or below this value", "HU", -32768, 32767}, p.upper);
    visit({"core", "hysteresis: keep only pieces that hold a voxel at or above this value (off at or below lower)", "HU", -32768, 32767},
          p.core);
    visit({"remove_table", "clear what lies outside the body: table, head holder, wires"}, p.remove_table);
    visit({"metal_mm", "clear streaks within this distance of metal (0: off)", "mm", 0, 100}, p.metal_mm);
    visit({"metal_hu", "metal is what is at or above this value", "HU", 500, 32767}, p.metal_hu);
    visit({"metal_lower", "near metal, bone must be at or above this value", "HU", -1024, 32767}, p.metal_lower);
    visit({"close_mm", "close gaps narrower than twice this radius", "mm", 0, 20}, p.close_mm);
    visit({"fill_mm3", "fill enclosed cavities up to this volume", "mm3", 0, 1e9}, p.fill_mm3);
    visit({"min_volume_mm3", "drop pieces smaller than this volume", "mm3", 0, 1e9}, p.min_volume_mm3);
    visit({"keep_largest", "keep only this many of the largest pieces (0 keeps all)", "", 0, 1000000}, p.keep_largest);
    visit({"connectivity", "which neighbours belong to the same piece: face is 6, full is 26"}, p.connectivity);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

}  // namespace osteo
