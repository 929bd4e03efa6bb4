// The one shape that tools are made of: the hull of two balls.
#pragma once
#include <array>
#include <vector>

#include "osteo/core/data/vec.h"

namespace osteo::inline simulation {

/// The convex hull of a ball around `start_mm` on the z axis and one `length_mm` further up. Length 0: a ball; equal
/// radii: a cylinder with domes. Needs |end radius - start radius| < length where the length is not 0.
struct RoundCone {
  double start_mm = 0;
  double length_mm = 0;
  double start_radius_mm = 1, end_radius_mm = 1;

  /// Sine of the half angle: how fast the radius shrinks along the axis.
  [[nodiscard]] double slope() const { return length_mm > 0 ? (start_radius_mm - end_radius_mm) / length_mm : 0; }
  /// The place on the axis, from the start, whose ball is nearest to a point `axial_mm` up from the start and
  /// `radial_mm` off the axis.
  [[nodiscard]] double foot_mm(double radial_mm, double axial_mm) const;
  [[nodiscard]] double radius_at_mm(double foot_mm) const { return start_radius_mm - slope() * foot_mm; }
  /// Signed distance of a point from the surface, negative inside; exact.
  [[nodiscard]] double distance_mm(Vec3 point_mm) const;
  [[nodiscard]] double volume_mm3() const;
  [[nodiscard]] double largest_radius_mm() const {
    return start_radius_mm > end_radius_mm ? start_radius_mm : end_radius_mm;
  }
};

/// How deep a plane cuts into a shape when it cuts off a given volume: the depth of a flat cut of the same volume,
/// which is what stiffness in N/mm is measured against. A table over the angle between the plane's normal and the axis
/// and over the volume, made by quadrature; within 0.2 % of the depth (balls: in closed form, to rounding). Immutable.
class CutDepth {
 public:
  explicit CutDepth(const RoundCone& shape);
  /// Depth in mm. `cosine` between the plane's normal, pointing into what is cut off, and the axis. No allocation.
  [[nodiscard]] double operator()(double volume_mm3, double cosine) const noexcept;
  /// Area of that cut, mm2: how fast the volume grows with depth.
  [[nodiscard]] double area_mm2(double volume_mm3, double cosine) const noexcept;

 private:
  static constexpr int kAngles = 33, kVolumes = 65;
  bool ball_ = false;
  double radius_mm_ = 0, volume_mm3_ = 0;
  std::vector<double> table_;  // by angle, then by the root of the share of the volume
};

/// d in [0, 2r] such that a plane at depth d cuts the volume from a ball of radius r.
[[nodiscard]] double cap_depth_mm(double volume_mm3, double radius_mm) noexcept;

}  // namespace osteo::inline simulation
