// What everything else stands on: ranks, quantiles, random numbers, the bootstrap.
#include "osteo/core/statistics/basics.h"

#include <array>

#include "osteo/core/base/error.h"
#include "reference.h"

namespace osteo::statistics {
namespace {

TEST(Basics, AsTheLibrariesOfPython) {
  const Json r = reference("basics");
  const auto values = numbers(r, "values");
  const Summary s = summarise(values);
  expect_same(s.mean, number(r, "mean"));
  expect_same(s.sd, number(r, "sd"));
  const auto shares = numbers(r, "shares"), quantiles = numbers(r, "quantiles");
  for (std::size_t i = 0; i < shares.size(); ++i) expect_same(quantile(values, shares[i]), quantiles[i]);
  expect_same(s.q1, quantiles[2]);
  expect_same(s.most, quantiles[5]);
  EXPECT_EQ(ranks(numbers(r, "tied")), numbers(r, "ranks"));
  for (const Json& row : r.find("wilson")->items()) {
    const auto w = numbers(row);
    expect_same(wilson(w[0], w[1]).lo, w[2]);
    expect_same(wilson(w[0], w[1]).hi, w[3]);
  }
  expect_same(holm(numbers(r, "p")), numbers(r, "holm"));
}

TEST(Basics, WhatIsNotDefinedIsNotANumberAndWhatMeansNothingIsRefused) {
  EXPECT_TRUE(std::isnan(mean({})));
  EXPECT_TRUE(std::isnan(variance(std::vector<double>{1})));
  EXPECT_TRUE(std::isnan(quantile({}, 0.5)));
  EXPECT_TRUE(std::isnan(wilson(0, 0).lo));
  EXPECT_EQ(summarise({}).n, 0U);
  const std::vector<double> bad{1, kUndefined};
  EXPECT_THROW(static_cast<void>(summarise(bad)), Error);
  EXPECT_THROW(static_cast<void>(ranks(bad)), Error);
  EXPECT_THROW(static_cast<void>(quantile(std::vector<double>{1}, 1.5)), Error);
  EXPECT_THROW(static_cast<void>(wilson(3, 2)), Error);
  const auto p = holm(std::vector<double>{0.02, kUndefined, 0.03});
  EXPECT_DOUBLE_EQ(p[0], 0.04);
  EXPECT_TRUE(std::isnan(p[1]));
  EXPECT_DOUBLE_EQ(p[2], 0.04);
}

TEST(Random, TheSameNumbersEverywhere) {
  // The first three of SplitMix64 from 1234567, as its authors' code prints them.
  Random r(1234567);
  EXPECT_EQ(r.bits(), 6457827717110365317ULL);
  EXPECT_EQ(r.bits(), 3203168211198807973ULL);
  EXPECT_EQ(r.bits(), 9817491932198370423ULL);
}

TEST(Random, EvenAndNormal) {
  Random r(5);
  std::array<int, 7> counts{};
  double sum = 0, squares = 0;
  for (int i = 0; i < 70000; ++i) {
    ++counts[r.below(7)];
    const double z = r.normal();
    sum += z;
    squares += z * z;
  }
  for (const int c : counts) EXPECT_NEAR(c, 10000, 400);
  EXPECT_NEAR(sum / 70000, 0, 0.015);
  EXPECT_NEAR(squares / 70000, 1, 0.025);
  EXPECT_THROW(static_cast<void>(r.below(0)), Error);
  std::vector<int> cards{0, 1, 2, 3, 4};
  r.shuffle(cards);
  std::sort(cards.begin(), cards.end());
  EXPECT_EQ(cards, (std::vector<int>{0, 1, 2, 3, 4}));
}

TEST(Bootstrap, OfAMeanIsItsStandardError) {
  std::vector<double> values;
  Random r(3);
  for (int i = 0; i < 60; ++i) values.push_back(10 + 2 * r.normal());
  const auto mean_of = [&](std::span<const std::size_t> drawn) {
    double sum = 0;
    for (const std::size_t d : drawn) sum += values[d];
    return sum / static_cast<double>(drawn.size());
  };
  const Bootstrap b = bootstrap(values.size(), mean_of, {4000, 0.95, 9});
  const double half = 1.96 * std::sqrt(variance(values) / 60);
  EXPECT_NEAR(b.interval.lo, mean(values) - half, 0.1 * half);
  EXPECT_NEAR(b.interval.hi, mean(values) + half, 0.1 * half);
  const Bootstrap again = bootstrap(values.size(), mean_of, {4000, 0.95, 9});
  EXPECT_EQ(b.interval.lo, again.interval.lo);
  EXPECT_NE(b.interval.lo, bootstrap(values.size(), mean_of, {4000, 0.95, 10}).interval.lo);
}

TEST(Bootstrap, WithoutAnIntervalWhereTheStatisticOftenIsNone) {
  int calls = 0;
  const auto sometimes = [&](std::span<const std::size_t>) { return ++calls % 5 == 0 ? kUndefined : 1.0; };
  const Bootstrap b = bootstrap(4, sometimes, {1000, 0.95, 1});
  EXPECT_EQ(b.left_out, 200);
  EXPECT_TRUE(std::isnan(b.interval.lo));
  EXPECT_TRUE(std::isnan(bootstrap(1, sometimes).interval.lo));
  EXPECT_THROW(static_cast<void>(bootstrap(4, sometimes, {10, 0.95, 1})), Error);
}

}  // namespace
}  // namespace osteo::statistics
