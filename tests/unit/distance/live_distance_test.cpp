// The live map equals a new one after any edit.
#include <gtest/gtest.h>

#include <random>

#include "meshes.h"
#include "osteo/core/base/error.h"
#include "osteo/geometry/distance/detail/live_distance.h"

namespace osteo {
namespace {

TEST(LiveDistance, EqualsARebuildAfterEveryEdit) {
  TriangleSoup s = test::sphere(10, 4);
  const Frame f = frame_around_mm(s, 0.5, 8);
  const double reach = 2.5;
  const InsideAt inside = [&](int i, int j, int k) {
    return length(f.world_from_index({double(i), double(j), double(k)})) < 10;
  };
  LiveDistance live(s, f, reach, inside);
  std::vector<std::array<Vec3, 3>> all;
  std::vector<std::uint8_t> alive;
  for (const auto& t : s.triangles)
    all.push_back({s.points_mm[t[0]], s.points_mm[t[1]], s.points_mm[t[2]]}), alive.push_back(1);
  std::mt19937 random(6);
  for (int step = 0; step < 8; ++step) {
    // A dent: triangles in a ball move inward; the last steps only take away.
    const Vec3 centre = normalized(Vec3{std::sin(step * 2.1), std::cos(step * 1.3), std::sin(step * 0.7 + 1)}) * 10;
    std::vector<std::uint32_t> removed;
    std::vector<std::array<Vec3, 3>> added;
    for (std::uint32_t t = 0; t < all.size(); ++t) {
      if (alive[t] == 0 || length(all[t][0] - centre) > 2) continue;
      removed.push_back(t);
      alive[t] = 0;
      if (step < 6) added.push_back({all[t][0] * 0.93, all[t][1] * 0.93, all[t][2] * 0.93});
    }
    EXPECT_EQ(live.update(removed, added, inside), all.size());
    for (const auto& t : added) all.push_back(t), alive.push_back(1);
    TriangleSoup now;
    for (std::uint32_t t = 0; t < all.size(); ++t) {
      if (alive[t] == 0) continue;
      const auto n = static_cast<std::uint32_t>(now.points_mm.size());
      now.points_mm.insert(now.points_mm.end(), all[t].begin(), all[t].end());
      now.triangles.push_back({n, n + 1, n + 2});
    }
    const TriangleTree tree(now);
    std::uint64_t stored = 0;
    for (int k = 0; k < f.dims[2]; ++k) {
      for (int j = 0; j < f.dims[1]; ++j) {
        for (int i = 0; i < f.dims[0]; ++i) {
          const Vec3 p = f.world_from_index({double(i), double(j), double(k)});
          const double d = tree.closest(p).distance_mm;
          const LiveDistance::Sample sample = live.at(i, j, k);
          if (std::abs(d - reach) < 1e-9) continue;
          ASSERT_EQ(sample.stored(), d < reach) << step << ' ' << d;
          if (!sample.stored()) continue;
          ++stored;
          ASSERT_NEAR(std::abs(sample.distance_mm), d, 1e-12);
          ASSERT_EQ(sample.distance_mm < 0, inside(i, j, k));
          ASSERT_TRUE(alive[sample.triangle]);
        }
      }
    }
    EXPECT_GT(stored, 10000U);
    EXPECT_LT(live.touched(), stored / 3);
  }
  const std::vector<std::uint32_t> gone{0xffffff};
  EXPECT_THROW(live.update(gone, {}, inside), Error);
}

TEST(LiveDistance, FromNothingToNothing) {
  Frame f;
  f.dims = {20, 20, 20};
  const InsideAt outside = [](int, int, int) { return false; };
  LiveDistance live({}, f, 3, outside);
  EXPECT_FALSE(live.at(10, 10, 10).stored());
  const std::vector<std::array<Vec3, 3>> one{{Vec3{9, 9, 10}, Vec3{11, 9, 10}, Vec3{10, 11, 10}}};
  const std::uint32_t id = live.update({}, one, outside);
  EXPECT_NEAR(live.at(10, 10, 12).distance_mm, 2, 1e-15);
  const std::vector<std::uint32_t> removed{id};
  live.update(removed, {}, outside);
  EXPECT_FALSE(live.at(10, 10, 12).stored());
}

}  // namespace
}  // namespace osteo
