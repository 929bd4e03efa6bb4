// A hierarchy over triangles that answers "which triangle is nearest" exactly.
#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/geometry/mesh/soup.h"

namespace osteo::inline geometry {

/// Where on a triangle the nearest point lies.
enum class Feature : std::uint8_t { face, edge_ab, edge_bc, edge_ca, corner_a, corner_b, corner_c };

struct ClosestPoint {
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  double distance_mm = std::numeric_limits<double>::infinity();  ///< unsigned
  std::uint32_t triangle = kNone;  ///< index in the soup; of equally near ones always the same
  Feature feature = Feature::face;
  Vec3 point_mm;
};

/// A tree of boxes, sixteen to a node, over triangles sorted along a Morton curve; no pointers. Immutable; any number
/// of threads may ask at once. Distances are exact to rounding in double precision (about 1e-15 of the extents), for
/// needles and zero-area triangles too: single precision only decides, with a proven margin, which triangles are
/// measured. Memory: 240 bytes a triangle. Build O(n): a radix sort.
class TriangleTree {
 public:
  TriangleTree() = default;
  /// Errors as require_sound; failed when there is no triangle. 0 threads = all cores.
  explicit TriangleTree(const TriangleSoup& soup, const Context& context = {});
  /// The same, kept in the axes of a frame, for maps along it.
  TriangleTree(const TriangleSoup& soup, const Mat3& axes, const Context& context);

  [[nodiscard]] std::size_t triangle_count() const;
  /// O(log n). `hint`: a triangle probably near, e.g. the answer for a neighbouring point. Only what is nearer than
  /// `limit_mm`.
  [[nodiscard]] ClosestPoint closest(Vec3 point_mm, std::uint32_t hint = ClosestPoint::kNone,
                                     double limit_mm = std::numeric_limits<double>::infinity()) const;
  [[nodiscard]] std::size_t memory_bytes() const;

  struct Data;  ///< private to libs/geometry/distance
  [[nodiscard]] const Data& data() const { return *data_; }

 private:
  std::shared_ptr<const Data> data_;
};

/// The point of one triangle nearest to p, by the same arithmetic.
[[nodiscard]] ClosestPoint closest_on_triangle(Vec3 p, Vec3 a, Vec3 b, Vec3 c);

}  // namespace osteo::inline geometry
