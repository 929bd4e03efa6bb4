// The stages crop, threshold, structures and phantom.
#pragma once
#include "osteo/core/stage/stage.h"
#include "osteo/imaging/image/crop.h"
#include "osteo/imaging/image/phantom.h"
#include "osteo/imaging/image/structures.h"
#include "osteo/imaging/image/threshold.h"

namespace osteo::inline app {

struct CropStage {
  using Params = CropParams;
  static void describe(Params& p, auto& visit) {
    visit({"region", "what to cut out; the left is the patient's"}, p.region);
    visit({"centre_mm", "centre of the box, LPS (0,0,0: as found)", "mm"}, p.centre_mm);
    visit({"size_mm", "edges of the box along left-right, front-back, feet-head (0,0,0: as the region has)", "mm"},
          p.size_mm);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

struct ThresholdStage {
  using Params = ThresholdParams;
  static void describe(Params& p, auto& visit) {
    visit(
        {"preset",
         "how the threshold is found: fixed takes --lower, the others go by this scan (see 'osteo suggest-threshold')"},
        p.preset);
    visit({"lower", "keep voxels at or above this value", "HU", -32768, 32767}, p.lower);
    visit({"upper", "keep voxels at or below this value", "HU", -32768, 32767}, p.upper);
    visit({"core", "hysteresis: keep only components that hold a voxel at or above this value (off at or below lower)",
           "HU", -32768, 32767},
          p.core);
    visit({"remove_table",
           "clear all that lies outside the body (table, head holder, wires), also where that is not certain; without "
           "it only what touches "
           "no bone "
           "of the body, is far from it and in air"},
          p.remove_table);
    visit({"keep_table", "clear nothing outside the body, however certain"}, p.keep_table);
    visit({"metal_mm", "clear streaks within this distance of metal (0: off)", "mm", 0, 100}, p.metal_mm);
    visit({"metal_hu", "metal is what is at or above this value", "HU", 500, 32767}, p.metal_hu);
    visit({"metal_lower", "near metal, bone must be at or above this value", "HU", -1024, 32767}, p.metal_lower);
    visit({"close_mm", "close gaps narrower than twice this radius", "mm", 0, 20}, p.close_mm);
    visit({"fill_mm3", "fill enclosed cavities up to this volume", "mm3", 0, 1e9}, p.fill_mm3);
    visit({"min_volume_mm3", "drop components smaller than this volume", "mm3", 0, 1e9}, p.min_volume_mm3);
    visit({"keep_largest", "keep only this many of the largest components (0 keeps all)", "", 0, 1000000},
          p.keep_largest);
    visit({"connectivity", "which neighbours belong to the same piece: face is 6, full is 26"}, p.connectivity);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

struct StructuresStage {
  using Params = StructuresParams;
  static void describe(Params& p, auto& visit) {
    visit({"names", "what the values stand for, like '1=facial nerve, 2=sigmoid sinus' (empty: as the file says)"},
          p.names);
    visit({"only_named", "values that neither names nor the file name are background: tissue that is not at risk"},
          p.only_named);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

struct PhantomStage {
  using Params = PhantomParams;
  static void describe(Params& p, auto& visit) {
    visit(
        {"region", "the whole head, a block around the left temporal bone, the lower jaw with its joints, or a fibula"},
        p.region);
    visit({"spacing_mm", "voxel size in the slice", "mm", 0.2, 4}, p.spacing_mm);
    visit({"slice_mm", "distance of slices (0: same as spacing_mm)", "mm", 0, 10}, p.slice_mm);
    visit({"noise_hu", "standard deviation of the noise", "HU", 0, 200}, p.noise_hu);
    visit({"individual",
           "whose head: 0 has mean sizes, another number varies them as people vary and places other air cells", "", 0,
           1000000},
          p.individual);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

}  // namespace osteo::inline app
