#include "osteo/tetgen/mesh_tetgen.h"

#include <gtest/gtest.h>

#include "meshes.h"
#include "osteo/base/error.h"

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

TEST(Tetgen, FollowsHollowsAndSeveralBodies) {
  // A box in a box, turned, is a cavity; a ball beside it another body.
  const auto shell = test::joined(test::box({0, 0, 0}, {9, 9, 9}), test::turned(test::box({3, 3, 3}, {6, 6, 6})));
  const TriangleSoup both = test::joined(shell, test::sphere(3, 2, {20, 4, 4}));
  const double ball = enclosed_volume_mm3(mesh_of(test::sphere(3, 2)));
  const TetMesh m = tets_by_tetgen(both, {2.0, 1.414, 0});
  EXPECT_NEAR(volume_mm3(m), 729 + ball, 0.01);  // TetGen is given no hole: it fills cavities
  for (std::size_t t = 0; t < m.tets.size(); ++t) ASSERT_GT(volume_of_tet(m, t), 0);
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
  refuses(test::joined(test::box({0, 0, 0}, {4, 4, 4}), test::box({2.1, 2.2, 2.3}, {7, 7, 7})), "6 triangles of this one do");
  refuses(test::joined(test::sphere(5, 2), test::sphere(5, 2, {3, 0, 0})), "does not intersect itself");
}

}  // namespace
}  // namespace osteo
