// How far apart two surfaces are, where that is known exactly.
#include <gtest/gtest.h>

#include <algorithm>

#include "meshes.h"
#include "osteo/geometry/distance/compare.h"

namespace osteo {
namespace {

using test::box, test::joined, test::moved, test::sphere, test::turned;

TEST(CompareSurfaces, ASurfaceIsNoDistanceFromItselfAndThatIsProven) {
  const SurfaceComparison one = compare_surfaces(sphere(10, 2), sphere(10, 2));
  EXPECT_LT(one.hausdorff_mm(), 1e-12);
  EXPECT_LT(one.hausdorff_bound_mm(), 1e-12);
  // Where bodies cross, what is nearest may be another triangle: to the tolerance, a ten thousandth of the extents.
  const TriangleSoup crossing = joined(box({0, 0, 0}, {100, 1, 0.1}), sphere(3, 1));
  const SurfaceComparison two = compare_surfaces(crossing, crossing);
  EXPECT_LT(two.hausdorff_mm(), 1e-12);
  EXPECT_LT(two.hausdorff_bound_mm(), 1.1e-2);
}

TEST(CompareSurfaces, AShiftIsFoundExactly) {
  // What is outermost along the shift is farther from the other by all of it, whatever the shape.
  for (const Vec3 by : {Vec3{0.3, -0.2, 0.1}, Vec3{0, 0, 30}}) {
    for (const TriangleSoup& s : {sphere(10, 3), turned(box({0, 0, 0}, {9, 8, 7}))}) {
      const SurfaceComparison there = compare_surfaces(s, moved(s, 1, by)), back = compare_surfaces(moved(s, 1, by), s);
      EXPECT_NEAR(there.a_to_b.max_mm, length(by), 1e-12);
      EXPECT_NEAR(there.b_to_a.max_mm, length(by), 1e-12);
      EXPECT_GE(there.hausdorff_bound_mm(), there.hausdorff_mm());
      EXPECT_EQ(there.a_to_b.max_mm, back.b_to_a.max_mm);
      EXPECT_EQ(there.a_to_b.mean_mm, back.b_to_a.mean_mm);
    }
  }
}

TEST(CompareSurfaces, TheMaximumIsNeverBelowASampleHoweverLargeTheSurface) {
  // Of a kilometre a ten thousandth is 100 mm: what is farther than the mean, but not by that, is found as well.
  TriangleSoup flat = box({0, 0, 0}, {1e6, 1e6, 1e3}), bent = flat;
  bent.points_mm.back() += {0, 0, 50};
  const SurfaceComparison c = compare_surfaces(bent, flat);
  EXPECT_NEAR(c.a_to_b.max_mm, 50, 1e-9);
  EXPECT_LE(c.a_to_b.p95_mm, c.a_to_b.max_mm);
  EXPECT_GT(c.a_to_b.mean_mm, 0);
}

}  // namespace
}  // namespace osteo
