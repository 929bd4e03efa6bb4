// A CT of a head whose every boundary is known exactly: the embedded default case and the truth of tests.
#pragma once
#include <array>
#include <cstdint>
#include <string_view>

#include "osteo/core/base/context.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/volume.h"
#include "osteo/imaging/image/detail/head_anatomy.h"

namespace osteo::inline imaging {

enum class PhantomRegion : int { head, temporal, mandible, fibula };
[[nodiscard]] constexpr std::array<std::string_view, 4> enum_names(PhantomRegion) {
  return {"head", "temporal", "mandible", "fibula"};
}

struct PhantomParams {
  PhantomRegion region = PhantomRegion::head;
  double spacing_mm = 1.0;
  double slice_mm = 0;
  double noise_hu = 15;
  int individual = 0;
};

struct Phantom {
  Image ct;       ///< mean HU over the voxel, the scanner's point spread (1 4 1)/6 along each axis, Gaussian noise
  Labels labels;  ///< exact tissue at the voxel centre
  double bone_mm3 = 0;  ///< by the same 27 samples a voxel
};
/// A CT of `HeadAnatomy(params.individual)`, or of a fibula (superelliptic shaft, bowed, twisted and thicker at its
/// ends; a canal of marrow within the cortex, of HU like soft tissue). Same parameters and context.seed (of the noise),
/// same bytes, for any number of threads. Voxels that one tissue fills, which its margin tells, cost one sample for all
/// of a block.
[[nodiscard]] Phantom make_phantom(const PhantomParams& params, const Context& context = {});

}  // namespace osteo::inline imaging
