// What a TriangleTree holds. Private to libs/geometry/distance.
#pragma once
#include <vector>

#include "kernel.h"
#include "osteo/core/base/big_array.h"
#include "osteo/geometry/distance/triangle_tree.h"

namespace osteo::inline geometry {

struct TriangleTree::Data {
  distance::TreeView view{};
  BigArray<distance::TriangleRecord> records;
  BigArray<distance::ExactTriangle> exact;
  std::vector<std::vector<distance::BoxGroup>> boxes;
  std::vector<std::uint32_t> original;  ///< tree order -> soup
  std::vector<std::uint32_t> rank;      ///< soup -> tree order
  Mat3 axes;                            ///< columns: the tree's axes in the world
  Vec3 centre_mm;
  double area = 0;     ///< of all triangles, in units of the tree
  double unit_mm = 1;  ///< a power of two: mm to one unit of the tree

  [[nodiscard]] Vec3 to_tree(Vec3 world_mm) const {
    const Vec3 v = world_mm - centre_mm;
    return Vec3{dot(axes.column[0], v), dot(axes.column[1], v), dot(axes.column[2], v)} / unit_mm;
  }
  [[nodiscard]] Vec3 to_world(Vec3 tree) const { return centre_mm + axes * (tree * unit_mm); }
};

namespace distance {
/// Points within +-384 of the tree's centre along a Morton curve, in its order; equal keys by index.
struct Keyed {
  std::uint64_t key;
  std::uint32_t index;
};
[[nodiscard]] std::uint64_t curve_key(Vec3 at);
/// By key, stable.
void radix_sort(std::vector<Keyed>& items);

/// The closest point on a triangle of the tree, in its units: d2 as `measure` gives it is not used here, only the
/// place.
struct Place {
  Vec3 point;
  Feature feature;
};
[[nodiscard]] Place place_on(const ExactTriangle& t, Vec3 p);
[[nodiscard]] ExactTriangle make_exact(Vec3 a, Vec3 b, Vec3 c);
}  // namespace distance

}  // namespace osteo::inline geometry
