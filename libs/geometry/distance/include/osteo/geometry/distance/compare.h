// How far apart two surfaces are.
#pragma once
#include "osteo/core/base/context.h"
#include "osteo/core/base/param.h"
#include "osteo/geometry/mesh/soup.h"

namespace osteo::inline geometry {

/// Distances of the points of one surface to the nearest points of another.
struct OneWayDistance {
  double mean_mm = 0, rms_mm = 0, p95_mm = 0;  ///< over area: sample points spread evenly
  double max_mm = 0;                           ///< reached at `worst_mm`
  double max_bound_mm = 0;                     ///< and nowhere more than this
  Vec3 worst_mm;
  std::uint64_t samples = 0;
};
struct SurfaceComparison {
  OneWayDistance a_to_b, b_to_a;
  [[nodiscard]] double hausdorff_mm() const { return a_to_b.max_mm > b_to_a.max_mm ? a_to_b.max_mm : b_to_a.max_mm; }
  [[nodiscard]] double hausdorff_bound_mm() const {
    return a_to_b.max_bound_mm > b_to_a.max_bound_mm ? a_to_b.max_bound_mm : b_to_a.max_bound_mm;
  }
};
/// The maximum by branch and bound over triangles: distance changes by no more than one moves, so a triangle whose
/// centre is near cannot hold the maximum, nor one whose corners are near the triangle that is nearest to its centre, as
/// the distance to that is convex. At corners it is exact. Stops when bound and maximum agree to 1e-4 of the extents, or
/// after 200,000 questions; then the bound says so. Same result for any thread count. Errors: as of TriangleTree.
[[nodiscard]] SurfaceComparison compare_surfaces(const TriangleSoup& a, const TriangleSoup& b,
                                                 const Context& context = {});

}  // namespace osteo::inline geometry
