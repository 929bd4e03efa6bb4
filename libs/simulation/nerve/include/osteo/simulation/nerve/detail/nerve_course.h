// Where a nerve runs: the middle line of its surface, from the brain to its muscles.
#pragma once
#include <string>
#include <vector>

#include "osteo/core/data/tri_mesh.h"

namespace osteo::inline simulation {

struct NerveCourse {
  struct Point {
    Vec3 at_mm;
    double to_distal_mm = 0;  ///< along the nerve, to its distal end in the case
    double radius_mm = 0;     ///< mean distance of its surface
  };
  std::string name;           ///< of the structure
  std::vector<Point> points;  ///< about kSpacingMm apart, the distal end last; may be empty where the surface is
  static constexpr double kSpacingMm = 0.5;
};

/// Middles of the rings that are equally far from one end over the surface (Dijkstra along its edges), straight on
/// where at the ends rings are not closed. For every part that is connected and is longer than 1 mm; parts are joined
/// in the order in which they lie along `distal` (unit). For tubes: measured on the phantom's facial nerve in
/// docs/validation/accuracy.md. O(n log n) of its points; the same for the same surface.
[[nodiscard]] NerveCourse course_of(const TriMesh& face, Vec3 distal, std::string name);

}  // namespace osteo::inline simulation
