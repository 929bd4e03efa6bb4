// The distance from voxels to a structure of a label map.
#pragma once
#include <cstdint>
#include <span>

#include "osteo/core/base/context.h"
#include "osteo/core/data/sparse_grid.h"
#include "osteo/core/data/volume.h"
#include "osteo/geometry/distance/distance_map.h"

namespace osteo::inline geometry {

/// Signed Euclidean distance of a mask, between voxel centres: outside to the nearest voxel of the mask, inside
/// (negative) to the nearest voxel that is not in it. Exact for the voxels, which stand for the true surface to about
/// half a voxel. Of `wanted` structure values together; with `name_nearest` also which of them is the nearest (its own
/// inside; of equally near ones the smallest value), at the price of one transform a structure. Voxels farther than the
/// band are not stored. Memory: a dense float volume while it works. Error failed when no voxel has a wanted value.
struct MaskDistance {
  SparseGrid distance;  ///< "distance_mm"
  SparseGrid nearest;   ///< "nearest_structure", values of the labels; empty unless asked for
};
[[nodiscard]] MaskDistance mask_distance(const Labels& labels, std::span<const std::uint8_t> wanted,
                                         const DistanceMapOptions& options, bool name_nearest = false,
                                         const Context& context = {});

}  // namespace osteo::inline geometry
