// Summary and repair of surfaces.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <random>
#include <utility>
#include <vector>

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

// Edges counted in a map, fans by walking from triangle to triangle.
MeshCheck counted_plainly(const TriMesh& m) {
  MeshCheck c;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::pair<int, int>> edges;  // uses, forward ones
  for (const auto& t : m.triangles) {
    if (t[0] == t[1] || t[1] == t[2] || t[0] == t[2]) {
      ++c.degenerate;
      continue;
    }
    for (std::size_t e = 0; e < 3; ++e) {
      const auto a = t[e], b = t[(e + 1) % 3];
      auto& [uses, forward] = edges[{std::min(a, b), std::max(a, b)}];
      ++uses;
      forward += a < b ? 1 : 0;
    }
  }
  for (const auto& [edge, count] : edges) {
    c.open_edges += count.first == 1 ? 1 : 0;
    c.nonmanifold_edges += count.first > 2 ? 1 : 0;
    c.misoriented_edges += count.first >= 2 && 2 * count.second != count.first ? 1 : 0;
  }
  for (std::uint32_t v = 0; v < m.points_mm.size(); ++v) {
    std::vector<std::array<std::uint32_t, 3>> around;
    for (const auto& t : m.triangles) {
      for (const auto corner : t) {
        if (corner == v) around.push_back(t);
      }
    }
    std::vector<bool> met(around.size());
    std::vector<std::size_t> open;
    if (!around.empty()) met[0] = true, open.push_back(0);
    while (!open.empty()) {
      const auto t = around[open.back()];
      open.pop_back();
      for (std::size_t n = 0; n < around.size(); ++n) {
        int shared = 0;
        for (const auto a : t) shared += static_cast<int>(std::count(around[n].begin(), around[n].end(), a));
        if (met[n] || shared < 2) continue;
        met[n] = true;
        open.push_back(n);
      }
    }
    c.nonmanifold_points += std::count(met.begin(), met.end(), false) > 0 ? 1 : 0;
  }
  return c;
}

TEST(MeshCheck, CountsAsPlainly) {
  std::mt19937 random(3);
  for (int round = 0; round < 300; ++round) {
    TriMesh m;
    const std::uint32_t points = 4 + random() % 8;
    m.points_mm.resize(points);
    if (round % 3 == 0) m.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};  // a closed one to begin with
    const std::uint32_t more = random() % 14;
    for (std::uint32_t t = 0; t < more; ++t)
      m.triangles.push_back({static_cast<std::uint32_t>(random() % points),
                             static_cast<std::uint32_t>(random() % points),
                             static_cast<std::uint32_t>(random() % points)});
    const MeshCheck is = check(m), wanted = counted_plainly(m);
    ASSERT_EQ(is.open_edges, wanted.open_edges) << round;
    ASSERT_EQ(is.nonmanifold_edges, wanted.nonmanifold_edges) << round;
    ASSERT_EQ(is.misoriented_edges, wanted.misoriented_edges) << round;
    ASSERT_EQ(is.nonmanifold_points, wanted.nonmanifold_points) << round;
    ASSERT_EQ(is.degenerate, wanted.degenerate) << round;
  }
}

}  // namespace
}  // namespace osteo
