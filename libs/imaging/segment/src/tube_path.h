// The way along a tube, voxel by voxel. Private to libs/imaging/segment.
#pragma once
#include <span>
#include <vector>

#include "field.h"
#include "osteo/imaging/segment/tube.h"

namespace osteo::inline imaging::segment {

/// How much each voxel looks like the middle of a tube: 0 to 1, where 1 is half of the best that a tube of bone's
/// contrast gives.
[[nodiscard]] std::vector<float> tubeness(const Field& field, const TubeParams& params, const Context& context);

/// The cheapest way from point to point, through neighbours of all 26 kinds. Points are moved to the most tube-like
/// voxel within snap_mm.
[[nodiscard]] std::vector<Vec3> cheapest_way(const Field& field, const std::vector<float>& tubeness,
                                             std::span<const Vec3> points_mm, double snap_mm, const Context& context);

}  // namespace osteo::inline imaging::segment
