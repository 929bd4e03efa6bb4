// Bone mask from Hounsfield units.
#pragma once
#include "osteo/core/base/context.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/volume.h"
#include "osteo/imaging/image/bone_threshold.h"
#include "osteo/imaging/image/components.h"

namespace osteo::inline imaging {

struct ThresholdParams {
  BonePreset preset = BonePreset::fixed;
  double lower = 300;
  double upper = 32767;
  double core = -32768;
  bool remove_table = false;
  bool keep_table = false;
  double metal_mm = 0;
  double metal_hu = 3000;
  double metal_lower = 1200;
  double close_mm = 0;
  double fill_mm3 = 0;
  double min_volume_mm3 = 10;
  int keep_largest = 0;
  Connectivity connectivity = Connectivity::full;
};

/// 1 where lower <= HU <= upper (lower as the preset says, see bone_threshold.h), then in this order: table and head
/// holder cleared where they are so for certain (with remove_table all that lies outside the body, with keep_table
/// nothing; libs/imaging/image/src/clean.h), voxels below metal_lower within metal_mm of metal cleared (streaks),
/// pieces without a voxel of at least `core` HU dropped (hysteresis), gaps up to twice close_mm closed (ball in mm),
/// enclosed cavities up to fill_mm3 filled, pieces below min_volume_mm3 or beyond the keep_largest largest dropped.
/// O(voxels). Error(failed) when nothing is left.
[[nodiscard]] Labels threshold(const Image& ct, const ThresholdParams& params, const Context& context = {});

}  // namespace osteo::inline imaging
