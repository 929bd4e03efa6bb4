// The distance from voxels to a structure of a label map.
#pragma once
#include <cstdint>
#include <span>

#include "osteo/base/context.h"
#include "osteo/data/sparse_grid.h"
#include "osteo/data/volume.h"
#include "osteo/distance/distance_map.h"

namespace osteo {

/// Signed Euclidean distance of a mask, between voxel centres: outside to the nearest voxel of the mask, inside (negative) to the
/// nearest voxel that is not in it. Exact for the voxels, which stand for the true surface to about half a voxel. Of `wanted`
/// structure values together. Voxels farther than the band are not stored.
[[nodiscard]] SparseGrid mask_distance(const Labels& labels, std::span<const std::uint8_t> wanted, const DistanceMapOptions& options,
                                       const Context& context = {});

}  // namespace osteo
