// Other ways to distances: of a mask between voxel centres, swept (approximate), and the maps of the dissertation.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/data/frame.h"
#include "osteo/core/data/sparse_grid.h"
#include "osteo/core/data/volume.h"
#include "osteo/geometry/distance/distance_map.h"
#include "osteo/geometry/mesh/soup.h"

namespace osteo::inline geometry {

// -- The distance from voxels to a structure of a label map.

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

// -- An approximate distance map: exact beside the surface, swept through the rest.

/// Unsigned distance in mm at every voxel of the frame. Voxels within one voxel of a triangle get the exact distance;
/// the others try the nearest triangles of their neighbours, in eight sweeps (as in R. Bridson's SDFGen; H. Zhao, A
/// Fast Sweeping Method, Math. Comp. 2005). Never below the true distance; docs/validation/accuracy.md has by how much above.
/// O(voxels + triangles). Memory 12 bytes a voxel. One thread. Errors as of TriangleTree.
[[nodiscard]] std::vector<double> swept_distance_mm(const TriangleSoup& soup, const Frame& frame,
                                                    const Context& context = {});

// -- The distance maps of the dissertation, for comparison.

struct ThesisDistanceOptions {
  int tree_ascend_n = 0;  ///< levels above the last point's triangle where the next search starts; -1: no such hint
  bool breadth_first = false;
  /// The lower bound of a box as printed: the distances along the axes are added before they are squared. That is no
  /// bound on Euclidean distance, so nearer triangles are lost. false: the squares are added.
  bool bound_as_printed = false;
};

/// D. Morris 2006, section 6.3: a binary tree of boxes; each search starts with the box that held the last point's
/// nearest triangle, and drops boxes whose lower bound exceeds the lowest upper bound seen.
class ThesisDistance {
 public:
  explicit ThesisDistance(const TriangleSoup& soup);
  ~ThesisDistance();
  /// Unsigned distances of points, which should lie near each other in their order. One thread, as there.
  [[nodiscard]] std::vector<double> distances_mm(std::span<const Vec3> points_mm, const ThesisDistanceOptions& options,
                                                 const Context& context = {}) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace osteo::inline geometry
