// Summary and repair of surfaces.
#include <gtest/gtest.h>

#include "meshes.h"
#include "osteo/core/base/error.h"
#include "osteo/geometry/mesh/mesh_info.h"

namespace osteo {
namespace {

using test::box, test::joined, test::sphere, test::turned;

TEST(MeshInfo, OfASphere) {
  const MeshSummary s = summarize(mesh_of(sphere(10, 3)));
  EXPECT_TRUE(s.watertight && s.manifold);
  EXPECT_EQ(s.bodies, 1U);
  EXPECT_EQ(s.euler, 2);
  EXPECT_EQ(s.open_edges + s.holes + s.degenerate + s.duplicates + s.zero_area + s.needles + s.caps + s.inward_bodies,
            0U);
  EXPECT_NEAR(s.volume_mm3, 4 / 3.0 * std::numbers::pi * 1000, 60);
  EXPECT_NEAR(s.area_mm2, 4 * std::numbers::pi * 100, 10);
}

TEST(MeshInfo, CountsWhatIsWrong) {
  TriMesh m = mesh_of(joined(sphere(10, 2), turned(box({20, 0, 0}, {25, 5, 5}))));
  m.triangles.push_back(m.triangles[0]);  // duplicate
  m.triangles.push_back({1, 1, 2});       // degenerate
  m.points_mm.push_back({NAN, 0, 0});
  m.triangles.push_back({0, 1, static_cast<std::uint32_t>(m.points_mm.size() - 1)});
  m.triangles.push_back({0, 1, 99999});
  m.points_mm.push_back({500, 500, 500});       // unused
  m.triangles.erase(m.triangles.begin() + 40);  // a hole
  const MeshSummary s = summarize(m);
  EXPECT_EQ(s.duplicates, 1U);
  EXPECT_EQ(s.degenerate, 1U);
  EXPECT_EQ(s.non_finite_points, 1U);
  EXPECT_EQ(s.bad_indices, 1U);
  EXPECT_EQ(s.unused_points, 1U);
  EXPECT_EQ(s.open_edges, 3U);
  EXPECT_EQ(s.holes, 1U);
  EXPECT_EQ(s.bodies, 2U);
  EXPECT_FALSE(s.watertight);
}

TEST(MeshInfo, NeedlesAndCaps) {
  TriMesh m;
  m.points_mm = {{0, 0, 0}, {10, 0, 0}, {10, 0.01F, 0}, {5, 0.001F, 0}, {5, 0, 0}};
  m.triangles = {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}};
  const MeshSummary s = summarize(m);
  EXPECT_EQ(s.needles, 1U);
  EXPECT_EQ(s.caps, 2U);
  EXPECT_EQ(s.zero_area, 1U);
}

TEST(Repair, MakesASoupASolid) {
  TriangleSoup s = test::unwelded(sphere(10, 2));
  for (std::size_t i = 0; i < s.triangles.size(); i += 3) std::swap(s.triangles[i][0], s.triangles[i][1]);
  s.triangles.push_back(s.triangles[5]);
  RepairReport r;
  const TriMesh m = mesh_of(repaired(mesh_of(s), {}, r));
  const MeshCheck c = check(m);
  EXPECT_TRUE(c.watertight() && c.manifold());
  EXPECT_GT(enclosed_volume_mm3(m), 3900);
  EXPECT_EQ(r.duplicates, 1U);
  EXPECT_GT(r.flipped, 0U);
  EXPECT_EQ(m.points_mm.size(), sphere(10, 2).points_mm.size());
}

TEST(Repair, TurnsBodiesButLeavesCavities) {
  RepairReport r;
  const TriMesh m = mesh_of(repaired(
      mesh_of(joined(joined(sphere(10, 2), turned(sphere(5, 2))), turned(box({20, 0, 0}, {25, 5, 5})))), {}, r));
  EXPECT_EQ(r.turned_bodies, 1U);
  const double shell = 4 / 3.0 * std::numbers::pi * (1000 - 125);
  EXPECT_NEAR(enclosed_volume_mm3(m), shell + 125, 0.05 * shell);
}

TEST(Repair, WeldsDropsAndKeeps) {
  TriangleSoup s = test::unwelded(sphere(10, 2));
  for (std::size_t i = 0; i < s.points_mm.size(); ++i) s.points_mm[i] += Vec3{1e-5 * (i % 3), -1e-5 * (i % 2), 0};
  RepairReport r;
  EXPECT_FALSE(check(mesh_of(repaired(mesh_of(s), {}, r))).watertight());
  EXPECT_TRUE(check(mesh_of(repaired(mesh_of(s), {.weld_mm = 1e-3}, r))).watertight());
  const TriMesh two = mesh_of(joined(sphere(10, 2), box({20, 0, 0}, {21, 1, 1})));
  EXPECT_EQ(summarize(mesh_of(repaired(two, {.keep_largest = true}, r))).bodies, 1U);
  EXPECT_EQ(summarize(mesh_of(repaired(two, {.min_body_area_mm2 = 7}, r))).bodies, 1U);
  EXPECT_THROW((void)repaired(two, {.min_body_area_mm2 = 1e9}, r), Error);
  TriMesh bad = two;
  bad.points_mm[0][0] = NAN;
  EXPECT_THROW((void)repaired(bad, {.drop_unsound = false}, r), Error);
  EXPECT_GT(mesh_of(repaired(bad, {}, r)).triangles.size(), 300U);
  EXPECT_GT(r.unsound, 0U);
}

}  // namespace
}  // namespace osteo
