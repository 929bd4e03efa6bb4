// An approximate distance map: exact beside the surface, swept through the rest.
#pragma once
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/data/frame.h"
#include "osteo/geometry/mesh/soup.h"

namespace osteo::inline geometry {

/// Unsigned distance in mm at every voxel of the frame. Voxels within one voxel of a triangle get the exact distance;
/// the others try the nearest triangles of their neighbours, in eight sweeps (as in R. Bridson's SDFGen; H. Zhao, A
/// Fast Sweeping Method, Math. Comp. 2005). Never below the true distance; docs/accuracy.md has by how much above.
/// O(voxels + triangles). Memory 12 bytes a voxel. One thread. Errors as of TriangleTree.
[[nodiscard]] std::vector<double> swept_distance_mm(const TriangleSoup& soup, const Frame& frame,
                                                    const Context& context = {});

}  // namespace osteo::inline geometry
