// The exact distance map against brute force and geometry, on hard cases too.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <random>

#include "folders.h"
#include "meshes.h"
#include "osteo/core/base/error.h"
#include "osteo/geometry/distance/distance_map.h"
#include "osteo/geometry/distance/distance_methods.h"

namespace osteo {
namespace {

using test::box, test::joined, test::moved, test::sphere, test::turned;

double brute_force(const TriangleSoup& s, Vec3 p) {
  double d = 1e300;
  for (const auto& t : s.triangles)
    d = std::min(d, closest_on_triangle(p, s.points_mm[t[0]], s.points_mm[t[1]], s.points_mm[t[2]]).distance_mm);
  return d;
}

// An independent point-triangle distance: long double, by the regions of C. Ericson, Real-Time Collision Detection,
// section 5.1.5.
long double reference(Vec3 pp, Vec3 aa, Vec3 bb, Vec3 cc) {
  using L = long double;
  struct V {
    L x, y, z;
  };
  const auto v = [](Vec3 a) { return V{a.x, a.y, a.z}; };
  const auto sub = [](V a, V b) { return V{a.x - b.x, a.y - b.y, a.z - b.z}; };
  const auto dot_l = [](V a, V b) { return a.x * b.x + a.y * b.y + a.z * b.z; };
  const auto at = [](V a, V d, L t) { return V{a.x + d.x * t, a.y + d.y * t, a.z + d.z * t}; };
  const V p = v(pp), a = v(aa), b = v(bb), c = v(cc), ab = sub(b, a), ac = sub(c, a), ap = sub(p, a);
  const auto away = [&](V q) { return std::sqrt(dot_l(sub(p, q), sub(p, q))); };
  const L d1 = dot_l(ab, ap), d2 = dot_l(ac, ap);
  if (d1 <= 0 && d2 <= 0) return away(a);
  const V bp = sub(p, b);
  const L d3 = dot_l(ab, bp), d4 = dot_l(ac, bp);
  if (d3 >= 0 && d4 <= d3) return away(b);
  const L vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return away(at(a, ab, d1 / (d1 - d3)));
  const V cp = sub(p, c);
  const L d5 = dot_l(ab, cp), d6 = dot_l(ac, cp);
  if (d6 >= 0 && d5 <= d6) return away(c);
  const L vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return away(at(a, ac, d2 / (d2 - d6)));
  const L va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return away(at(b, sub(c, b), (d4 - d3) / ((d4 - d3) + (d5 - d6))));
  const L denominator = 1 / (va + vb + vc);
  const V q = at(at(a, ab, vb * denominator), ac, vc * denominator);
  return away(q);
}

struct Worst {
  double distance_voxels = 0;
  std::uint64_t wrong_sign = 0, compared = 0;
};

// Every `step`th voxel of a map against brute force, and its sign against the winding number of `truth`.
Worst compare(const DistanceMap& map, const TriangleSoup& soup, const TriangleSoup& truth, int step) {
  Worst w;
  const double voxel = std::cbrt(map.frame.voxel_volume_mm3());
  std::uint64_t n = 0;
  for (std::size_t b = 0; b < map.bricks.size(); ++b) {
    for (int v = 0; v < 512; ++v) {
      const double d = map.distance_mm[b * 512 + v];
      if ((map.stored[b * 8 + v / 64] >> (v % 64) & 1) == 0) {
        EXPECT_TRUE(std::isnan(d));
        continue;
      }
      if (n++ % step != 0) continue;
      const Ijk o = map.bricks[b];
      const Vec3 p = map.frame.world_from_index({o.i * 8. + (v & 7), o.j * 8. + (v >> 3 & 7), o.k * 8. + (v >> 6)});
      const double expected = brute_force(soup, p);
      w.distance_voxels = std::max(w.distance_voxels, std::abs(std::abs(d) - expected) / voxel);
      // On the surface a sign means nothing.
      if (expected > 1e-6 * voxel && (d < 0) != (std::abs(winding_number(truth, p)) > 0.5)) ++w.wrong_sign;
      // The triangle named is a nearest one.
      const auto& t = soup.triangles[map.triangle[b * 512 + v]];
      EXPECT_NEAR(closest_on_triangle(p, soup.points_mm[t[0]], soup.points_mm[t[1]], soup.points_mm[t[2]]).distance_mm,
                  expected, 1e-9 * voxel);
      ++w.compared;
    }
  }
  return w;
}

TEST(PointTriangle, AgreesWithLongDoubleOnAllKindsOfTriangles) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> u(-1, 1);
  double worst = 0;
  for (int i = 0; i < 20000; ++i) {
    Vec3 a{u(random), u(random), u(random)}, b{u(random), u(random), u(random)}, c{u(random), u(random), u(random)};
    const Vec3 p{2 * u(random), 2 * u(random), 2 * u(random)};
    switch (i % 8) {
      case 1:
        c = a + (b - a) * 0.3 + Vec3{0, 0, 1e-5};
        break;  // cap
      case 2:
        c = b + Vec3{1e-6, 2e-6, 0};
        break;  // needle
      case 3:
        c = a + (b - a) * 0.5 + Vec3{u(random), u(random), u(random)} * 1e-9;
        break;  // nearly a segment
      case 4:
        b = a + Vec3{1e-3, 0, 0}, c = a + Vec3{0, 1e-3, 0};
        break;
      default:
        break;
    }
    const double d = closest_on_triangle(p, a, b, c).distance_mm;
    const auto r = static_cast<double>(reference(p, a, b, c));
    worst = std::max(worst, std::abs(d - r));
  }
  EXPECT_LT(worst, 3e-10);
  // Without area: segments and points.
  EXPECT_NEAR(closest_on_triangle({0, 1, 0}, {-1, 0, 0}, {1, 0, 0}, {0, 0, 0}).distance_mm, 1, 1e-15);
  EXPECT_NEAR(closest_on_triangle({3, 4, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}).distance_mm, 5, 1e-15);
  EXPECT_EQ(closest_on_triangle({0, 0, 2}, {-1, -1, 0}, {1, -1, 0}, {0, 1, 0}).feature, Feature::face);
  EXPECT_EQ(closest_on_triangle({-3, -3, 0}, {-1, -1, 0}, {1, -1, 0}, {0, 1, 0}).feature, Feature::corner_a);
  EXPECT_EQ(closest_on_triangle({0, -3, 0}, {-1, -1, 0}, {1, -1, 0}, {0, 1, 0}).feature, Feature::edge_ab);
  EXPECT_EQ(closest_on_triangle({3, 1.5, 0}, {-1, -1, 0}, {1, -1, 0}, {0, 1, 0}).feature, Feature::edge_bc);
}

TEST(TriangleTree, FindsTheNearestWhateverTheHint) {
  const TriangleSoup s = joined(sphere(10, 4), box({20, -5, -5}, {30, 5, 5}));
  const TriangleTree tree(s);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(-40, 40);
  for (int i = 0; i < 300; ++i) {
    const Vec3 p{u(random), u(random), u(random)};
    const double expected = brute_force(s, p);
    for (const std::uint32_t hint : {0U, 1000U, ClosestPoint::kNone, 0xfffffff0U}) {
      const ClosestPoint c = tree.closest(p, hint);
      EXPECT_NEAR(c.distance_mm, expected, 1e-12);
      EXPECT_NEAR(length(c.point_mm - p), expected, 1e-12);
    }
    EXPECT_EQ(tree.closest(p, 0).triangle, tree.closest(p, 4000).triangle);
    EXPECT_EQ(tree.closest(p, ClosestPoint::kNone, expected * 0.99).triangle, ClosestPoint::kNone);
  }
}

TEST(DistanceMap, OfASphereIsTheRadiusLessTheDistance) {
  const TriangleSoup s = sphere(20, 5);
  Frame f = frame_around(s, 50, 4);
  const DistanceMap map = DistanceMapper(s, f).map();
  EXPECT_EQ(map.count(), f.voxel_count());
  double worst = 0;
  for (int k = 0; k < f.dims[2]; ++k) {
    for (int j = 0; j < f.dims[1]; ++j) {
      for (int i = 0; i < f.dims[0]; ++i) {
        const std::int64_t at = map.find(i, j, k);
        ASSERT_GE(at, 0);
        const double r = length(f.world_from_index({double(i), double(j), double(k)}));
        worst = std::max(worst, std::abs(map.distance_mm[static_cast<std::size_t>(at)] - (r - 20)));
      }
    }
  }
  EXPECT_LT(worst, 0.02);  // how far the triangles' middles lie below the sphere: 20 * (1 - cos(angle of an edge)/2)
}

TEST(DistanceMap, IsExactAndSignedOnHardCases) {
  const TriangleSoup ball = sphere(10, 3);
  TriangleSoup open = ball;
  open.triangles.resize(open.triangles.size() * 9 / 10);
  TriangleSoup duplicated = ball;
  for (std::size_t i = 0; i < ball.triangles.size(); i += 10) duplicated.triangles.push_back(ball.triangles[i]);
  TriangleSoup reversed = ball;
  for (std::size_t i = 0; i < ball.triangles.size(); i += 10)
    reversed.triangles.push_back({ball.triangles[i][0], ball.triangles[i][2], ball.triangles[i][1]});
  TriangleSoup flipped = ball;
  for (std::size_t i = 0; i < ball.triangles.size(); i += 5)
    std::swap(flipped.triangles[i][0], flipped.triangles[i][1]);
  TriangleSoup needles = ball;
  for (std::size_t i = 0; i < 200; ++i) {
    const auto t = ball.triangles[i];
    const auto n = static_cast<std::uint32_t>(needles.points_mm.size());
    needles.points_mm.push_back((ball.points_mm[t[0]] + ball.points_mm[t[1]]) * 0.5 * (1 + 1e-9));
    needles.triangles.push_back({t[0], t[1], n});
    needles.triangles.push_back({t[1], t[0], n});
    needles.triangles.push_back({t[0], t[0], t[2]});
    needles.triangles.push_back({n, n, n});
  }
  TriangleSoup stray = ball;
  stray.points_mm.push_back({1e9, 1e9, 1e9});
  TriangleSoup single;
  single.points_mm = {{0, 0, 0}, {10, 0, 0}, {0, 10, 0}};
  single.triangles = {{0, 1, 2}};
  TriangleSoup fin = box({0, 0, 0}, {10, 10, 0.02});
  struct Case {
    const char* name;
    TriangleSoup soup, truth;
  };
  const Case cases[] = {
      {"ball", ball, ball},
      {"grid points on faces, edges and corners", box({0, 0, 0}, {10, 10, 10}), box({0, 0, 0}, {10, 10, 10})},
      {"open cap", open, open},
      {"duplicated triangles", duplicated, ball},
      {"duplicated the other way round", reversed, ball},
      {"needles, zero area, points", needles, ball},
      {"two bodies that intersect", joined(ball, sphere(8, 3, {9, 1, 0})), joined(ball, sphere(8, 3, {9, 1, 0}))},
      {"cavity", joined(ball, turned(sphere(6, 2))), joined(ball, turned(sphere(6, 2)))},
      {"nested shells, both out", joined(ball, sphere(6, 2)), joined(ball, sphere(6, 2))},
      {"touching boxes", joined(box({0, 0, 0}, {5, 10, 10}), box({5, 0, 0}, {10, 10, 10})),
       box({0, 0, 0}, {10, 10, 10})},
      {"boxes that share an edge", joined(box({0, 0, 0}, {5, 5, 10}), box({5, 5, 0}, {10, 10, 10})),
       joined(box({0, 0, 0}, {5, 5, 10}), box({5, 5, 0}, {10, 10, 10}))},
      {"far away", moved(ball, 1, {1e6, -1e6, 1e6}), moved(ball, 1, {1e6, -1e6, 1e6})},
      {"tiny", moved(ball, 1e-6, {}), moved(ball, 1e-6, {})},
      {"very tiny", moved(ball, 1e-10, {}), moved(ball, 1e-10, {})},
      {"huge", moved(ball, 1e6, {}), moved(ball, 1e6, {})},
      {"a fifth of the triangles flipped", flipped, ball},
      {"inside out", turned(ball), ball},
      {"no shared points", test::unwelded(ball), ball},
      {"unused point far away", stray, ball},
      {"thin plate", fin, fin},
      {"one triangle", single, single},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.name);
    const bool box_like = std::string(c.name).find("grid points") == 0 || std::string(c.name).find("touching") == 0;
    Frame f = frame_around(c.soup, box_like ? 20 : 23, 3);
    if (box_like) f.origin_mm = f.origin_mm - f.spacing_mm * 0.5;  // voxel centres on the faces
    for (const DistanceRegion region : {DistanceRegion::box, DistanceRegion::interior, DistanceRegion::band}) {
      const double h = f.spacing_mm.x;
      const DistanceMapper mapper(c.soup, f);
      const DistanceMap map = mapper.map({region, 2 * h, 3 * h});
      const Worst w = compare(map, c.soup, c.truth, region == DistanceRegion::box ? 13 : 5);
      EXPECT_LT(w.distance_voxels, std::string(c.name) == "far away" ? 2e-9 : 1e-12) << w.compared;
      EXPECT_EQ(w.wrong_sign, 0U) << "of " << w.compared;
      if (region == DistanceRegion::band) {
        for (const double d : map.distance_mm) EXPECT_TRUE(std::isnan(d) || (d >= -2 * h && d <= 3 * h));
      }
    }
  }
}

TEST(DistanceMap, BandAndInteriorAreTheBoxesRestricted) {
  const TriangleSoup s = joined(sphere(10, 3), sphere(4, 2, {18, 3, 1}));
  const Frame f = frame_around(s, 60, 5);
  const DistanceMapper mapper(s, f);
  const DistanceMap all = mapper.map(), band = mapper.map({DistanceRegion::band, 1.7, 2.3}),
                    in = mapper.map({DistanceRegion::interior});
  std::uint64_t near = 0, inside = 0;
  for (std::size_t b = 0; b < all.bricks.size(); ++b) {
    for (int v = 0; v < 512; ++v) {
      const double d = all.distance_mm[b * 512 + v];
      if (std::isnan(d)) continue;
      const Ijk o = all.bricks[b];
      const int i = o.i * 8 + (v & 7), j = o.j * 8 + (v >> 3 & 7), k = o.k * 8 + (v >> 6);
      const auto check_in = [&](const DistanceMap& m, bool expected) {
        const std::int64_t at = m.find(i, j, k);
        ASSERT_EQ(at >= 0, expected) << d;
        if (!expected) return;
        EXPECT_EQ(m.distance_mm[at], d);
        EXPECT_EQ(m.triangle[at], all.triangle[b * 512 + v]);
      };
      check_in(band, d < 0 ? -d <= 1.7 : d <= 2.3);
      check_in(in, mapper.inside().at(i, j, k));
      near += d < 0 ? -d <= 1.7 : d <= 2.3;
      inside += mapper.inside().at(i, j, k);
    }
  }
  EXPECT_EQ(band.count(), near);
  EXPECT_EQ(in.count(), inside);
}

TEST(DistanceMap, ObliqueAnisotropicAndLeftHandedFrames) {
  const TriangleSoup s = sphere(10, 3, {3, 4, 5});
  Frame f;
  f.dims = {40, 31, 22};
  f.spacing_mm = {0.7, 0.9, 1.3};
  const Vec3 x = normalized({0.9, 0.3, -0.1}), y = normalized(cross(Vec3{0, 0.2, 1}, x));
  for (const double hand : {1.0, -1.0}) {
    f.direction = {{x, y, cross(x, y) * hand}};
    f.origin_mm = Vec3{3, 4, 5} - f.direction * Vec3{20 * 0.7, 15 * 0.9, 11 * 1.3};
    const Worst w = compare(DistanceMapper(s, f).map(), s, s, 29);
    EXPECT_LT(w.distance_voxels, 1e-12);
    EXPECT_EQ(w.wrong_sign, 0U);
  }
}

TEST(DistanceMap, OneTreeServesSeveralFramesOfItsAxes) {
  const TriangleSoup s = joined(sphere(10, 3), turned(sphere(5, 3, {1, 0, 0})));
  Frame f = frame_around(s, 30, 3);
  const Vec3 x = normalized({0.9, 0.3, -0.1}), y = normalized(cross(Vec3{0, 0.2, 1}, x));
  EXPECT_THROW(DistanceMapper(s, TriangleTree(s, Mat3{{x, y, cross(x, y)}}, {}), f), Error);
  f.direction = {{x, y, cross(x, y)}};
  f.origin_mm = f.direction * f.origin_mm;
  const TriangleTree tree(s, f.direction, {});
  for (const double scale : {1.0, 2.0}) {
    f.spacing_mm = f.spacing_mm * scale;
    const DistanceMap own = DistanceMapper(s, f).map(), shared = DistanceMapper(s, tree, f).map();
    EXPECT_EQ(own.triangle, shared.triangle);
    EXPECT_EQ(std::memcmp(own.distance_mm.data(), shared.distance_mm.data(), own.distance_mm.size() * 8), 0);
  }
}

TEST(DistanceMap, SameBytesForAnyThreads) {
  const TriangleSoup s = joined(sphere(10, 4), turned(sphere(5, 3, {1, 0, 0})));
  const Frame f = frame_around(s, 70, 3);
  Context one, two;
  one.threads = 1;
  two.threads = 2;
  const DistanceMap a = DistanceMapper(s, f, one).map({}, one), b = DistanceMapper(s, f, two).map({}, two);
  EXPECT_EQ(a.triangle, b.triangle);
  EXPECT_EQ(a.stored, b.stored);
  ASSERT_EQ(a.distance_mm.size(), b.distance_mm.size());
  EXPECT_EQ(std::memcmp(a.distance_mm.data(), b.distance_mm.data(), a.distance_mm.size() * 8), 0);
}

TEST(DistanceMap, GridFarLargerThanTheSurface) {
  const TriangleSoup s = joined(sphere(1, 3), sphere(0.7, 3, {1.2, 0.4, 0.3}));
  Frame f;
  f.dims = {40, 36, 33};
  f.spacing_mm = {30, 30, 30};
  f.origin_mm = {-500, -700, -300};
  const Worst w = compare(DistanceMapper(s, f).map(), s, s, 17);
  EXPECT_LT(w.distance_voxels, 1e-12);
  EXPECT_EQ(w.wrong_sign, 0U);
}

TEST(DistanceMap, CoarseVoxelsOnManyTriangles) {
  const TriangleSoup s = sphere(10, 6);  // 81,920 triangles, 8 voxels across
  const Frame f = frame_around(s, 8, 2);
  const Worst w = compare(DistanceMapper(s, f).map(), s, s, 40);
  EXPECT_LT(w.distance_voxels, 1e-12);
  EXPECT_EQ(w.wrong_sign, 0U);
}

TEST(DistanceMap, RefusesWhatCannotBeMeasured) {
  TriangleSoup s = sphere(10, 1);
  s.points_mm[5].y = std::numeric_limits<double>::quiet_NaN();
  const auto message = [](const TriangleSoup& soup) {
    try {
      TriangleTree tree(soup);
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string("accepted");
  };
  EXPECT_NE(message(s).find("point 5 "), std::string::npos);
  s.points_mm[5].y = std::numeric_limits<double>::infinity();
  EXPECT_NE(message(s).find("point 5 "), std::string::npos);
  TriangleSoup none;
  EXPECT_NE(message(none).find("no triangles"), std::string::npos);
  TriangleSoup bad = sphere(10, 1);
  bad.triangles[7][1] = 4000;
  EXPECT_NE(message(bad).find("triangle 7 "), std::string::npos);
}

TEST(DistanceMap, CanBeCancelled) {
  const TriangleSoup s = sphere(10, 4);
  Context context;
  const std::atomic<bool> stop{true};
  context.set_cancel_flag(&stop);
  EXPECT_THROW(DistanceMapper(s, frame_around(s, 60, 2), context), Error);
}

TEST(VoxelsInside, MillionsOfTrianglesInBoundedMemory) {
  const TriangleSoup s = sphere(10, 8);  // 1.3 million
  const Frame f = frame_around(s, 40, 1);
  const VoxelBits bits = voxels_inside(s, f);
  double expected = 0;
  for (int k = 0; k < f.dims[2]; ++k) {
    for (int j = 0; j < f.dims[1]; ++j) {
      for (int i = 0; i < f.dims[0]; ++i)
        expected += length(f.world_from_index({double(i), double(j), double(k)})) < 9.9995;
    }
  }
  EXPECT_NEAR(static_cast<double>(bits.count()), expected, 40);
}

TEST(VoxelsInside, NeverLeaksWhereRowsMeetCornersAndEdges) {
  // A box whose corners, edges and diagonals lie on voxel centres, in all positions of the grid.
  for (int shift = 0; shift < 8; ++shift) {
    const TriangleSoup s = box({0, 0, 0}, {8, 8, 8});
    Frame f;
    f.dims = {14, 14, 14};
    f.origin_mm = {-3 + 0.5 * (shift & 1), -3 + 0.5 * (shift >> 1 & 1), -3 + 0.5 * (shift >> 2)};
    const VoxelBits bits = voxels_inside(s, f);
    const VoxelBits again = voxels_inside(test::unwelded(s), f);
    EXPECT_EQ(bits.words, again.words);
    for (int k = 0; k < 14; ++k) {
      for (int j = 0; j < 14; ++j) {
        for (int i = 0; i < 14; ++i) {
          const Vec3 p = f.world_from_index({double(i), double(j), double(k)});
          const double least = std::min({p.x, p.y, p.z, 8 - p.x, 8 - p.y, 8 - p.z});
          EXPECT_TRUE(least == 0 || bits.at(i, j, k) == (least > 0)) << i << ' ' << j << ' ' << k;
        }
      }
    }
  }
}

TEST(VoxelsInside, LooseTrianglesByTheWindingNumber) {
  // A sphere in pieces, some of them away: open edges everywhere.
  std::mt19937 random(8);
  TriangleSoup s = test::unwelded(sphere(10, 2));
  std::uniform_real_distribution<double> u(-0.6, 0.6);
  for (std::size_t t = 0; t < s.triangles.size(); ++t) {
    const Vec3 by{u(random), u(random), u(random)};
    for (const auto v : s.triangles[t]) s.points_mm[v] += by;
  }
  s.triangles.resize(s.triangles.size() * 4 / 5);
  const Frame f = frame_around(s, 34, 3);
  const VoxelBits bits = voxels_inside(s, f);
  int inside = 0;
  for (int k = 0; k < f.dims[2]; ++k) {
    for (int j = 0; j < f.dims[1]; ++j) {
      for (int i = 0; i < f.dims[0]; ++i) {
        const double w = std::abs(winding_number(s, f.world_from_index({double(i), double(j), double(k)})));
        ASSERT_TRUE(std::abs(w - 0.5) < 1e-8 || bits.at(i, j, k) == (w > 0.5)) << w;
        inside += bits.at(i, j, k) ? 1 : 0;
      }
    }
  }
  EXPECT_GT(inside, 5000);
}

TEST(SignedDistance, AgreesWithTheWindingNumber) {
  TriangleSoup open = sphere(10, 3);
  open.triangles.resize(open.triangles.size() * 4 / 5);
  const TriangleSoup cases[] = {sphere(10, 3), open, joined(sphere(10, 3), turned(sphere(5, 2))), turned(sphere(10, 2)),
                                test::unwelded(box({-6, -6, -6}, {7, 8, 9}))};
  std::mt19937 random(11);
  std::uniform_real_distribution<double> u(-13, 13);
  for (const TriangleSoup& s : cases) {
    const SignedDistance d(s);
    for (int i = 0; i < 400; ++i) {
      const Vec3 p{u(random), u(random), u(random)};
      const double w = std::abs(winding_number(s, p));
      if (std::abs(w - 0.5) < 1e-9) continue;
      EXPECT_EQ(d.at(p).signed_mm<0, w> 0.5) << w;
    }
  }
  EXPECT_TRUE(SignedDistance(cases[0]).closed());
  EXPECT_FALSE(SignedDistance(open).closed());
}

// To the bit, whatever neighbour told a point where to look and on which side it is.
TEST(SignedDistance, ManyTogetherAreAsEachAlone) {
  TriangleSoup open = sphere(10, 3), far = moved(sphere(10, 3), 1, {1e6, -2e6, 3e6}), small = sphere(10, 3);
  open.triangles.resize(open.triangles.size() * 4 / 5);
  for (Vec3& p : small.points_mm) p = p * 1e-6;
  const TriangleSoup cases[] = {sphere(10, 3),
                                open,
                                far,
                                small,
                                joined(sphere(10, 3), turned(sphere(5, 2))),
                                joined(sphere(10, 2), moved(sphere(10, 2), 1, {20, 0, 0})),
                                joined(box({-6, -6, -6}, {7, 8, 9}), box({-1e-7, -20, -20}, {1e-7, 20, 20})),
                                test::unwelded(box({-6, -6, -6}, {7, 8, 9}))};
  std::mt19937 random(23);
  for (const TriangleSoup& s : cases) {
    Vec3 lo = s.points_mm.front(), hi = lo;
    for (const Vec3 p : s.points_mm) {
      for (std::size_t a = 0; a < 3; ++a) lo[a] = std::min(lo[a], p[a]), hi[a] = std::max(hi[a], p[a]);
    }
    const Vec3 size = hi - lo;
    std::uniform_real_distribution<double> u(-0.3, 1.3), tiny(-1e-9, 1e-9);
    std::vector<Vec3> points;
    for (int i = 0; i < 3000; ++i)
      points.push_back(lo + Vec3{u(random) * size.x, u(random) * size.y, u(random) * size.z});
    // On corners and edges, a hair beside the surface, twice at one place, far away.
    for (const auto& t : s.triangles) {
      const Vec3 a = s.points_mm[t[0]], b = s.points_mm[t[1]], c = s.points_mm[t[2]];
      const Vec3 middle = (a + b + c) / 3;
      points.insert(points.end(), {a, (a + b) / 2, middle, middle + size * tiny(random), middle + size * tiny(random)});
    }
    points.push_back(points.front());
    points.push_back(hi + size * 1e6);
    const SignedDistance d(s);
    Context two;
    two.threads = 2;
    const auto together = d.at(points), shared = d.at(points, two);
    ASSERT_EQ(together.size(), points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto alone = d.at(points[i]);
      for (const auto* const answer : {&together[i], &shared[i]}) {
        ASSERT_EQ(answer->closest.distance_mm, alone.closest.distance_mm) << i;
        ASSERT_EQ(answer->closest.triangle, alone.closest.triangle) << i;
        ASSERT_EQ(answer->closest.feature, alone.closest.feature) << i;
        ASSERT_EQ(answer->closest.point_mm, alone.closest.point_mm) << i;
        ASSERT_EQ(std::signbit(answer->signed_mm), std::signbit(alone.signed_mm)) << i;
      }
    }
  }
  EXPECT_TRUE(SignedDistance(cases[0]).at(std::span<const Vec3>()).empty());
}

TEST(ThesisDistance, CorrectedIsExactAndAsPrintedIsNot) {
  const TriangleSoup s = joined(sphere(10, 3), box({14, -4, -4}, {20, 4, 4}));
  const Frame f = frame_around(s, 24, 2);
  std::vector<Vec3> points;
  for (int k = 0; k < f.dims[2]; k += 2) {
    for (int j = 0; j < f.dims[1]; j += 2) {
      for (int i = 0; i < f.dims[0]; ++i) points.push_back(f.world_from_index({double(i), double(j), double(k)}));
    }
  }
  const ThesisDistance thesis(s);
  const TriangleTree tree(s);
  for (const int ascend : {-1, 0, 3}) {
    for (const bool breadth : {false, true}) {
      const auto d = thesis.distances_mm(points, {ascend, breadth, false});
      for (std::size_t i = 0; i < points.size(); ++i) ASSERT_NEAR(d[i], tree.closest(points[i]).distance_mm, 1e-12);
    }
  }
  const auto printed = thesis.distances_mm(points, {0, false, true});
  int wrong = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double exact = tree.closest(points[i]).distance_mm;
    EXPECT_GE(printed[i], exact - 1e-12);
    wrong += printed[i] > exact + 1e-6;
  }
  EXPECT_GT(wrong, static_cast<int>(points.size()) / 20);
}

TEST(SweptDistance, IsNeverBelowAndNearlyExact) {
  const TriangleSoup s = joined(sphere(10, 3), box({14, -4, -4}, {20, 4, 4}));
  const Frame f = frame_around(s, 40, 4);
  const std::vector<double> d = swept_distance_mm(s, f);
  const TriangleTree tree(s);
  double worst = 0;
  std::size_t at = 0;
  for (int k = 0; k < f.dims[2]; ++k) {
    for (int j = 0; j < f.dims[1]; ++j) {
      for (int i = 0; i < f.dims[0]; ++i, ++at) {
        const double exact = tree.closest(f.world_from_index({double(i), double(j), double(k)})).distance_mm;
        ASSERT_GE(d[at], exact - 1e-9);
        worst = std::max(worst, (d[at] - exact) / f.spacing_mm.x);
      }
    }
  }
  EXPECT_LT(worst, 0.1);
}

TEST(RealMeshes, ExactAndSigned) {
  const auto paths = test::real_meshes();
  if (paths.empty()) GTEST_SKIP() << "no real meshes in " << shared_data();
  std::mt19937 random(5);
  for (const auto& path : paths) {
    SCOPED_TRACE(path.filename().string());
    const TriangleSoup s = soup_of(*load_surface(path));
    const Frame f = frame_around(s, 40, 2);
    const DistanceMapper mapper(s, f);
    const DistanceMap map = mapper.map();
    ASSERT_EQ(map.count(), f.voxel_count());
    const Ordered o = ordered(s);
    for (int n = 0; n < 60; ++n) {
      const int i = static_cast<int>(random() % f.dims[0]), j = static_cast<int>(random() % f.dims[1]),
                k = static_cast<int>(random() % f.dims[2]);
      const Vec3 p = f.world_from_index({double(i), double(j), double(k)});
      const std::int64_t at = map.find(i, j, k);
      const double expected = brute_force(s, p);
      EXPECT_NEAR(std::abs(map.distance_mm[at]), expected, 2e-12 * f.spacing_mm.x + 1e-15 * length(p));
      // Closed in sum: the winding number of the surface as it is. Otherwise of the one that was put in order.
      const double w = std::abs(winding_number(mapper.inside_report().closed && is_closed(s) ? s : o.soup, p));
      const bool decided = std::abs(w - 0.5) > 1e-6 && expected > 1e-6 * f.spacing_mm.x;
      EXPECT_TRUE(!decided || (map.distance_mm[at] < 0) == (w > 0.5)) << w;
    }
  }
}

}  // namespace
}  // namespace osteo
