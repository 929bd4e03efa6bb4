// CT and bone mask to isotropic sparse bone density.
#pragma once
#include <array>

#include "osteo/core/base/context.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/sparse_grid.h"
#include "osteo/core/data/volume.h"

namespace osteo::inline geometry {

/// How the boundary of bone runs from slice to slice. values: by interpolated HU. outlines: also by the slices'
/// outlines, which makes no step half-way between slices that lie far apart. automatic: outlines where slices lie 1.5
/// mm or more and over 1.3 times as far apart as pixels.
enum class Between : int { automatic, values, outlines };
[[nodiscard]] constexpr std::array<std::string_view, 3> enum_names(Between) {
  return {"automatic", "values", "outlines"};
}

struct ResampleParams {
  double spacing_mm = 0.5;
  double lower = 0;                          ///< 0: the value that tells the mask from the rest best
  std::array<double, 3> box_mm{0, 0, 0};     ///< only this much, around centre_mm; 0: all there is
  std::array<double, 3> centre_mm{0, 0, 0};  ///< LPS
  double align_mm = 0.5;  ///< the box grows to faces of voxels of this edge: those of the bone it is a finer part of
  Between between = Between::automatic;
};

struct ResampledBone {
  SparseGrid density;  ///< "density": share of the voxel filled with bone, 0 to 1; only voxels above 0 are stored
  SparseGrid hu;       ///< "hu": CT value, stored in the same voxels only (so no soft tissue, and no face)
  double volume_before_mm3 = 0, volume_after_mm3 = 0;
};

/// Isotropic voxels along the axes of the CT.
///
/// With `outlines` the boundary between two slices runs from the outline in the one to the outline in the other, at
/// most 200 HU of a voxel's contrast counting over the distance of slices; where bone begins or ends between slices, or
/// runs nearly level with them, values decide as before. Nothing is added that the slices do not show: what is thinner
/// than their distance and level with them is seen as they saw it, and a body's end lies somewhere within the last
/// slice. The bone boundary is where the interpolated HU (cubic) crosses `lower`, not the steps of the mask: the mask
/// only decides which bone is kept. Voxels that the mask adds (closing, filling) or takes away (small pieces) count as
/// just inside or outside. The boundary's offset is then set (a few HU at most, reported) so that the bone keeps the
/// mask's volume; see docs. A voxel's density is the share of it inside, from the signed HU distance to the boundary
/// over its gradient; coarser voxels than the CT's are averaged from sub-voxels, so nothing aliases. With a box, the
/// boundary's offset is that of the whole bone at align_mm, so that both meet where they touch. The value that fits
/// best is the one at which `HU >= lower` differs from the mask in the fewest voxels: the highest such, or the middle
/// where they are more than 20 HU apart (a warning says so). `ct` and `mask` must lie at the same place (Error usage).
/// O(output voxels near bone). Same bytes for any thread count.
[[nodiscard]] ResampledBone resample_bone(const Image& ct, const Labels& mask, const ResampleParams& params,
                                          const Context& context = {});

}  // namespace osteo::inline geometry
