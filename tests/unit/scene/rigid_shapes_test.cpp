// What soft tissue meets of the tool.
#include "rigid_shapes.h"

#include <gtest/gtest.h>

#include "osteo/simulation/bone/burr.h"

namespace osteo {
namespace {

TEST(ToolShape, BallsFillEachHeadFromEndToEnd) {
  const Vec3 at{3, -2, 7}, axis = normalized(Vec3{1, 2, -0.5});
  for (const Burr& burr : burr_library()) {
    const RoundCone head = burr.head();
    const ToolShape shape(head, at, axis);
    const auto balls = shape.balls();
    const double apart = 0.25 * std::min(head.start_radius_mm, head.end_radius_mm) + 1e-9;
    ASSERT_FALSE(balls.empty()) << burr.name();
    EXPECT_NEAR(length(balls.front().centre_mm - (at + axis * head.start_mm)), 0, 1e-9) << burr.name();
    EXPECT_NEAR(length(balls.back().centre_mm - (at + axis * (head.start_mm + head.length_mm))), 0, 1e-9)
        << burr.name();
    for (std::size_t b = 0; b < balls.size(); ++b) {
      // On the axis, and as large as fits: to a cone's slope, which a ball inside touches beside its middle.
      Vec3 outwards;
      EXPECT_LE(shape.distance_mm(balls[b].centre_mm, outwards), -0.9 * balls[b].radius_mm) << burr.name();
      if (b > 0) {
        EXPECT_LE(length(balls[b].centre_mm - balls[b - 1].centre_mm), apart) << burr.name();
      }
    }
  }
}

}  // namespace
}  // namespace osteo
