// The exact signed distance from voxels to a surface.
#pragma once
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/data/frame.h"
#include "osteo/core/data/sparse_grid.h"
#include "osteo/geometry/distance/detail/fan.h"
#include "osteo/geometry/distance/triangle_tree.h"
#include "osteo/geometry/distance/voxelize.h"
#include "osteo/geometry/grid/brick_grid.h"

namespace osteo::inline geometry {

/// Signed distances (negative inside) at the centres of a set of voxels, in bricks of 8^3, with the nearest triangle.
struct DistanceMap {
  static constexpr int kEdge = 8, kVoxels = 512;

  Frame frame;
  std::vector<Ijk> bricks;              ///< in units of bricks, ascending z, y, x
  std::vector<std::uint64_t> stored;    ///< 8 words a brick: bit x + 8y of word z, voxels that have a distance
  std::vector<double> distance_mm;      ///< 512 a brick, x fastest; NaN where not stored
  std::vector<std::uint32_t> triangle;  ///< 512 a brick: index in the soup

  [[nodiscard]] std::uint64_t count() const;
  /// Index into distance_mm and triangle, or -1. O(log bricks).
  [[nodiscard]] std::int64_t find(int i, int j, int k) const;
};

enum class DistanceRegion : int { box, interior, band };
[[nodiscard]] constexpr std::array<std::string_view, 3> enum_names(DistanceRegion) {
  return {"box", "interior", "band"};
}

struct DistanceMapOptions {
  DistanceRegion region = DistanceRegion::box;
  double band_inside_mm = 1.5, band_outside_mm = 1.5;
};

/// Exact: for each voxel the nearest of all triangles, measured in double precision; see TriangleTree for the error. Of
/// equally near triangles always the same one. Same bytes for any thread count and instruction set.
///
/// Method: cubes of voxels hand lists of triangles down to their eight children. For a cube with centre c, half extents
/// h and nearest triangle T* at distance m in direction g*, a triangle (or box) T at distance d in direction g is left
/// out when
///   d - m > min(2|h|, sum |g_i - g*_i| h_i + |h|^2 / 2m):
/// distance to a convex set is convex, so d(x,T) >= d + g.(x-c), while d(x,T*) <= |x - p*|. Lists shrink to the few
/// triangles that some voxel of the cube is nearest to. O(voxels) times the length of the last lists (about 10) for
/// surfaces with triangles about as large as voxels.
class DistanceMapper {
 public:
  /// Builds the tree and tells inside from outside. Errors as of TriangleTree.
  DistanceMapper(const TriangleSoup& soup, const Frame& frame, const Context& context = {});
  /// With a tree of the soup in the axes of the frame (`TriangleTree(soup, frame.direction, ...)`): one serves several
  /// frames. Error(usage) where its axes are others.
  DistanceMapper(const TriangleSoup& soup, TriangleTree tree, const Frame& frame, const Context& context = {});
  [[nodiscard]] DistanceMap map(const DistanceMapOptions& options = {}, const Context& context = {}) const;
  /// Of those voxels of a set in the same frame that are within `reach_mm`.
  [[nodiscard]] DistanceMap map_of(const VoxelBits& wanted, double reach_mm = std::numeric_limits<double>::infinity(),
                                   const Context& context = {}) const;
  [[nodiscard]] const VoxelBits& inside() const { return inside_; }
  [[nodiscard]] const InsideReport& inside_report() const { return report_; }
  [[nodiscard]] const TriangleTree& tree() const { return tree_; }

 private:
  DistanceMap run(const VoxelBits* wanted, double inside_mm, double outside_mm, const Context& context) const;
  Frame frame_;
  TriangleTree tree_;
  VoxelBits inside_;
  InsideReport report_;
};

class TurnsTree;  // private to libs/geometry/distance

/// Signed distance and closest point at given points. The sign as voxels_inside tells it.
class SignedDistance {
 public:
  explicit SignedDistance(const TriangleSoup& soup, const Context& context = {});
  struct Answer {
    ClosestPoint closest;
    double signed_mm = 0;  ///< negative inside
  };
  /// O(log n); where a point's winding number is within rounding of one half, also O(openings). Any number of threads
  /// may ask at once.
  [[nodiscard]] Answer at(Vec3 point_mm, std::uint32_t hint = ClosestPoint::kNone) const;
  /// Of many points, the same to the bit and several times faster: sorted along a curve through space, each has a
  /// neighbour that tells it where to look and, where that neighbour is farther from the surface than from it, on which
  /// side it is.
  [[nodiscard]] std::vector<Answer> at(std::span<const Vec3> points_mm, const Context& context = {}) const;
  /// As of TriangleTree.
  [[nodiscard]] ClosestPoint closest(Vec3 point_mm, std::uint32_t hint = ClosestPoint::kNone,
                                     double limit_mm = std::numeric_limits<double>::infinity()) const {
    return tree_.closest(point_mm, hint, limit_mm);
  }
  /// Without the distance.
  [[nodiscard]] bool inside(Vec3 point_mm) const;
  [[nodiscard]] bool closed() const { return closed_; }

 private:
  TriangleTree tree_, ray_tree_;
  TriangleSoup surface_;  // what the rays meet: in order, when it was not closed
  std::shared_ptr<const TurnsTree> fans_;
  bool closed_ = true;
};

/// "distance_mm", for .vdb files; what is not stored has the background value (the largest stored distance outside).
[[nodiscard]] SparseGrid to_sparse(const DistanceMap& map);

}  // namespace osteo::inline geometry
