// The distance maps of the dissertation, for comparison.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/geometry/mesh/soup.h"

namespace osteo::inline geometry {

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
