#include "osteo/cgal/mesh_cgal.h"

#include <gtest/gtest.h>

#include "meshes.h"
#include "osteo/base/error.h"
#include "osteo/mesh/mesh_info.h"

namespace osteo {
namespace {

TEST(Cgal, CountsJustThePairsThatIntersect) {
  EXPECT_TRUE(self_intersections(test::box({0, 0, 0}, {1, 1, 1})).empty());
  EXPECT_TRUE(self_intersections(test::sphere(5, 3)).empty());
  // Two triangles through each other, a third beside them.
  TriangleSoup s;
  s.points_mm = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {1, 1, -1}, {1, 1, 1}, {1, 5, 0}, {9, 9, 9}, {10, 9, 9}, {9, 10, 9}};
  s.triangles = {{0, 1, 2}, {6, 7, 8}, {3, 4, 5}};
  const auto pairs = self_intersections(s);
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_EQ(pairs[0], (std::pair<std::uint32_t, std::uint32_t>{0, 2}));
  // Touching in a shared edge or point is none; a point that only lies on a face is one.
  s.points_mm = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {4, 4, 0}, {1, 1, 0}, {1, 1, 3}, {2, 1, 3}};
  s.triangles = {{0, 1, 2}, {1, 3, 2}};
  EXPECT_TRUE(self_intersections(s).empty());
  s.triangles.push_back({4, 5, 6});
  EXPECT_EQ(self_intersections(s).size(), 1u);
}

TEST(Cgal, ClosesHolesUpToASize) {
  const TriangleSoup whole = test::sphere(10, 3);
  const double volume = enclosed_volume_mm3(mesh_of(whole));
  TriangleSoup holed = whole;
  // A triangle, and all that lie in a cap.
  std::erase_if(holed.triangles, [&, n = 0](const auto& t) mutable {
    return n++ == 100 || std::min({holed.points_mm[t[0]].z, holed.points_mm[t[1]].z, holed.points_mm[t[2]].z}) > 8.5;
  });
  const std::uint64_t open = summarize(mesh_of(holed)).holes;
  ASSERT_EQ(open, 2u);
  CgalRepairReport r;
  const TriangleSoup closed = repaired_by_cgal(holed, 200, false, r);
  EXPECT_EQ(r.holes_filled, open);
  EXPECT_EQ(r.holes_left, 0u);
  EXPECT_TRUE(summarize(mesh_of(closed)).watertight);
  EXPECT_NEAR(enclosed_volume_mm3(mesh_of(closed)), volume, 0.02 * volume);
  const TriangleSoup small_only = repaired_by_cgal(holed, 3, false, r);
  EXPECT_EQ(r.holes_left, 1u);
  EXPECT_EQ(r.holes_filled, 1u) << "of this call alone";
  EXPECT_FALSE(summarize(mesh_of(small_only)).watertight);
  static_cast<void>(repaired_by_cgal(holed, 0, false, r));
  EXPECT_EQ(r.holes_filled, 0u);
  EXPECT_EQ(r.holes_left, open);
}

TEST(Cgal, TakesOutSelfIntersections) {
  // A dent pushed through the far side of a small stretch.
  TriangleSoup s = test::sphere(10, 3);
  for (Vec3& p : s.points_mm) {
    if (p.z > 9.4) p.z -= 3.5;
  }
  const auto spike = test::joined(s, test::box({-1, -1, -1}, {1, 1, 1}));  // a body inside: no intersection
  ASSERT_TRUE(self_intersections(spike).size() == self_intersections(s).size());
  for (Vec3& p : s.points_mm) {
    if (p.x > 9.6) p = p * 0.2 + Vec3{0, 0, 0.0};
    if (p.x < -9.7) p.x = 14;
  }
  CgalRepairReport r;
  const TriangleSoup mended = repaired_by_cgal(s, 200, true, r);
  ASSERT_GT(r.self_intersections_before, 0u);
  EXPECT_EQ(r.self_intersections_after, self_intersections(mended).size());
  EXPECT_EQ(r.self_intersections_after, 0u);
  EXPECT_TRUE(summarize(mesh_of(mended)).watertight);
}

TEST(Cgal, MeshesABallWithinItsBounds) {
  const TriangleSoup ball = test::sphere(6, 4, {1, 2, 3});
  const double volume = enclosed_volume_mm3(mesh_of(ball));
  CgalMeshOptions o;
  o.cell_mm = 1.5;
  o.optimise = false;
  const TetMesh m = tets_by_cgal(ball, o);
  EXPECT_NEAR(volume_mm3(m), volume, 0.05 * volume);
  const TriMesh boundary = boundary_of(m);
  EXPECT_TRUE(check(boundary).watertight());
  for (const auto& p : boundary.points_mm) EXPECT_NEAR(length(from_floats(p) - Vec3{1, 2, 3}), 6, 0.15 + 0.03);
  for (const auto& t : m.tets) {
    Vec3 p[4];
    for (std::size_t c = 0; c < 4; ++c) p[c] = from_floats(m.points_mm[t[c]]);
    ASSERT_GT(dot(cross(p[1] - p[0], p[2] - p[0]), p[3] - p[0]), 0);
    for (int c = 1; c < 4; ++c) EXPECT_LE(length(p[c] - p[0]), 2 * 1.5 * 1.01);  // no edge longer than its circumsphere
  }
  // Twice the same.
  const TetMesh again = tets_by_cgal(ball, o);
  ASSERT_EQ(again.tets.size(), m.tets.size());
  EXPECT_TRUE(std::equal(m.tets.begin(), m.tets.end(), again.tets.begin()));
}

TEST(Cgal, SaysWhatItCannotMesh) {
  TriangleSoup open = test::box({0, 0, 0}, {4, 4, 4});
  open.triangles.pop_back();
  EXPECT_THROW(static_cast<void>(tets_by_cgal(open, {})), Error);
  const auto crossed = test::joined(test::box({0, 0, 0}, {4, 4, 4}), test::box({2.1, 2.2, 2.3}, {7, 7, 7}));
  EXPECT_THROW(static_cast<void>(tets_by_cgal(crossed, {})), Error);
}

}  // namespace
}  // namespace osteo
