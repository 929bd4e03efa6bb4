#include "osteo/display/view/detail/visible.h"

#include <gtest/gtest.h>

#include <cmath>

namespace osteo {
namespace {

// Looking down -z onto x, y in -1..1: clip = (x, y, -z) with z in -1..1.
constexpr std::array<double, 16> kDown{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1};

// A grid of n x n quads over -1..1 at a height.
struct Sheet {
  std::vector<float> points;
  std::vector<int> triangles;
  Sheet(int n, float z, bool up) {
    for (int j = 0; j <= n; ++j)
      for (int i = 0; i <= n; ++i)
        points.insert(points.end(), {-1 + 2.0F * static_cast<float>(i) / static_cast<float>(n),
                                     -1 + 2.0F * static_cast<float>(j) / static_cast<float>(n), z});
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        const int a = j * (n + 1) + i, b = a + 1, c = a + n + 2, d = a + n + 1;
        if (up)
          triangles.insert(triangles.end(), {a, b, c, a, c, d});
        else
          triangles.insert(triangles.end(), {a, c, b, a, d, c});
      }
  }
  [[nodiscard]] VisibleMesh mesh() const { return {points, triangles, kDown}; }
};

TEST(Visible, WhatLiesInFrontHidesWhatLiesBehind) {
  const Sheet near(100, 0.5F, true), far(100, -0.5F, true), turned_away(100, 0.9F, false);
  const VisibleMesh meshes[] = {far.mesh(), near.mesh(), turned_away.mesh()};
  const auto seen = visible_triangles(meshes, 200, 200);
  EXPECT_TRUE(seen[0].empty());
  EXPECT_EQ(seen[1].size(), 20000u);  // also those smaller than a pixel
  EXPECT_TRUE(seen[2].empty());
  EXPECT_EQ(seen, visible_triangles(meshes, 200, 200));
}

TEST(Visible, ThroughAHoleWhatIsBehindItIsSeen) {
  Sheet near(100, 0.5F, true);
  // Without the quads around the middle.
  std::vector<int> holed;
  for (std::size_t t = 0; t < near.triangles.size(); t += 3) {
    const float x = near.points[3 * static_cast<std::size_t>(near.triangles[t])],
                y = near.points[3 * static_cast<std::size_t>(near.triangles[t]) + 1];
    if (std::hypot(x, y) > 0.3F)
      holed.insert(holed.end(), near.triangles.begin() + static_cast<std::ptrdiff_t>(t),
                   near.triangles.begin() + static_cast<std::ptrdiff_t>(t) + 3);
  }
  near.triangles = holed;
  const Sheet far(50, -0.5F, true);
  const VisibleMesh meshes[] = {far.mesh(), near.mesh()};
  const auto seen = visible_triangles(meshes, 400, 400);
  // Area of the hole, and a ring of a pixel or a quad around it.
  const double share = static_cast<double>(seen[0].size()) / 5000;
  EXPECT_GT(share, 3.1416 * 0.09 / 4);
  EXPECT_LT(share, 3.1416 * 0.36 * 0.36 / 4);
  EXPECT_EQ(seen[1].size(), near.triangles.size() / 3);
}

}  // namespace
}  // namespace osteo
