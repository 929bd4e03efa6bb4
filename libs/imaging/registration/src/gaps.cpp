#include "gaps.h"

namespace osteo::inline imaging::registration {

Closing close_gaps(const std::vector<Gap>& gaps) {
  Vec3 centre;
  for (const Gap& g : gaps) centre += g.at_mm / static_cast<double>(gaps.size());
  std::array<std::array<double, 8>, 7> m{};
  for (const Gap& g : gaps) {
    const Vec3 arm = cross(g.at_mm - centre, g.normal);
    const std::array<double, 7> row{arm.x, arm.y, arm.z, g.normal.x, g.normal.y, g.normal.z, -1};
    for (std::size_t i = 0; i < 7; ++i) {
      for (std::size_t j = 0; j < 7; ++j) m[i][j] += row[i] * row[j];
      m[i][7] -= row[i] * g.mm;
    }
  }
  // What nothing determines stays as it is.
  for (std::size_t i = 0; i < 7; ++i) m[i][i] += 1e-9 * m[i][i] + 1e-12;
  const std::array<double, 7> x = solved(m);
  const Vec3 turn{x[0], x[1], x[2]}, shift{x[3], x[4], x[5]};
  const double angle = length(turn);
  Closing c;
  if (angle > 0) c.motion = rotation_about(centre, turn / angle, angle);
  c.motion.shift_mm += shift;
  c.offset_mm = x[6];
  c.moved_mm = length(shift) + 80 * angle;
  return c;
}

}  // namespace osteo::inline imaging::registration
