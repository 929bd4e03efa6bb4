// Bone mask from Hounsfield units.
#pragma once
#include <array>
#include <string>
#include <string_view>

#include "osteo/core/base/context.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/volume.h"
#include "osteo/imaging/image/components.h"

namespace osteo::inline imaging {

// -- Which Hounsfield threshold suits the bone of this scan, and how sure that is.

/// fixed: the number that was given. The others lie between soft tissue and the core of dense bone, by share of that
/// distance.
enum class BonePreset : int { fixed, cortical, cellular, thin };
[[nodiscard]] constexpr std::array<std::string_view, 4> enum_names(BonePreset) {
  return {"fixed", "cortical", "cellular", "thin"};
}

struct PresetGuide {
  BonePreset preset = BonePreset::cortical;
  double lower_hu = 0;
  double volume_mm3 = 0;
  /// How much the volume of bone changes when the threshold moves by 50 HU either way, in percent of it: small where
  /// the edges of bone are steep, large where much of what is called bone is partial volume.
  double change_percent = 0;
};

struct BoneGuide {
  double soft_tissue_hu = 0;  ///< peak
  double noise_hu = 0;        ///< spread of that peak (standard deviation)
  double dense_bone_hu = 0;   ///< what bone reaches where it is thicker than the blur: upper quarter of its inside
  double confidence =
      0;  ///< 0 to 1: how far apart bone and tissue lie against the noise, times how sharp the edges are
  std::array<PresetGuide, 3> presets;  ///< cortical, cellular, thin
  std::string doubt;  ///< why the thresholds cannot be right (more bone than a body has); then confidence is 0
};

/// Half the way from soft tissue to dense bone puts the edge of thick bone where it is, whatever the blur (cortical).
/// Walls thinner than the blur never reach half: cellular takes 0.3 of the way, thin 0.2, and none comes nearer to
/// tissue than 3.5 times the noise. O(voxels). Error(failed) when there is no soft tissue or no bone to go by. The
/// half-way rule: S. Prevrhal et al., Accuracy limits for the determination of cortical width and density, Phys. Med.
/// Biol. 1999.
[[nodiscard]] BoneGuide guide_threshold(const Image& ct, int threads = 0);

// -- Which voxels are bone.

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
