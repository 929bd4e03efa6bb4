#include "osteo/geometry/tetgen/mesh_tetgen.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "meshes.h"
#include "osteo/core/base/error.h"
#include "osteo/core/data/tet_mesh.h"

namespace osteo {
namespace {

double volume_of_tet(const TetMesh& m, std::size_t t) {
  Vec3 p[4];
  for (std::size_t c = 0; c < 4; ++c) p[c] = from_floats(m.points_mm[m.tets[t][c]]);
  return dot(cross(p[1] - p[0], p[2] - p[0]), p[3] - p[0]) / 6;
}

TEST(Tetgen, FillsABoxAndKeepsItsSurface) {
  const Vec3 lo{-3, 2, 10}, hi{5, 8, 14};
  for (const double most : {0.0, 1.5}) {
    const TetMesh m = tets_by_tetgen(test::box(lo, hi), {most, 1.414, 0});
    double sum = 0;
    for (std::size_t t = 0; t < m.tets.size(); ++t) {
      const double v = volume_of_tet(m, t);
      ASSERT_GT(v, 0) << t;
      EXPECT_LE(v, most > 0 ? most * 1.0001 : 192.001) << t;
      sum += v;
    }
    EXPECT_NEAR(sum, 8.0 * 6 * 4, 1e-3);
    const TriMesh boundary = boundary_of(m);
    EXPECT_TRUE(check(boundary).watertight() && check(boundary).manifold());
    EXPECT_NEAR(area_mm2(boundary), 2 * (48 + 32 + 24), 1e-3);  // never moved
    EXPECT_GT(static_cast<double>(m.tets.size()), most > 0 ? 192 / most : 4);
  }
}

TEST(Tetgen, LeavesCavitiesEmptyAndFillsBodiesInBodies) {
  // A box in a box, turned, is a cavity; a ball beside it another body.
  const TriangleSoup outer = test::box({0, 0, 0}, {9, 9, 9}), inner = test::box({3, 3, 3}, {6, 6, 6});
  const TriangleSoup both = test::joined(test::joined(outer, test::turned(inner)), test::sphere(3, 2, {20, 4, 4}));
  const double ball = enclosed_volume_mm3(mesh_of(test::sphere(3, 2)));
  const TetMesh m = tets_by_tetgen(both, {2.0, 1.414, 0});
  EXPECT_NEAR(volume_mm3(m), 729 - 27 + ball, 0.01);
  for (std::size_t t = 0; t < m.tets.size(); ++t) ASSERT_GT(volume_of_tet(m, t), 0);
  require_sound(m);
  std::vector<bool> used(m.points_mm.size());
  for (const auto& t : m.tets)
    for (const auto p : t) used[p] = true;
  EXPECT_EQ(std::count(used.begin(), used.end(), false), 0);  // what filled the cavity is gone
  EXPECT_NEAR(volume_mm3(tets_by_tetgen(test::joined(outer, inner), {2.0, 1.414, 0})), 729, 0.01);
  // A body within the cavity is a body.
  const auto in_three = test::joined(test::joined(outer, test::turned(inner)), test::box({4, 4, 4}, {5, 5, 5}));
  EXPECT_NEAR(volume_mm3(tets_by_tetgen(in_three, {2.0, 1.414, 0})), 729 - 27 + 1, 0.01);
}

// What ended the program, or never ended: each an error with its reason, or a mesh of the right volume.
TEST(Tetgen, OutlivesWhatTetGenDoesNot) {
  using test::box, test::joined, test::sphere;
  struct Case {
    const char* name;
    TriangleSoup soup;
    double volume;
  };
  std::vector<Case> cases{
      {"touching in a face", joined(box({0, 0, 0}, {4, 4, 4}), box({4, 0, 0}, {8, 4, 4})), 128},
      {"touching in part of a face", joined(box({0, 0, 0}, {4, 4, 4}), box({4, 1, 1}, {8, 3, 3})), 80},
      {"touching in an edge", joined(box({0, 0, 0}, {4, 4, 4}), box({4, 4, 0}, {8, 8, 4})), 128},
      {"touching in a point", joined(box({0, 0, 0}, {4, 4, 4}), box({4, 4, 4}, {8, 8, 8})), 128},
      {"crossing", joined(sphere(5, 2), sphere(5, 2, {3, 0, 0})), 0},
      {"nested three times", joined(joined(sphere(9, 2), sphere(6, 2)), sphere(3, 2)),
       enclosed_volume_mm3(mesh_of(sphere(9, 2)))},
      {"a sliver", box({0, 0, 0}, {1e4, 1, 1e-4}), 1},
      {"tiny", test::moved(sphere(1, 2), 1e-12, {}), 0}};
  int meshed = 0;
  for (const Case& c : cases) {
    try {
      TetgenOptions o{0, 1.414, 0};
      o.limits.seconds = 5;
      const TetMesh m = tets_by_tetgen(c.soup, o);
      if (c.volume > 0) {
        EXPECT_NEAR(volume_mm3(m), c.volume, 1e-3 * c.volume) << c.name;
      }
      ++meshed;
    } catch (const Error& e) {
      EXPECT_TRUE(e.code() == ExitCode::failed || e.code() == ExitCode::resources) << c.name << ": " << e.what();
      EXPECT_FALSE(e.advice().empty()) << c.name;
    }
  }
  EXPECT_GE(meshed, 3);
  // Sizes that nobody has memory for are rejected before anything is done.
  try {
    static_cast<void>(tets_by_tetgen(box({0, 0, 0}, {4, 4, 4}), {1e-60, 1.414, 0}));
    ADD_FAILURE();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::resources);
  }
  // And what would take its time is stopped.
  TetgenOptions slow{2e-6, 1.414, 0};
  slow.limits.seconds = 0.2;
  try {
    static_cast<void>(tets_by_tetgen(box({0, 0, 0}, {4, 4, 4}), slow));
    ADD_FAILURE();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::resources);
    EXPECT_NE(std::string(e.what()).find("had not ended after 0.2 s"), std::string::npos) << e.what();
  }
}

TEST(Tetgen, SaysWhatItCannotMesh) {
  const auto refuses = [](const TriangleSoup& s, const std::string& why) {
    try {
      static_cast<void>(tets_by_tetgen(s, {1.0, 1.414, 0}));
      ADD_FAILURE() << "no error: " << why;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::failed);
      EXPECT_NE(std::string(e.what()).find(why), std::string::npos) << e.what();
      EXPECT_NE(e.advice().find("mesh-repair"), std::string::npos);
    }
  };
  TriangleSoup open = test::box({0, 0, 0}, {1, 1, 1});
  open.triangles.pop_back();
  refuses(open, "3 edges of this one are open");
  // TetGen 1.5.0 ends the program when it is given these.
  refuses(test::joined(test::box({0, 0, 0}, {4, 4, 4}), test::box({2.1, 2.2, 2.3}, {7, 7, 7})),
          "6 triangles of this one do");
  refuses(test::joined(test::sphere(5, 2), test::sphere(5, 2, {3, 0, 0})), "does not intersect itself");
}

}  // namespace
}  // namespace osteo
