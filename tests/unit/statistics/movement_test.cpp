// Smoothness against values that others computed from the same definitions, and what filtering does to it.
#include "osteo/core/statistics/curves.h"

#include "osteo/core/base/error.h"
#include "reference.h"

namespace osteo::statistics {
namespace {

std::vector<double> sampled(double from_s, double seconds, double rate_hz, const auto& of) {
  std::vector<double> v;
  const auto n = static_cast<int>(std::lround(seconds * rate_hz));
  for (int i = 0; i < n; ++i) v.push_back(of(from_s + i / rate_hz));
  return v;
}
double minimum_jerk(double t) {
  return t < 0 || t > 1 ? 0 : 30 * t * t * (1 - t) * (1 - t);
}

// evidence.md 1.6: the example of the authors of SPARC, to all printed digits; the other movements to theirs.
TEST(Smoothness, PublishedOracles) {
  const auto bell = sampled(-1, 2, 100, [](double t) { return std::exp(-5 * t * t); });
  EXPECT_NEAR(sparc(bell, 100), -1.41403, 5e-6);
  EXPECT_NEAR(log_dimensionless_jerk(bell, 100), -5.81636, 5e-6);
  for (const auto& [rate, expected_sparc, expected_jerk] :
       {std::array{100.0, -1.4058, -5.224}, std::array{1000.0, -1.4024, -5.312}}) {
    const auto reach = sampled(0, 1, rate, minimum_jerk);
    EXPECT_NEAR(sparc(reach, rate), expected_sparc, 5e-5);
    EXPECT_NEAR(log_dimensionless_jerk(reach, rate), expected_jerk, 5e-4);
  }
  for (const auto& [rate, expected_sparc, expected_jerk] :
       {std::array{100.0, -1.764, -6.970}, std::array{1000.0, -1.750, -7.050}}) {
    const auto two = sampled(0, 1.6, rate, [](double t) { return minimum_jerk(t) + minimum_jerk(t - 0.6); });
    EXPECT_NEAR(sparc(two, rate), expected_sparc, 5e-4);
    EXPECT_NEAR(log_dimensionless_jerk(two, rate), expected_jerk, 5e-4);
  }
  // The integral itself: -ln 204.8.
  EXPECT_NEAR(log_dimensionless_jerk(sampled(0, 1, 20000, minimum_jerk), 20000), -std::log(204.8), 1e-3);
}

TEST(Smoothness, AsTheDefinitionInPython) {
  const Json r = reference("movement");
  const auto speed = numbers(r, "speed");
  expect_same(sparc(speed, 100), number(r, "sparc"));
  expect_same(sparc(speed, 100, {20, 0.1}), number(r, "sparc_20hz_10percent"));
  expect_same(log_dimensionless_jerk(speed, 100), number(r, "ldlj"));
  expect_same(low_pass(numbers(r, "wobble"), 1000, 20), numbers(r, "filtered_20_of_1000_hz"));
  expect_same(low_pass(numbers(r, "wobble"), 100, 30), numbers(r, "filtered_30_of_100_hz"));
}

// Neither size nor duration counts, and what is jerky is told from what is not.
TEST(Smoothness, OfShapeOnly) {
  const auto reach = sampled(0, 1, 1000, minimum_jerk);
  std::vector<double> larger = reach;
  for (double& v : larger) v *= 37;
  EXPECT_NEAR(sparc(larger, 1000), sparc(reach, 1000), 1e-12);
  EXPECT_NEAR(log_dimensionless_jerk(larger, 1000), log_dimensionless_jerk(reach, 1000), 1e-12);
  EXPECT_NEAR(log_dimensionless_jerk(reach, 500), log_dimensionless_jerk(reach, 1000), 1e-12);
  const auto shaky = sampled(0, 1, 1000, [](double t) { return minimum_jerk(t) * (1 + 0.4 * std::sin(50 * t)); });
  EXPECT_LT(sparc(shaky, 1000), sparc(reach, 1000) - 0.1);
  EXPECT_LT(log_dimensionless_jerk(shaky, 1000), log_dimensionless_jerk(reach, 1000) - 1);
}

// Ten micrometres of noise at 1 kHz: jerk without a filter is nothing but it, SPARC hardly notices (evidence.md 1.6:
// -25.0, -8.8, -1.408).
TEST(Smoothness, OfNoisyPositions) {
  Random random(11);
  std::vector<std::array<double, 3>> positions;
  for (int i = 0; i <= 1000; ++i) {
    const double t = i / 1000.0;
    positions.push_back({20 * t * t * t * (10 - 15 * t + 6 * t * t) + 0.01 * random.normal(), 0, 0});
  }
  const auto signed_speed = [&](const std::vector<double>& x) {
    std::vector<double> v;
    for (std::size_t i = 1; i + 1 < x.size(); ++i) v.push_back((x[i + 1] - x[i - 1]) * 500);
    return v;
  };
  std::vector<double> x;
  for (const auto& p : positions) x.push_back(p[0]);
  const auto raw = signed_speed(x), filtered = signed_speed(low_pass(x, 1000, 20));
  EXPECT_NEAR(log_dimensionless_jerk(raw, 1000), -25.0, 1.0);
  EXPECT_NEAR(log_dimensionless_jerk(filtered, 1000), -8.8, 1.5);
  EXPECT_NEAR(sparc(raw, 1000), -1.408, 0.02);
  EXPECT_NEAR(sparc(filtered, 1000), -1.402, 0.003);
  // Lengths of steps, not their components, are what speed_of gives.
  const auto speed = speed_of(positions, 1000);
  ASSERT_EQ(speed.size(), 1000U);
  EXPECT_NEAR(speed[7], std::abs(x[8] - x[7]) * 1000, 1e-9);
  // Straight on at 3, 4 and 12 mm a second.
  EXPECT_NEAR(speed_of(std::vector<std::array<double, 3>>{{0, 0, 0}, {3, 4, 12}}, 1)[0], 13, 1e-12);
}

TEST(Smoothness, OfNothing) {
  EXPECT_TRUE(std::isnan(sparc(std::vector<double>(50, 0.0), 100)));
  EXPECT_TRUE(std::isnan(sparc(std::vector<double>{1}, 100)));
  EXPECT_TRUE(std::isnan(log_dimensionless_jerk(std::vector<double>(50, 0.0), 100)));
  EXPECT_TRUE(std::isnan(log_dimensionless_jerk(std::vector<double>(50, 2.0), 100)));
  EXPECT_TRUE(std::isnan(log_dimensionless_jerk(std::vector<double>{1, 2}, 100)));
  EXPECT_THROW(static_cast<void>(sparc(std::vector<double>{1, kUndefined}, 100)), Error);
  EXPECT_THROW(static_cast<void>(sparc(std::vector<double>{1, 2}, 0)), Error);
  EXPECT_THROW(static_cast<void>(sparc(std::vector<double>{1, 2}, 100, {0, 0.05})), Error);
}

TEST(Resampling, StraightLinesStayStraight) {
  const std::vector<double> times{0, 0.013, 0.02, 0.051, 0.1}, values{5, 5 + 13, 5 + 20, 5 + 51, 5 + 100};
  const auto out = resample(times, values, 100);
  ASSERT_EQ(out.size(), 11U);
  for (std::size_t i = 0; i < out.size(); ++i) EXPECT_NEAR(out[i], 5 + 10.0 * static_cast<double>(i), 1e-9);
  EXPECT_EQ(resample(std::vector<double>{2.0}, std::vector<double>{7.0}, 100), std::vector<double>{7.0});
  EXPECT_TRUE(resample({}, {}, 100).empty());
  EXPECT_THROW(static_cast<void>(resample(std::vector<double>{0, 0}, std::vector<double>{1, 2}, 100)), Error);
  EXPECT_THROW(static_cast<void>(resample(std::vector<double>{0, 1}, std::vector<double>{1}, 100)), Error);
}

TEST(LowPass, LeavesHalfAtItsCornerAndAllFarBelow) {
  for (const auto& [hz, left] : {std::array{1.0, 1.0}, std::array{20.0, 0.5}, std::array{200.0, 1e-4}}) {
    std::vector<double> wave;
    for (int i = 0; i < 4000; ++i) wave.push_back(std::sin(2 * M_PI * hz * i / 1000));
    const auto out = low_pass(wave, 1000, 20);
    double most = 0;
    for (std::size_t i = 1500; i < 2500; ++i) most = std::max(most, std::abs(out[i]));
    EXPECT_NEAR(most, left, 0.01) << hz << " Hz";
  }
  EXPECT_THROW(static_cast<void>(low_pass(std::vector<double>(9), 1000, 20)), Error);
  EXPECT_THROW(static_cast<void>(low_pass(std::vector<double>(20), 1000, 500)), Error);
}

}  // namespace
}  // namespace osteo::statistics
