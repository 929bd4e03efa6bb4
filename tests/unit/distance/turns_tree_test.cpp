// The hierarchy of turns against the sum over all triangles: values within their bound, decisions equal also next to
// one half.
#include "turns_tree.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "meshes.h"
#include "osteo/geometry/distance/distance_map.h"
#include "osteo/geometry/distance/voxelize.h"

namespace osteo {
namespace {

using test::joined, test::sphere;

std::vector<Fan> fans_of(const TriangleSoup& s) {
  std::vector<Fan> fans;
  for (const auto& t : s.triangles) fans.push_back({s.points_mm[t[0]], s.points_mm[t[1]], s.points_mm[t[2]], 1});
  return fans;
}

TriangleSoup loose(int count, double size, double weight_of_far = 1) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> u(-1, 1);
  TriangleSoup s;
  for (int i = 0; i < count; ++i) {
    const Vec3 at = Vec3{u(random), u(random), u(random)} * 20 * (i % 50 == 0 ? weight_of_far : 1);
    const auto n = static_cast<std::uint32_t>(s.points_mm.size());
    for (int k = 0; k < 3; ++k) s.points_mm.push_back(at + Vec3{u(random), u(random), u(random)} * size);
    s.triangles.push_back({n, n + 1, n + 2});
  }
  return s;
}

TriangleSoup without(TriangleSoup s, std::size_t every) {
  std::vector<std::array<std::uint32_t, 3>> kept;
  for (std::size_t t = 0; t < s.triangles.size(); ++t)
    if (t % every != 0) kept.push_back(s.triangles[t]);
  s.triangles = kept;
  return s;
}

std::vector<TriangleSoup> surfaces() {
  TriangleSoup open = sphere(10, 4);
  open.triangles.resize(open.triangles.size() * 3 / 5);
  TriangleSoup same = sphere(8, 2);  // every triangle five times
  for (int i = 0; i < 4; ++i) same = joined(same, sphere(8, 2));
  return {loose(700, 0.5),
          loose(400, 6),
          loose(300, 1, 1e4),
          open,
          without(sphere(10, 4), 40),
          joined(open, loose(100, 3)),
          same,
          test::moved(without(sphere(10, 3), 9), 1, {1e5, -1e5, 1e5})};
}

TEST(TurnsTree, ValuesAreWithinTheirBound) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(-0.2, 1.2);
  double most_used = 0;  // share of the bound
  for (const TriangleSoup& s : surfaces()) {
    const TurnsTree tree(fans_of(s));
    const BoxMm box = bounds_of(s);
    for (int i = 0; i < 150; ++i) {
      const Vec3 size = box.hi - box.lo, middle = (box.lo + box.hi) / 2;
      Vec3 p = box.lo + Vec3{u(random) * size.x, u(random) * size.y, u(random) * size.z};
      if (i % 3 == 0) p = middle + (p - middle) * 60;  // far: each order is a different power of the distance
      const double exact = tree.sum(p);
      for (const double tolerance : {10.0, 0.3, 1e-3, 1e-9}) {
        const TurnsTree::Turns t = tree.turns(p, tolerance);
        ASSERT_LE(std::abs(t.value - exact), t.error);
        ASSERT_LE(t.error, std::max(tolerance, 1e-6));
        if (t.error > 1e-4) most_used = std::max(most_used, std::abs(t.value - exact) / t.error);
      }
    }
  }
  EXPECT_GT(most_used, 0.01);  // the bound is not so wide that it says nothing
}

TEST(TurnsTree, DecidesAsTheSumDoesAlsoNextToOneHalf) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> u(-0.1, 1.1);
  int close = 0;
  for (const TriangleSoup& s : surfaces()) {
    const TurnsTree tree(fans_of(s));
    const BoxMm box = bounds_of(s);
    const auto any = [&] {
      const Vec3 size = box.hi - box.lo;
      return box.lo + Vec3{u(random) * size.x, u(random) * size.y, u(random) * size.z};
    };
    for (int i = 0; i < 150; ++i) {
      Vec3 p = any(), q = any();
      for (int winding = -2; winding <= 2; ++winding) {
        const auto expected = [&](Vec3 at) { return std::abs(winding - tree.sum(at)) > 0.5; };
        ASSERT_EQ(tree.beyond_half(winding, p), expected(p));
        if (i % 2 != 0 || expected(p) == expected(q)) continue;
        Vec3 in = p, out = q;  // halved until they are neighbours in double precision
        for (int step = 0; step < 52; ++step) {
          const Vec3 m = (in + out) / 2;
          ASSERT_EQ(tree.beyond_half(winding, m), expected(m));
          (expected(m) == expected(in) ? in : out) = m;
        }
        if (std::abs(std::abs(winding - tree.sum(in)) - 0.5) < 1e-9) ++close;
      }
    }
  }
  EXPECT_GT(close, 20);
}

TEST(TurnsTree, CrossesWhatEachOfItsTrianglesCrosses) {
  const TriangleSoup s = joined(sphere(10, 3), loose(300, 4));
  const TurnsTree tree(fans_of(s));
  std::vector<TurnsTree> single;
  for (const Fan& f : fans_of(s)) single.emplace_back(std::vector<Fan>{f});
  std::mt19937 random(6);
  std::uniform_real_distribution<double> u(-12, 12);
  for (int i = 0; i < 400; ++i) {
    // Also through corners and along edges.
    const Vec3 p = i % 2 == 0 ? Vec3{u(random), u(random), u(random)}
                              : s.points_mm[static_cast<std::size_t>(i)] + Vec3{i % 4 == 1 ? 1.0 : 0.0, 0, 0};
    int expected = 0;
    for (const TurnsTree& t : single) expected += t.crossings_before(p);
    ASSERT_EQ(tree.crossings_before(p), expected);
  }
}

TEST(TurnsTree, OfNothing) {
  const TurnsTree none({});
  EXPECT_TRUE(none.empty());
  EXPECT_FALSE(none.beyond_half(0, {1, 2, 3}));
  EXPECT_TRUE(none.beyond_half(-1, {1, 2, 3}));
  EXPECT_EQ(none.crossings_before({1, 2, 3}), 0);
}

TEST(SignedDistance, OfSoupsAsTheWindingNumber) {
  for (const TriangleSoup& s :
       {loose(900, 6), loose(500, 0.5), without(sphere(10, 4), 40), without(sphere(10, 4), 3)}) {
    const SignedDistance d(s);
    EXPECT_FALSE(d.closed());
    const TriangleSoup truth = ordered(s).soup;
    std::mt19937 random(9);
    std::uniform_real_distribution<double> u(-14, 14);
    for (int i = 0; i < 600; ++i) {
      const Vec3 p{u(random), u(random), u(random)};
      const double w = std::abs(winding_number(truth, p));
      if (std::abs(w - 0.5) < 1e-9) continue;
      ASSERT_EQ(d.inside(p), w > 0.5) << w;
    }
  }
}

}  // namespace
}  // namespace osteo
