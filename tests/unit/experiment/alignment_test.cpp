// The quick alignment beside the plain one, and what cannot be aligned.
#include "osteo/assessment/experiment/alignment.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "osteo/core/base/error.h"
#include "osteo/core/statistics/basics.h"

namespace osteo::experiment {
namespace {

struct Held {
  std::vector<double> force, slope, weight;
  [[nodiscard]] Curve curve() const { return {force, slope, weight}; }
};
Held held(std::vector<double> force, double rate_hz = 66) {
  Held h{std::move(force), {}, {}};
  h.slope = slopes(h.force, rate_hz);
  return h;
}
// Peaks at times that wander.
Held peaks(std::size_t n, std::uint64_t seed, double shift_share = 0, double noise = 0) {
  statistics::Random random(seed);
  std::vector<double> f(n, 0);
  for (int p = 0; p < 4; ++p) {
    const double at = (0.15 + 0.22 * p + shift_share * random.normal()) * static_cast<double>(n),
                 wide = 0.05 * static_cast<double>(n) + 1;
    for (std::size_t i = 0; i < n; ++i) f[i] += 6 * std::exp(-std::pow((static_cast<double>(i) - at) / wide, 2));
  }
  for (double& v : f) v += noise * random.normal();
  return held(f);
}
void expect_same(const Alignment& a, const Alignment& plain, const std::string& what) {
  EXPECT_EQ(a.cost_n, plain.cost_n) << what;
  ASSERT_EQ(a.path.size(), plain.path.size()) << what;
  for (std::size_t i = 0; i < a.path.size(); ++i) {
    ASSERT_EQ(a.path[i].target, plain.path[i].target) << what << " step " << i;
    ASSERT_EQ(a.path[i].applied, plain.path[i].applied) << what << " step " << i;
  }
}

TEST(Alignment, SameBitsAndPathAsThePlainRecurrence) {
  int by[2] = {0, 0};
  Aligner aligner;
  for (int seed = 0; seed < 24; ++seed) {
    const double shift = seed % 4 == 3 ? 0.12 : 0.004 * (seed % 4), noise = 0.05 * (seed % 3);
    const Held a = peaks(300, 7),
               b = peaks(seed % 5 == 4 ? 240 : 300, static_cast<std::uint64_t>(seed) + 50, shift, noise);
    const Alignment& fast = aligner.align(a.curve(), b.curve());
    expect_same(fast, align_plainly(a.curve(), b.curve()), "seed " + std::to_string(seed));
    ++by[static_cast<int>(fast.by)];
  }
  // Each way of being certain was met.
  EXPECT_GT(by[0], 0);
  EXPECT_GT(by[1], 0);
}

// A narrow band that cuts the optimum must not be believed: here it lies far outside.
TEST(Alignment, ANarrowBandIsNotBelieved) {
  std::vector<double> a(400, 0), b(400, 0);
  for (std::size_t i = 0; i < 60; ++i) a[50 + i] = b[250 + i] = 8 * std::sin(static_cast<double>(i) / 60 * 3.14159);
  const Held target = held(a), applied = held(b);
  for (const double band : {0.01, 0.05, 0.2}) {
    Aligner aligner({1, 0.25, 0.5}, band);
    const Alignment& fast = aligner.align(target.curve(), applied.curve());
    expect_same(fast, align_plainly(target.curve(), applied.curve(), {1, 0.25, 0.5}), "band " + std::to_string(band));
    // The first try saw nothing of it.
    EXPECT_GT(fast.places, static_cast<std::size_t>(1.5 * band * 400 * 400));
  }
}

// Every step aside is paid by the bound: a curve that is wrong by a constant aligns with itself, whatever the cost, and
// is certain by it.
TEST(Alignment, TheBoundKnowsWhatNoWayAvoids) {
  Held target = held(std::vector<double>(300, 2.0)), applied = held(std::vector<double>(300, 9.0));
  Aligner aligner;
  const Alignment& fast = aligner.align(target.curve(), applied.curve());
  EXPECT_EQ(fast.by, AlignBy::band);
  EXPECT_LT(fast.places, 300U * 300 / 10);
  EXPECT_DOUBLE_EQ(fast.cost_n, 300 * 7.0);
  expect_same(fast, align_plainly(target.curve(), applied.curve()), "constant");
}

TEST(Alignment, HardShapes) {
  const std::vector<std::pair<std::size_t, std::size_t>> sizes{{1, 1},   {1, 9},   {9, 1},   {2, 1},
                                                               {3, 200}, {200, 3}, {17, 18}, {64, 64}};
  for (const auto& [n, m] : sizes) {
    for (const double distortion : {0.0, 0.3, 1000.0}) {
      const Held a = peaks(n, 3, 0, 0.4), b = peaks(m, 4, 0, 0.4);
      Aligner aligner({1, 0.1, distortion});
      expect_same(aligner.align(a.curve(), b.curve()), align_plainly(a.curve(), b.curve(), {1, 0.1, distortion}),
                  std::to_string(n) + " x " + std::to_string(m) + ", " + std::to_string(distortion));
    }
  }
  // Flat, and cut off at a limit: many ways are equally cheap, and both choose the same.
  Held flat = held(std::vector<double>(120, 0.0)), cut = peaks(120, 5);
  for (double& f : cut.force) f = std::min(f, 2.0);
  cut.slope = slopes(cut.force, 66);
  Aligner aligner;
  expect_same(aligner.align(flat.curve(), flat.curve()), align_plainly(flat.curve(), flat.curve()), "flat");
  EXPECT_EQ(aligner.align(flat.curve(), flat.curve()).cost_n, 0);
  expect_same(aligner.align(cut.curve(), flat.curve()), align_plainly(cut.curve(), flat.curve()), "cut");
  // Weights: what is kept out costs nothing.
  Held half = peaks(200, 6), other = peaks(200, 7, 0.02);
  half.weight.assign(200, 1);
  for (std::size_t i = 0; i < 100; ++i) half.weight[i] = 0;
  expect_same(aligner.align(half.curve(), other.curve()), align_plainly(half.curve(), other.curve()), "weights");
  EXPECT_LT(aligner.align(half.curve(), other.curve()).cost_n,
            align_plainly(peaks(200, 6).curve(), other.curve()).cost_n);
}

TEST(Alignment, PathsGoOnByOne) {
  Aligner aligner;
  const Held a = peaks(500, 1), b = peaks(450, 2, 0.02);
  const auto& path = aligner.align(a.curve(), b.curve()).path;
  ASSERT_EQ(path.front().target + path.front().applied, 0U);
  ASSERT_EQ(path.back().target, 499U);
  ASSERT_EQ(path.back().applied, 449U);
  for (std::size_t i = 1; i < path.size(); ++i) {
    const auto dt = path[i].target - path[i - 1].target, da = path[i].applied - path[i - 1].applied;
    ASSERT_TRUE((dt == 1 || dt == 0) && (da == 1 || da == 0) && dt + da > 0);
  }
}

TEST(Alignment, WhatCannotBeAligned) {
  Aligner aligner;
  const Held good = held({1, 2, 3});
  Held bad = held({1, std::numeric_limits<double>::quiet_NaN(), 3});
  EXPECT_THROW((void)aligner.align(good.curve(), bad.curve()), Error);
  bad = held({1, 2, 3});
  bad.slope[2] = std::numeric_limits<double>::infinity();
  EXPECT_THROW((void)aligner.align(bad.curve(), good.curve()), Error);
  EXPECT_THROW((void)aligner.align({}, good.curve()), Error);
  Held odd = good;
  odd.slope.pop_back();
  EXPECT_THROW((void)aligner.align(odd.curve(), good.curve()), Error);
  odd = good;
  odd.weight = {1, -1, 1};
  EXPECT_THROW((void)aligner.align(odd.curve(), good.curve()), Error);
  EXPECT_THROW(Aligner({-1, 0, 0}), Error);
  EXPECT_THROW(Aligner({}, 0), Error);
  const Held wide = held(std::vector<double>(20000, 1));
  EXPECT_THROW((void)aligner.align(wide.curve(), wide.curve()), Error);
  // And goes on afterwards.
  EXPECT_EQ(aligner.align(good.curve(), good.curve()).cost_n, 0);
}

}  // namespace
}  // namespace osteo::experiment
