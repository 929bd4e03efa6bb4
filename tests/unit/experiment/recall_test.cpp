// Scores of recalls that are known.
#include "osteo/assessment/experiment/recall.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "osteo/assessment/experiment/stimulus.h"
#include "osteo/core/base/error.h"

namespace osteo::experiment {
namespace {

const Stimulus& stimulus() {
  static const Stimulus s = make_stimulus(11);
  return s;
}
std::vector<double> shifted(double by_s, double gain = 1) {
  std::vector<double> f;
  for (std::size_t i = 0; i < stimulus().force_n.size(); ++i)
    f.push_back(gain * stimulus().force_at(static_cast<double>(i) / 1000 - by_s));
  return f;
}
Recall score(const std::vector<double>& applied, const std::vector<bool>& saturated = {}) {
  return score_recall(stimulus().force_n, applied, saturated, 1000);
}

TEST(Recall, PerfectIsNoughtAndNothingIsOne) {
  // The box rounds off corners of the ramps, and no more.
  EXPECT_LT(score(stimulus().force_n).score, 0.01);
  const Recall nothing = score(std::vector<double>(stimulus().force_n.size(), 0));
  EXPECT_NEAR(nothing.score, 1, 1e-12);
  EXPECT_NEAR(nothing.phase_s, 0, 1e-12);
  RecallSettings sharp;
  sharp.box_s = 0;
  EXPECT_NEAR(score_recall(stimulus().force_n, stimulus().force_n, {}, 1000, sharp).score, 0, 1e-9);
}

TEST(Recall, ErrorsComeApart) {
  const Recall late = score(shifted(0.4)), soft = score(shifted(0, 0.8));
  EXPECT_GT(late.lag_s, 0.2);
  EXPECT_LT(late.lag_s, 0.45);
  EXPECT_LT(late.amplitude_n, 0.25);
  EXPECT_LT(soft.phase_s, 0.1);
  double mean = 0;
  for (const double f : stimulus().force_n) mean += f / static_cast<double>(stimulus().force_n.size());
  EXPECT_NEAR(soft.amplitude_n, 0.2 * mean, 0.08 * mean);
  EXPECT_NEAR(score(shifted(-0.4)).lag_s, -late.lag_s, 0.1);
  // A little wrong in time is better than nothing, and plain differences would not say by how much.
  EXPECT_LT(late.score, 0.3);
  EXPECT_LT(late.thesis_n, late.plain_rms_n + 1);
}

// The dissertation's figure 25: three peaks recalled at slightly wrong times, each in another direction, are nearer
// than no force at all; the plain difference says the opposite.
TEST(Recall, FigureTwentyFive) {
  std::vector<double> target, recalled;
  for (int i = 0; i < 15000; ++i) {
    const double t = i / 1000.0;
    const auto peak = [&](double at) { return 6 * std::exp(-std::pow((t - at) / 0.35, 2)); };
    target.push_back(peak(3) + peak(7.5) + peak(12));
    recalled.push_back(peak(3.7) + peak(6.8) + peak(12.7));
  }
  const std::vector<double> nothing(target.size(), 0);
  const Recall red = score_recall(target, recalled, {}, 1000), green = score_recall(target, nothing, {}, 1000);
  EXPECT_GT(red.plain_rms_n, green.plain_rms_n);
  EXPECT_LT(red.score, 0.5 * green.score);
  EXPECT_LT(red.thesis_n, green.thesis_n);
}

TEST(Recall, WhatWasSaturatedCountsNothing) {
  std::vector<double> applied = stimulus().force_n;
  std::vector<bool> saturated(applied.size(), false);
  for (std::size_t i = 4000; i < 6000; ++i) {
    applied[i] = 0;
    saturated[i] = true;
  }
  const Recall reported = score(applied, saturated), untold = score(applied);
  EXPECT_NEAR(reported.saturated, 2.0 / stimulus().seconds(), 0.01);
  EXPECT_LT(reported.score, 0.2 * untold.score);
  EXPECT_NEAR(score(std::vector<double>(applied.size(), 0), saturated).score, 1, 1e-12);
}

TEST(Recall, WhatCannotBeScored) {
  const std::vector<double> f{0, 1, 2}, none{0, 0, 0};
  EXPECT_THROW((void)score_recall(f, std::vector<double>{0, 1}, {}, 1000), Error);
  EXPECT_THROW((void)score_recall(none, f, {}, 1000), Error);
  EXPECT_THROW((void)score_recall(f, f, {true}, 1000), Error);
  EXPECT_THROW((void)score_recall(f, f, {true, true, true}, 1000), Error);
  EXPECT_THROW((void)score_recall(f, f, {}, 0), Error);
  EXPECT_THROW((void)score_recall(std::vector<double>{1}, std::vector<double>{1}, {}, 1000), Error);
  EXPECT_THROW((void)score_recall(f, std::vector<double>{0, std::numeric_limits<double>::quiet_NaN(), 1}, {}, 1000),
               Error);
}

TEST(Recall, TheBoxIsAMean) {
  const std::vector<double> v{0, 0, 3, 0, 0};
  EXPECT_EQ(box_filtered(v, 3), (std::vector<double>{0, 1, 1, 1, 0}));
  EXPECT_EQ(box_filtered(v, 0), v);
}

TEST(Stimulus, HasThePrintedConstants) {
  double longest = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    StimulusParams printed;
    printed.scale = false;
    const Stimulus s = make_stimulus(seed, printed, 200);
    const auto [x0, x1] = std::minmax_element(s.x_mm.begin(), s.x_mm.end());
    const auto [z0, z1] = std::minmax_element(s.z_mm.begin(), s.z_mm.end());
    EXPECT_NEAR(*x1 - *x0, 100, 0.1);
    EXPECT_NEAR(*z1 - *z0, 60, 0.2);
    for (std::size_t i = 1; i < s.x_mm.size(); ++i)
      ASSERT_NEAR(std::hypot(s.x_mm[i] - s.x_mm[i - 1], s.z_mm[i] - s.z_mm[i - 1]) * 200, 16, 0.25);
    EXPECT_LE(s.most_n(), 12 + 1e-9);
    EXPECT_GT(s.most_n(), 8);
    EXPECT_EQ(s.force_n.front(), 0);
    EXPECT_NEAR(s.force_n.back(), 0, 1e-9);
    for (std::size_t i = 0; i < s.force_n.size(); ++i) {
      ASSERT_GE(s.force_n[i], 0);
      ASSERT_EQ(s.saturated[i], s.force_n[i] > 8 + 1e-9);
    }
    longest = std::max(longest, s.seconds());
    const Stimulus scaled = make_stimulus(seed, {}, 200);
    EXPECT_LE(scaled.most_n(), 8 + 1e-9);
    EXPECT_EQ(std::count(scaled.saturated.begin(), scaled.saturated.end(), true), 0);
    EXPECT_EQ(make_stimulus(seed, {}, 200).force_n, scaled.force_n);
    EXPECT_NE(make_stimulus(seed + 100, {}, 200).force_n, scaled.force_n);
  }
  EXPECT_LT(longest, 25);
  StimulusParams wrong;
  wrong.speed_mm_s = 0;
  EXPECT_THROW((void)make_stimulus(1, wrong), Error);
  wrong = {};
  wrong.ramp_s = 60;
  EXPECT_THROW((void)make_stimulus(1, wrong), Error);
}

}  // namespace
}  // namespace osteo::experiment
