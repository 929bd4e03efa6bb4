// How many turns many triangles make around a point, in a hierarchy with a proven bound. Private to
// libs/geometry/distance.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "osteo/geometry/distance/detail/fan.h"

namespace osteo::inline geometry {

/// Decides on which side of 1/2 a winding number is, as a sum over all triangles in their order would, at a fraction of
/// its cost.
///
/// A node stands for its triangles by the moments of their area up to second order about its centre (after G. Barill et
/// al., Fast winding numbers for soups and clouds, ACM Trans. Graph. 2018). What is left out has a bound in closed
/// form. A point at R from the centre sees an element of area at y through the gradient of sum |y|^n P_n / R^(n+1); the
/// gradient of |y|^n P_n is at most n |y|^(n-1) (Bernstein and Szego: P_n'^2 + n^2 P_n^2 <= n^2 for a trigonometric
/// polynomial that is at most 1). With terms up to n = 3 kept and |y| <= r, rho = r/R < 1, that leaves at most
///   |y|^3 / R^5 (4 / (1 - rho) + rho / (1 - rho)^2)   for each unit of area.
/// The node with the largest bound is split until the sum of bounds decides. Where rounding could decide, all triangles
/// are added up in their order.
///
/// Immutable; any number of threads may ask. Build O(n log n); about 250 bytes a triangle. Coordinates in any one unit.
class TurnsTree {
 public:
  explicit TurnsTree(std::vector<Fan> triangles);
  [[nodiscard]] bool empty() const { return triangles_.empty(); }

  /// |winding - turns(p)| > 1/2, turns added in order of the triangles. Expected O(log n) where that is clear.
  [[nodiscard]] bool beyond_half(int winding, Vec3 p) const;
  /// How often a ray along x has crossed the triangles when it comes to p, with their weights. O(log n + those in its
  /// way).
  [[nodiscard]] int crossings_before(Vec3 p) const;

  struct Turns {
    double value = 0, error = 0;  ///< |value - sum| <= error
  };
  /// Known to `tolerance`, or to rounding.
  [[nodiscard]] Turns turns(Vec3 p, double tolerance) const;
  /// The sum over all triangles in their order. O(n).
  [[nodiscard]] double sum(Vec3 p) const;

 private:
  struct Node {
    Vec3 centre, lo, hi;
    double radius = 0, area = 0, third = 0, weight = 0;  // farthest corner; sums of |w| A, |w| A |y|^3, |w|
    std::array<double, 23> moment{};
    std::uint32_t begin = 0, end = 0, left = 0;  // children: left, left + 1; 0 for a leaf
  };
  struct Open;  // a node that may be split, with its turns at a point
  [[nodiscard]] Turns of(const Node& node, Vec3 p) const;
  template <typename Done>
  [[nodiscard]] Turns refine(Vec3 p, const Done& done) const;
  void build(std::uint32_t node);

  std::vector<Fan> triangles_;        // in the order in which they are added
  std::vector<std::uint32_t> order_;  // by node
  std::vector<Node> nodes_;
  double rounding_ = 0;  // of any of the sums
};

}  // namespace osteo::inline geometry
