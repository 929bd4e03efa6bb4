// Plane sections of a surface and what is measured in them.
#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "osteo/geometry/mesh/soup.h"

namespace osteo::inline session::planning {

using Point2 = std::array<double, 2>;
using Loop = std::vector<Point2>;

/// A plane with axes in it: local x and y are columns 0 and 1, the normal column 2.
struct Sheet {
  Vec3 at_mm;
  Mat3 axes;
  Sheet(Vec3 at, Vec3 normal);
  [[nodiscard]] Point2 local(Vec3 p) const { return {dot(p - at_mm, axes.column[0]), dot(p - at_mm, axes.column[1])}; }
  [[nodiscard]] Vec3 world(Point2 p) const { return at_mm + axes.column[0] * p[0] + axes.column[1] * p[1]; }
};

/// Closed outlines only; points of the surface must be welded. O(triangles).
[[nodiscard]] std::vector<Loop> section(const TriangleSoup& bone, const Sheet& sheet);
/// The outline nearest to a place by its centroid, of those of at least 4 mm2; holes within it are not looked at.
[[nodiscard]] std::optional<Loop> outline_near(const TriangleSoup& bone, const Sheet& sheet, Vec3 place,
                                               double within_mm);

/// Refuses what is no bone of a patient in millimetres: a box whose longest side is shorter than `shortest_mm`, or
/// longer than 2.5 m. Says the unit that its lengths look like. Without that, each step after it blames planes and
/// sections.
void require_size_mm(const BoxMm& box, const std::string& name, double shortest_mm);
constexpr double kShortestBoneMm = 20;   // a jaw in centimetres is shorter
constexpr double kShortestDonorMm = 60;  // and so is a fibula

struct Moments {
  double area = 0;  ///< mm2, positive
  Point2 centroid{};
  double xx = 0, xy = 0, yy = 0;  ///< second moments about the centroid over the area, mm2
};
[[nodiscard]] Moments moments(const Loop& loop);
/// The part with direction . p >= offset.
[[nodiscard]] Loop clipped(const Loop& loop, Point2 direction, double offset);
/// Area that both enclose, mm2, by rows of 0.1 mm.
[[nodiscard]] double common_area(const Loop& a, const Loop& b);

}  // namespace osteo::inline session::planning
