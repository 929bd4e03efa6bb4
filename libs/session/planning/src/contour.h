// The lower border of a jaw from one plane to another, and how far a place is from a chain of straight axes.
#pragma once
#include <vector>

#include "section.h"

namespace osteo::inline session::planning {

constexpr double kNearMm = 25;  ///< an outline is looked for so far about a plane's place

struct Plane {
  Vec3 at, normal;
  [[nodiscard]] double ahead(Vec3 p) const { return dot(p - at, normal); }
};

/// The middle of the border, as high as `thickness`, about every 2 mm; both planes face what lies between them.
/// Errors: failed: no closed section where one is needed; usage: the planes do not face each other, or the bone does
/// not lead from one to the other.
[[nodiscard]] std::vector<Vec3> contour_of(const TriangleSoup& target, const Plane& a, const Plane& b, Vec3 down,
                                           double thickness);
[[nodiscard]] double to_segment(Vec3 p, Vec3 a, Vec3 b);

}  // namespace osteo::inline session::planning
