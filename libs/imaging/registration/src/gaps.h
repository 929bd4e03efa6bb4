// The small motion that closes gaps along normals.
#pragma once
#include <array>
#include <vector>

#include "osteo/core/data/rigid_transform.h"

namespace osteo::inline imaging::registration {

/// A point, a direction, and how far the point lies too far along it.
struct Gap {
  Vec3 at_mm, normal;
  double mm = 0;
};
struct Closing {
  RigidTransform motion;
  double offset_mm = 0;  // what all gaps have in common, which no motion closes
  double moved_mm = 0;   // by the motion, at 80 mm from the middle
};
/// Least squares over turn, shift and offset (small turns). At least seven gaps.
[[nodiscard]] Closing close_gaps(const std::vector<Gap>& gaps);

}  // namespace osteo::inline imaging::registration
