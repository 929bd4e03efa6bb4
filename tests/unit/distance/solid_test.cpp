// What a surface bounds by the rule of the winding number, beside bodies whose volume is known.
#include "osteo/geometry/distance/solid.h"

#include <gtest/gtest.h>

#include "meshes.h"
#include "osteo/core/base/error.h"
#include "osteo/geometry/distance/voxelize.h"

namespace osteo {
namespace {

using test::box, test::joined, test::moved, test::sphere, test::turned;

TEST(Solid, NestedBodiesAndCavities) {
  const TriangleSoup outer = box({0, 0, 0}, {9, 9, 9}), inner = box({3, 3, 3}, {6, 6, 6});
  const SolidSurface both = solid_surface(joined(outer, inner));
  EXPECT_EQ(both.soup.triangles.size(), 12u);  // a body in a body changes nothing
  EXPECT_EQ(both.buried, 12u);
  EXPECT_NEAR(inside_volume_mm3(joined(outer, inner)), 729, 1e-9);
  const SolidSurface hollow = solid_surface(joined(outer, turned(inner)));
  EXPECT_EQ(hollow.soup.triangles.size(), 24u);
  EXPECT_EQ(hollow.buried, 0u);
  EXPECT_NEAR(inside_volume_mm3(joined(outer, turned(inner))), 729 - 27, 1e-9);
  // Inside out it is the same, and faces out afterwards.
  const SolidSurface mended = solid_surface(turned(joined(outer, turned(inner))));
  EXPECT_EQ(mended.turned, 24u);
  EXPECT_NEAR(inside_volume_mm3(turned(joined(outer, turned(inner)))), 702, 1e-9);
}

TEST(Solid, BodiesThatTouchInAWholeFaceBecomeOne) {
  const TriangleSoup two = joined(box({0, 0, 0}, {2, 2, 2}), box({2, 0, 0}, {4, 2, 2}));
  const SolidSurface one = solid_surface(two);
  EXPECT_EQ(one.soup.triangles.size(), 20u);  // the wall between them is gone
  EXPECT_TRUE(check(mesh_of(one.soup)).watertight());
  EXPECT_NEAR(inside_volume_mm3(two), 16, 1e-9);
  // Touching in an edge or a point they stay two.
  EXPECT_EQ(solid_surface(joined(box({0, 0, 0}, {2, 2, 2}), box({2, 2, 0}, {4, 4, 2}))).soup.triangles.size(), 24u);
}

TEST(Solid, ThinSheetsAndFarPlaces) {
  const TriangleSoup thin = box({0, 0, 0}, {100, 100, 1e-7});
  EXPECT_EQ(solid_surface(thin).soup.triangles.size(), 12u);
  EXPECT_NEAR(inside_volume_mm3(thin), 1e-3, 1e-12);
  const TriangleSoup far = moved(sphere(5, 3), 1, {1e6, -1e6, 1e6});
  EXPECT_NEAR(inside_volume_mm3(far), inside_volume_mm3(sphere(5, 3)), 1e-4);
  // The same surface there and back encloses nothing.
  TriangleSoup sheet = box({0, 0, 0}, {1, 1, 1});
  EXPECT_THROW(static_cast<void>(solid_surface(joined(sheet, turned(sheet)))), Error);
  EXPECT_EQ(inside_volume_mm3(joined(sheet, turned(sheet))), 0);
}

TEST(Solid, OverlapsCountOnce) {
  // Two balls a radius apart: V = 2 (4/3) pi r^3 - 5/12 pi r^3 of the smooth ones.
  const double ball = inside_volume_mm3(sphere(10, 4)), lens = 5.0 / 12 * std::numbers::pi * 1000;
  EXPECT_NEAR(inside_volume_mm3(joined(sphere(10, 4), sphere(10, 4, {10, 0, 0}))), 2 * ball - lens, 0.01 * ball);
}

TEST(Solid, ThinOverlapsAreNotCountedTwice) {
  // What overlaps is small beside the surface: three bars that cross, a needle through a plate, balls that just meet.
  const TriangleSoup bars =
      joined(joined(box({-20, -2, -2}, {20, 2, 2}), box({-2, -20, -2}, {2, 20, 2})), box({-2, -2, -20}, {2, 2, 20}));
  EXPECT_NEAR(inside_volume_mm3(bars), 3 * 640 - 2 * 64, 1);
  EXPECT_NEAR(inside_volume_mm3(turned(bars)), 3 * 640 - 2 * 64, 15);  // all of it counted in voxels
  const TriangleSoup plate = joined(box({0, 0, 0}, {40, 40, 1}), box({19.7, 19.7, -30}, {20.2, 20.2, 30}));
  EXPECT_NEAR(inside_volume_mm3(plate), 1600 + 15 - 0.25, 0.25);  // the overlap is two voxels wide
  const double ball = inside_volume_mm3(sphere(10, 4)), cap = std::numbers::pi / 3 * 0.25 * 0.25 * (30 - 0.25);
  EXPECT_NEAR(inside_volume_mm3(joined(sphere(10, 4), sphere(10, 4, {19.5, 0, 0}))), 2 * ball - 2 * cap,
              0.05 * cap + 0.5);
  // And a body of many triangles without overlap is exact, however much surface it has.
  TriangleSoup comb;
  for (int i = 0; i < 60; ++i) comb = joined(comb, box({i * 1.0, 0, 0}, {i + 0.43, 60, 60}));
  EXPECT_NEAR(inside_volume_mm3(comb), 60 * 0.43 * 3600, 1e-6);
}

}  // namespace
}  // namespace osteo
