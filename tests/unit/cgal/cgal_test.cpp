#include "osteo/geometry/cgal/mesh_cgal.h"

#include <gtest/gtest.h>

#include <cmath>

#include "meshes.h"
#include "osteo/core/base/error.h"
#include "osteo/geometry/distance/solid.h"
#include "osteo/geometry/mesh/mesh_info.h"

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
  const TriangleSoup closed = holes_closed(holed, 200, r);
  EXPECT_EQ(r.holes_filled, open);
  EXPECT_EQ(r.holes_left, 0u);
  EXPECT_TRUE(summarize(mesh_of(closed)).watertight);
  EXPECT_NEAR(enclosed_volume_mm3(mesh_of(closed)), volume, 0.02 * volume);
  const TriangleSoup small_only = holes_closed(holed, 3, r);
  EXPECT_EQ(r.holes_left, 1u);
  EXPECT_EQ(r.holes_filled, 1u) << "of this call alone";
  EXPECT_FALSE(summarize(mesh_of(small_only)).watertight);
  static_cast<void>(holes_closed(holed, 0, r));
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
  const TriangleSoup mended = intersections_resolved(s, r);
  ASSERT_GT(r.self_intersections_before, 0u);
  EXPECT_EQ(r.self_intersections_after, self_intersections(mended).size());
  EXPECT_EQ(r.self_intersections_after, 0u);
  EXPECT_TRUE(summarize(mesh_of(mended)).watertight);
}

TEST(Cgal, ResolvesOverlapsWithoutLosingBodies) {
  CgalRepairReport r;
  // Two boxes that cross: 64 + 27 - what they share.
  const TriangleSoup crossed = test::joined(test::box({0, 0, 0}, {4, 4, 4}), test::box({3, 3, 3}, {6, 6, 6}));
  TriangleSoup one = intersections_resolved(crossed, r);
  EXPECT_GT(r.self_intersections_before, 0u);
  EXPECT_EQ(r.self_intersections_after, 0u);
  EXPECT_TRUE(check(mesh_of(one)).watertight());
  EXPECT_NEAR(enclosed_volume_mm3(mesh_of(one)), 64 + 27 - 1, 1e-4);
  // Two that touch in a part of a face: one body, the wall gone.
  one = intersections_resolved(test::joined(test::box({0, 0, 0}, {4, 4, 4}), test::box({4, 1, 1}, {8, 3, 3})), r);
  EXPECT_EQ(r.self_intersections_after, 0u);
  EXPECT_TRUE(check(mesh_of(one)).watertight());
  EXPECT_NEAR(enclosed_volume_mm3(mesh_of(one)), 64 + 16, 1e-4);
  EXPECT_NEAR(area_mm2(mesh_of(one)), 96 + 2 * 4 + 4 * 8 - 2 * 4, 1e-3);
  // A head and a body joined by overlap, as statues are: nothing is lost.
  const TriangleSoup statue = test::joined(test::sphere(10, 3), test::sphere(4, 3, {0, 0, 12}));
  const double expected = inside_volume_mm3(statue);
  one = intersections_resolved(statue, r);
  EXPECT_EQ(r.self_intersections_after, 0u);
  EXPECT_TRUE(summarize(mesh_of(one)).watertight);
  EXPECT_NEAR(enclosed_volume_mm3(mesh_of(one)), expected, 0.01 * expected);
  double top = 0;
  for (const Vec3& p : one.points_mm) top = std::max(top, p.z);
  EXPECT_NEAR(top, 16, 0.1);
  // Three through one place, a body whose faces coincide with another's, and one that has nothing to resolve.
  const auto three = test::joined(test::joined(test::box({-1, -1, -5}, {1, 1, 5}), test::box({-1, -5, -1}, {1, 5, 1})),
                                  test::box({-5, -1, -1}, {5, 1, 1}));
  one = intersections_resolved(three, r);
  EXPECT_EQ(r.self_intersections_after, 0u);
  EXPECT_NEAR(enclosed_volume_mm3(mesh_of(one)), 3 * 40 - 2 * 8, 1e-4);
  EXPECT_TRUE(check(mesh_of(one)).watertight());
  EXPECT_EQ(intersections_resolved(test::sphere(3, 2), r).triangles.size(), test::sphere(3, 2).triangles.size());
}

// Slabs through one middle, each turned by its own angles: every face is cut by all the others, and where three meet is
// computed from cuts of cuts. What is counted in the end is what a file holds, in single precision.
TEST(Cgal, ManyThroughOnePlaceEndAndAreCountedAsWritten) {
  TriangleSoup all;
  for (int i = 0; i < 6; ++i) {
    TriangleSoup slab = test::box({-10, -8, -1}, {10, 8, 1});
    const double a = 0.7 * i + 0.1, b = 1.1 * i + 0.3;
    for (Vec3& p : slab.points_mm) {
      p = {p.x * std::cos(a) - p.y * std::sin(a), p.x * std::sin(a) + p.y * std::cos(a), p.z};
      p = {p.x, p.y * std::cos(b) - p.z * std::sin(b), p.y * std::sin(b) + p.z * std::cos(b)};
    }
    all = i == 0 ? slab : test::joined(all, slab);
  }
  all = soup_of(mesh_of(all));
  const double volume = inside_volume_mm3(all);
  CgalRepairReport r;
  const TriangleSoup one = intersections_resolved(all, r);
  EXPECT_GT(r.self_intersections_before, 100u);
  const TriangleSoup written = soup_of(mesh_of(one));
  EXPECT_EQ(self_intersections(written).size(), r.self_intersections_after);
  EXPECT_EQ(r.self_intersections_after, 0u);
  EXPECT_TRUE(check(mesh_of(one)).watertight());
  EXPECT_NEAR(enclosed_volume_mm3(mesh_of(one)), volume, 0.01 * volume);
}

// Triangles that have nothing to do with each other: it ends, and either says that they enclose nothing or leaves what
// it counts.
TEST(Cgal, SoupOfTrianglesEnds) {
  TriangleSoup soup;
  std::uint32_t state = 7;
  const auto next = [&] { return (state = state * 1664525U + 1013904223U) / 4294967296.0; };
  for (std::uint32_t t = 0; t < 25; ++t) {
    for (int i = 0; i < 3; ++i) {
      const double x = next(), y = next(), z = next();
      soup.points_mm.push_back({x, y, z});
    }
    soup.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  soup = soup_of(mesh_of(soup));
  CgalRepairReport r;
  try {
    const TriangleSoup one = intersections_resolved(soup, r);
    EXPECT_EQ(self_intersections(soup_of(mesh_of(one))).size(), r.self_intersections_after);
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::failed);
  }
  EXPECT_GT(r.self_intersections_before, 20u);
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

TEST(Cgal, LeavesCavitiesEmptyAndFillsBodiesInBodies) {
  CgalMeshOptions o;
  o.cell_mm = 1.5;
  o.optimise = false;
  const double large = enclosed_volume_mm3(mesh_of(test::sphere(6, 3))),
               small = enclosed_volume_mm3(mesh_of(test::sphere(3, 3)));
  EXPECT_NEAR(volume_mm3(tets_by_cgal(test::joined(test::sphere(6, 3), test::turned(test::sphere(3, 3))), o)),
              large - small, 0.05 * large);
  EXPECT_NEAR(volume_mm3(tets_by_cgal(test::joined(test::sphere(6, 3), test::sphere(3, 3)), o)), large, 0.05 * large);
  o.cell_mm = 1e-20;
  try {
    static_cast<void>(tets_by_cgal(test::sphere(6, 2), o));
    ADD_FAILURE();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::resources);
  }
  o.cell_mm = 0.05;
  o.limits.seconds = 0.5;
  EXPECT_THROW(static_cast<void>(tets_by_cgal(test::sphere(6, 3), o)), Error);
}

TEST(Cgal, SaysWhatItCannotMesh) {
  TriangleSoup open = test::box({0, 0, 0}, {4, 4, 4});
  open.triangles.pop_back();
  EXPECT_THROW(static_cast<void>(tets_by_cgal(open, {})), Error);
  const auto crossed = test::joined(test::box({0, 0, 0}, {4, 4, 4}), test::box({2.1, 2.2, 2.3}, {7, 7, 7}));
  EXPECT_THROW(static_cast<void>(tets_by_cgal(crossed, {})), Error);
  // Two balls that meet in a point: it does not end, is stopped, and was said before.
  CgalMeshOptions brief;
  brief.cell_mm = 2;
  brief.limits.seconds = 2;
  std::string reported;
  Context context;
  context.on_log(
      [&](LogLevel level, std::string_view message) { reported += level == LogLevel::warning ? message : ""; });
  EXPECT_THROW(static_cast<void>(
                   tets_by_cgal(test::joined(test::sphere(10, 3), test::sphere(10, 3, {20, 0, 0})), brief, context)),
               Error);
  EXPECT_NE(reported.find("touches itself at 1 points"), std::string::npos) << reported;
}

}  // namespace
}  // namespace osteo
