// The curve constraint: exact against all segments, and the cases that the thesis draws.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "osteo/core/base/error.h"
#include "osteo/geometry/mesh/curve.h"

namespace osteo {
namespace {

// A dense look at the whole curve: every segment in 400 steps, then finer around the best.
double brute_score(const std::vector<Vec3>& points, Vec3 p, double arc, double penalty) {
  double best = 1e300, at = 0;
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    const double l = length(points[i + 1] - points[i]);
    const auto score = [&](double t) {
      return length(points[i] + (points[i + 1] - points[i]) * t - p) + penalty * std::abs(at + t * l - arc);
    };
    double lo = 0, hi = 1;
    for (int k = 0; k < 60; ++k) {  // convex in t
      const double a = lo + (hi - lo) / 3, b = hi - (hi - lo) / 3;
      if (score(a) < score(b)) {
        hi = b;
      } else {
        lo = a;
      }
    }
    best = std::min({best, score(lo), score(0), score(1)});
    at += l;
  }
  return best;
}

std::vector<Vec3> tangle(int n, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> u(-1, 1);
  std::vector<Vec3> points;
  Vec3 p, v{1, 0, 0};
  for (int i = 0; i < n; ++i) {
    v = normalized(v + Vec3{u(random), u(random), u(random)} * 0.4 - p * 0.02);
    p += v * (0.05 + 0.5 * (i % 7));
    points.push_back(p);
    if (i % 50 == 3) points.push_back(p);  // equal neighbours
  }
  return points;
}

TEST(Curve, TheNearestOfAllSegments) {
  const std::vector<Vec3> points = tangle(700, 1);
  const Curve curve(points);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> u(-20, 20);
  std::uint32_t hint = 0;
  for (int i = 0; i < 60; ++i) {
    const Vec3 p{u(random), u(random), u(random)};
    for (const double penalty : {0.0, 0.05, 0.3, 1.0, 2.5}) {
      const double arc = curve.length_mm() * (i % 10) / 9;
      const CurvePoint c = curve.nearest_from(p, arc, penalty, hint);
      hint = c.segment;
      EXPECT_NEAR(c.score_mm, brute_score(points, p, arc, penalty), 1e-8);
      EXPECT_NEAR(c.distance_mm, length(c.point_mm - p), 1e-12);
      EXPECT_NEAR(c.score_mm, c.distance_mm + penalty * std::abs(c.arc_mm - arc), 1e-12);
      EXPECT_LT(length(curve.at_arc(c.arc_mm).point_mm - c.point_mm), 1e-9);
    }
  }
}

// Figure 45: a long segment passes nearer than the sample points of another branch.
TEST(Curve, SparseSamplingDoesNotMislead) {
  const std::vector<Vec3> points{{-10, 3, 0}, {-5, 0, 0}, {5, 0, 0}, {6, 4, 0}, {0, 3, 0}, {-6, 6, 0}};
  const CurvePoint c = Curve(points).nearest({0, 1.2, 0});
  EXPECT_EQ(c.segment, 1U);
  EXPECT_NEAR(c.distance_mm, 1.2, 1e-12);
}

// Figure 46: the hand strays through another branch and is still held by its own.
TEST(Curve, APenaltyOnTheWayKeepsTheBranch) {
  const std::vector<Vec3> points{{-10, 3, 0}, {-5, 0, 0}, {5, 0, 0}, {30, 4, 0}, {30, 30, 0}, {0, 2, 0}, {-6, 30, 0}};
  const Curve curve(points);
  const double before = curve.nearest({-1, 0.1, 0}).arc_mm;
  EXPECT_EQ(curve.nearest({0, 1.9, 0}).segment, 4U);  // without memory it jumps
  const CurvePoint c = curve.nearest_from({0, 1.9, 0}, before, 0.3, 1);
  EXPECT_EQ(c.segment, 1U);
  EXPECT_LT(std::abs(c.arc_mm - before), 2);
  // A real corner is still turned: the way round is short.
  EXPECT_EQ(curve.nearest_from({6, 0.1, 0}, curve.nearest({4.5, 0, 0}).arc_mm, 0.3, 1).segment, 2U);
}

// Figure 47: along a curve that comes near itself again and again, a deviating hand never leaves its place by more than
// it moved.
TEST(Curve, TracksThroughNearMisses) {
  std::vector<Vec3> points;
  for (int i = 0; i < 20000; ++i) {
    const double t = i * 0.002;
    points.push_back(
        {20 * std::cos(t) * (1 + 0.02 * std::sin(9 * t)), 20 * std::sin(t) * (1 + 0.02 * std::sin(7 * t)), 0.05 * t});
  }
  const Curve curve(points);
  std::mt19937 random(4);
  std::normal_distribution<double> noise(0, 0.8);
  double arc = 0, worst = 0;
  std::uint32_t segment = 0;
  Vec3 stray;
  for (int i = 0; i < 20000; ++i) {
    stray = stray * 0.99 + Vec3{noise(random), noise(random), noise(random)} * 0.1;
    const CurvePoint c = curve.nearest_from(points[i] + stray, arc, 0.5, segment);
    double truth = 0;
    truth = curve.at_arc(c.arc_mm).arc_mm;
    worst = std::max(worst, std::abs(truth - arc));
    arc = c.arc_mm;
    segment = c.segment;
  }
  EXPECT_LT(worst, 3);  // a turn is 125 mm long
  EXPECT_NEAR(arc, curve.length_mm(), 5);
}

TEST(Curve, RefusesWhatIsNone) {
  EXPECT_THROW(Curve(std::vector<Vec3>{{1, 2, 3}}), Error);
  EXPECT_THROW(Curve(std::vector<Vec3>{{1, 2, 3}, {NAN, 0, 0}}), Error);
  const CurvePoint c = Curve(std::vector<Vec3>{{1, 2, 3}, {1, 2, 3}}).nearest_from({1, 2, 5}, 4, 0.5, 9);
  EXPECT_NEAR(c.distance_mm, 2, 1e-15);
}

TEST(Curve, FarAwayAndInLargeCurves) {
  std::vector<Vec3> points = tangle(60000, 9);
  for (auto& p : points) p += Vec3{1e6, -1e6, 0};
  const Curve curve(points);
  std::mt19937 random(3);
  for (int i = 0; i < 6; ++i) {
    const Vec3 p = points[random() % points.size()] + Vec3{0.3, -0.2, 0.4};
    EXPECT_NEAR(curve.nearest(p, random() % 60000).score_mm, brute_score(points, p, 0, 0), 1e-7);
  }
}

}  // namespace
}  // namespace osteo
