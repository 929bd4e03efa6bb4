// Exact Euclidean distance transform of a mask.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/data/frame.h"

namespace osteo::inline geometry {

/// For each voxel the squared distance in mm2 from its centre to the centre of the nearest voxel equal to `value`
/// (infinity when there is none). Anisotropic spacing is honoured. O(voxels), in parallel over lines.
/// Felzenszwalb and Huttenlocher, Distance Transforms of Sampled Functions, Theory of Computing 2012.
[[nodiscard]] std::vector<float> squared_distance_mm2(std::span<const std::uint8_t> mask, const Frame& frame,
                                                      std::uint8_t value, const Context& context = {});

/// The same where it is at most `within_mm`, infinity elsewhere: a window of so many voxels along each axis in place of
/// whole lines. O(voxels * within / spacing), without divisions: faster up to about ten voxels. Error(usage) when
/// `within_mm` is not positive and finite.
[[nodiscard]] std::vector<float> squared_distance_within_mm2(std::span<const std::uint8_t> mask, const Frame& frame,
                                                             std::uint8_t value, double within_mm,
                                                             const Context& context = {});

}  // namespace osteo::inline geometry
