// Regions, conditional quantiles, strokes: against formulas.
#include "osteo/assessment/evidence/detail/reference.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "osteo/assessment/evidence/detail/strokes.h"

namespace osteo {
namespace {

// Voxel 1: by both experts; 2: by one of each; 3: by both novices. Two of each: p = 3/4, 2/4, 1/4.
TEST(Region, TheLogRatioCountsWhatWasKept) {
  const std::vector<RemovedSet> experts{{1, 2}, {1}}, novices{{2, 3}, {3}};
  const double l3 = std::log(3.0);
  const RegionScore good = score_region({1}, experts, novices);
  EXPECT_NEAR(good.thesis, l3, 1e-12);
  EXPECT_NEAR(good.log_ratio, l3 + 0 + l3, 1e-12);  // 1 gone, 2 says nothing, 3 kept: ln(3/4 / 1/4)
  EXPECT_NEAR(good.effective_voxels, 2, 1e-12);
  EXPECT_NEAR(good.per_voxel, l3, 1e-12);
  const RegionScore bad = score_region({3}, experts, novices);
  EXPECT_NEAR(bad.log_ratio, -2 * l3, 1e-12);
  const RegionScore nothing = score_region({}, experts, novices);
  EXPECT_NEAR(nothing.log_ratio, 0, 1e-12);
  EXPECT_EQ(nothing.thesis, 0);
  // A voxel that nobody of the reference took says nothing where the groups are as large.
  EXPECT_NEAR(score_region({1, 9}, experts, novices).log_ratio, good.log_ratio, 1e-12);
  EXPECT_EQ(score_region({1}, {}, {}).log_ratio, 0);
}

double quantile_of(std::vector<double> v, double q) {
  std::sort(v.begin(), v.end());
  const auto at = static_cast<std::size_t>(std::max(0.0, std::ceil(q * static_cast<double>(v.size()) - 1e-12) - 1));
  return v[std::min(at, v.size() - 1)];
}

// The max-min formula: at step i the largest over s <= i of the least over t >= i of the quantile of all values in
// s..t.
TEST(Isotonic, QuantilesAreThoseOfTheMaxMinFormula) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> u(0, 1);
  for (const double q : {0.1, 0.5, 0.9}) {
    std::vector<IsotonicQuantile::Point> points;
    std::vector<std::vector<double>> by_step(12);
    for (int n = 0; n < 160; ++n) {
      const int step = static_cast<int>(u(random) * 12);
      const double value = u(random) * (1 + 0.1 * step) + (step == 5 ? 1 : 0);
      points.push_back({step * 0.1 + 0.05, value});
      by_step[static_cast<std::size_t>(step)].push_back(value);
    }
    const IsotonicQuantile fit(points, q);
    double last = -1;
    for (std::size_t i = 0; i < 12; ++i) {
      double best = -1e9;
      for (std::size_t s = 0; s <= i; ++s) {
        double least = 1e9;
        for (std::size_t t = i; t < 12; ++t) {
          std::vector<double> all;
          for (std::size_t k = s; k <= t; ++k) all.insert(all.end(), by_step[k].begin(), by_step[k].end());
          least = std::min(least, quantile_of(all, q));
        }
        best = std::max(best, least);
      }
      EXPECT_DOUBLE_EQ(fit.at(static_cast<double>(i) * 0.1 + 0.05), best) << q << ' ' << i;
      EXPECT_GE(fit.at(static_cast<double>(i) * 0.1 + 0.05), last);
      last = fit.at(static_cast<double>(i) * 0.1 + 0.05);
    }
    EXPECT_EQ(fit.at(9), fit.at(1.15));
    EXPECT_EQ(fit.at(-3), fit.at(0.05));
  }
  EXPECT_TRUE(IsotonicQuantile({}, 0.5).empty());
}

// A triangle wave of 5 mm, four sides a second.
std::vector<Stroke> wave(double rate_hz, double turn, double seconds, double noise_mm = 0) {
  StrokeFinder finder;
  std::mt19937 random(1);
  std::normal_distribution<double> n(0, 1);
  for (int t = 0; t < static_cast<int>(seconds * rate_hz); ++t) {
    const double s = t / rate_hz, phase = std::fmod(s * 2, 1.0);
    const double x = 5 * (phase < 0.5 ? 2 * phase : 2 - 2 * phase);
    finder.add(s, {x * std::cos(turn) + noise_mm * n(random), x * std::sin(turn), 100});
  }
  return finder.finish();
}

TEST(Strokes, ATriangleWaveHasAsManyAsSides) {
  for (const double rate : {100.0, 500.0, 1000.0}) {
    const auto strokes = wave(rate, 0.3, 5);
    ASSERT_EQ(strokes.size(), 20U) << rate;
    for (std::size_t s = 1; s + 1 < strokes.size(); ++s) {
      EXPECT_NEAR(strokes[s].length_mm, 5, 0.25);
      EXPECT_NEAR(strokes[s].end_s - strokes[s].begin_s, 0.25, 0.021);
    }
    EXPECT_NEAR(stroke_variance(strokes), 0, 1e-9);
  }
  EXPECT_EQ(wave(1000, 0.3, 5, 0.005).size(), 20U);
}

TEST(Strokes, StillHandsAndCirclesHaveNone) {
  StrokeFinder still, circle, pauses;
  std::mt19937 random(1);
  std::normal_distribution<double> n(0, 0.003);
  for (int t = 0; t < 500; ++t) {
    still.add(t / 100.0, {n(random), n(random), n(random)});
    const double a = 2 * std::numbers::pi * t / 100;
    circle.add(t / 100.0, {5 * std::cos(a), 5 * std::sin(a), 0});
  }
  EXPECT_EQ(still.finish().size(), 0U);
  EXPECT_EQ(circle.finish().size(), 1U);  // it never turns sharply
  for (const double at : {0.0, 1.0, 2.0}) {
    for (int t = 0; t < 50; ++t) pauses.add(at + t / 100.0, {at * 10 + t * 0.1, 0, 0});
  }
  EXPECT_EQ(pauses.finish().size(), 3U);
}

// Minimum-jerk reaches of a second and 20 mm to and fro: their smoothness is known (evidence of the functions:
// statistics/movement_test).
std::vector<Stroke> reaches(double rate_hz, double tremor_mm, double noise_mm) {
  StrokeFinder finder;
  std::mt19937 random(1);
  std::normal_distribution<double> n(0, 1);
  for (int t = 0; t < static_cast<int>(10 * rate_hz); ++t) {
    const double s = t / rate_hz, u = s - std::floor(s), way = u * u * u * (10 - 15 * u + 6 * u * u);
    const double x = 20 * (static_cast<int>(std::floor(s)) % 2 == 0 ? way : 1 - way);
    const double shake = tremor_mm * std::sin(2 * std::numbers::pi * 9 * s);
    finder.add(s, {x + shake + noise_mm * n(random), noise_mm * n(random), 50});
  }
  return finder.finish();
}
TEST(Strokes, SmoothnessIsThatOfTheirSpeed) {
  for (const double rate : {100.0, 1000.0}) {
    const auto smooth = reaches(rate, 0, 0);
    ASSERT_GE(smooth.size(), 9U);
    for (std::size_t s = 1; s + 1 < smooth.size(); ++s) {
      // Exact: -1.4058 and -5.224 at 100 samples a second; cut at the turn to within a sample, filtered at 20 Hz.
      EXPECT_NEAR(smooth[s].sparc, -1.4058, 0.015) << rate;
      EXPECT_NEAR(smooth[s].log_dimensionless_jerk, -5.224, 0.15) << rate;
    }
  }
  // Ten micrometres of noise leave SPARC where it is; a tremor does not.
  const auto noisy = reaches(1000, 0, 0.01), shaking = reaches(1000, 0.2, 0);
  ASSERT_GE(noisy.size(), 9U);
  EXPECT_NEAR(noisy[3].sparc, -1.4058, 0.03);
  ASSERT_GE(shaking.size(), 5U);
  const auto longest = std::max_element(shaking.begin(), shaking.end(),
                                        [](const Stroke& a, const Stroke& b) { return a.length_mm < b.length_mm; });
  EXPECT_LT(longest->sparc, -1.6);
  EXPECT_LT(longest->log_dimensionless_jerk, -7);
  // Shorter than 100 ms: none.
  StrokeFinder brief;
  for (int t = 0; t < 10; ++t) brief.add(t / 100.0, {t * 0.3, 0, 0});
  ASSERT_EQ(brief.finish().size(), 1U);
  EXPECT_TRUE(std::isnan(brief.finish().front().sparc));
}

TEST(Strokes, VarianceIsThatOfTheirDirections) {
  const auto along = [](std::vector<Vec3> ways) {
    std::vector<Stroke> s;
    for (const Vec3 w : ways) s.push_back({0, 1, 1, w});
    return stroke_variance(s);
  };
  const Vec3 x{1, 0, 0}, y{0, 1, 0};
  EXPECT_NEAR(along({x, x * -1, x, x * -1, x}), 0, 1e-12);
  EXPECT_NEAR(along({x, y, x, y, x}), 0.4, 1e-12);
  EXPECT_EQ(along({x, y}), 0);
}

}  // namespace
}  // namespace osteo
