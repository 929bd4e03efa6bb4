// Values changed on purpose: less noise, less of metal's streaks. Never on by default; what it does to the scan is
// measured and told.
#pragma once
#include "osteo/core/base/context.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/volume.h"

namespace osteo::inline imaging {

struct DenoiseParams {
  double strength = 1;
};
/// How noisy the soft tissue is, and how wide the edges are.
struct Sharpness {
  double noise_hu =
      0;  ///< standard deviation between -150 and 150 HU, from second differences: of what changes from pixel to pixel
  double edge_width_mm = 0;  ///< from 10 to 90 % of steep edges, median; 0 where there are none
};
/// In slices across the last axis. O(voxels). `edges_of`: where edges are looked for, so that before and after are of
/// the same places.
[[nodiscard]] Sharpness sharpness_of(const Image& image, const Image& edges_of);

/// Non-local means in each slice (A. Buades et al., A non-local algorithm for image denoising, CVPR 2005; OpenCV's,
/// patches of 5, window of 11, its strength being `strength` times the noise found). Reports noise and edge width
/// before and after. Values above 3071 HU and below -1024 HU stay. Same bytes for any thread count. About 0.2 s a slice
/// of 512 x 512.
[[nodiscard]] Image denoise(const Image& image, const DenoiseParams& params, const Context& context = {});

struct MetalParams {
  double metal_hu = 2500;
  double min_area_mm2 = 3;
};
/// On slices that hold metal (at or above `metal_hu`, at least `min_area_mm2` of it) the sums along lines through the
/// metal are taken from the lines beside it, and the difference is projected back (W. Kalender et al., Reduction of CT
/// artifacts caused by metallic implants, Radiology 1987); then again, what a picture of tissue classes explains taken
/// off before (after E. Meyer et al., Normalized metal artifact reduction, Medical Physics 2010). On at most 256 x 256
/// pixels; metal itself and all other slices stay. It starts from the picture, not the scanner's raw data: streaks are
/// weakened, not gone, and edges of bone in line with metal are blurred. Reports slices and voxels changed and by how
/// much. Same bytes for any thread count. About 1 s a slice.
[[nodiscard]] Image reduce_metal(const Image& image, const MetalParams& params, const Context& context = {});

}  // namespace osteo::inline imaging
