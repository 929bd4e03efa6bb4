// People who come several times, and curves that only rise.
#include "osteo/core/statistics/repeated.h"

#include "osteo/core/base/error.h"
#include "osteo/core/statistics/curves.h"
#include "reference.h"

namespace osteo::statistics {
namespace {

TEST(WithinPeople, SignFlipsAsScipy) {
  const Json r = reference("repeated");
  std::vector<double> values;
  std::vector<int> person, condition;
  for (const Json& pair : r.find("pairs")->items()) {
    for (const int c : {1, 0}) {
      values.push_back(number(pair.items()[static_cast<std::size_t>(1 - c)]));
      person.push_back(static_cast<int>(values.size() + static_cast<std::size_t>(c)) / 2);
      condition.push_back(c);
    }
  }
  const WithinPeople w = permutation_within_people(values, person, condition);
  EXPECT_EQ(w.people, 9U);
  EXPECT_EQ(w.ways, 512);
  expect_same(w.statistic, number(r, "flip_statistic"));
  expect_same(w.p, number(r, "flip_p"));
}

TEST(WithinPeople, UnevenOnesByCountingAll) {
  const Json all = reference("repeated");
  const Json& r = *all.find("inside");
  const auto person = wholes(r, "person"), condition = wholes(r, "condition");
  const WithinPeople w = permutation_within_people(numbers(r, "values"), person, condition);
  expect_same(w.statistic, number(r, "statistic"));
  expect_same(w.p, number(r, "p"));
  EXPECT_EQ(w.ways, number(r, "ways"));
  // Who had only one condition says nothing about the difference.
  auto values = numbers(r, "values");
  auto more_people = person, more_conditions = condition;
  values.push_back(1000);
  more_people.push_back(77);
  more_conditions.push_back(1);
  const WithinPeople more = permutation_within_people(values, more_people, more_conditions);
  EXPECT_EQ(more.left_out, 1U);
  EXPECT_EQ(more.p, w.p);
  EXPECT_TRUE(
      std::isnan(permutation_within_people(std::vector<double>{1}, std::vector<int>{1}, std::vector<int>{1}).p));
}

TEST(MixedModel, AsFortyDigitsOfItsDefinition) {
  const Json all = reference("repeated");
  const Json& r = *all.find("mixed");
  const MixedModel m = mixed_model(numbers(r, "y"), numbers(r, "design"), 3, wholes(r, "person"));
  const auto beta = numbers(r, "beta"), error = numbers(r, "standard_error");
  for (std::size_t c = 0; c < 3; ++c) {
    expect_same(m.coefficients[c].value, beta[c]);
    expect_same(m.coefficients[c].standard_error, error[c]);
  }
  expect_same(m.variance_people, number(r, "variance_people"));
  expect_same(m.variance_error, number(r, "variance_error"));
  expect_same(m.log_likelihood, number(r, "log_likelihood"));
  EXPECT_EQ(m.people, 9U);
  // Between people there are few degrees of freedom, inside them more.
  EXPECT_GT(m.coefficients[1].df, 4);
  EXPECT_LT(m.coefficients[1].df, 9);
  EXPECT_GT(m.coefficients[2].df, 9);
}

// Balanced data: variances, t and degrees of freedom are those of the analysis of variance, exactly.
TEST(MixedModel, BalancedIsTheAnalysisOfVariance) {
  Random random(8);
  const int people = 10, each = 4;
  std::vector<double> y, design, group_means[2], slopes;
  std::vector<int> person;
  double within = 0;
  for (int p = 0; p < people; ++p) {
    const double own = 2 * random.normal(), group = p % 2;
    std::vector<double> mine;
    for (int k = 0; k < each; ++k) {
      const double condition = k % 2;
      mine.push_back(5 + 1.5 * group + own + 0.4 * condition + random.normal());
      design.insert(design.end(), {1, group, condition});
      person.push_back(p);
    }
    y.insert(y.end(), mine.begin(), mine.end());
    group_means[p % 2].push_back(mean(mine));
    slopes.push_back((mine[1] + mine[3] - mine[0] - mine[2]) / 2);
  }
  const MixedModel m = mixed_model(y, design, 3, person);
  // Between: Student's t of the people's means.
  const double pooled = (variance(group_means[0]) + variance(group_means[1])) / 2,
               difference = mean(group_means[1]) - mean(group_means[0]);
  EXPECT_NEAR(m.coefficients[1].value, difference, 1e-9);
  EXPECT_NEAR(m.coefficients[1].t, difference / std::sqrt(pooled * 2 / 5), 1e-7);
  EXPECT_NEAR(m.coefficients[1].df, people - 2, 1e-6);
  // Within: rows less people less the one slope.
  const double slope = mean(slopes);
  for (int i = 0; i < people * each; ++i) {
    const int p = i / each;
    double own = 0;
    for (int k = 0; k < each; ++k) own += y[static_cast<std::size_t>(p * each + k)] / each;
    const double left = y[static_cast<std::size_t>(i)] - own - slope * (i % 2 - 0.5);
    within += left * left;
  }
  const double rest = people * each - people - 1;
  EXPECT_NEAR(m.coefficients[2].value, slope, 1e-9);
  EXPECT_NEAR(m.variance_error, within / rest, 1e-9);
  EXPECT_NEAR(m.variance_people, pooled - within / rest / each, 1e-9);
  EXPECT_NEAR(m.coefficients[2].df, rest, 1e-6);
  EXPECT_NEAR(m.coefficients[2].t, slope / std::sqrt(within / rest / people), 1e-8);
}

TEST(MixedModel, PeopleWhoDoNotDiffer) {
  // Means of all people equal: nothing is left for a variance between them.
  std::vector<double> y, ones(12, 1.0);
  std::vector<int> person;
  for (int p = 0; p < 4; ++p) {
    for (const double v : {1.0, 2.0, 3.0}) {
      y.push_back(v);
      person.push_back(p);
    }
  }
  const MixedModel m = mixed_model(y, ones, 1, person);
  EXPECT_EQ(m.variance_people, 0);
  expect_same(m.coefficients[0].value, 2);
  expect_same(m.coefficients[0].df, 11);
  const MixedModel still = mixed_model(std::vector<double>(12, 3.0), ones, 1, person);
  expect_same(still.coefficients[0].value, 3);
  EXPECT_TRUE(std::isnan(still.coefficients[0].p));
  // All of the differences are between people.
  std::vector<double> between;
  for (const int p : person) between.push_back(p * p);
  const MixedModel wholly = mixed_model(between, ones, 1, person);
  EXPECT_GT(wholly.icc(), 0.999);
}

TEST(MixedModel, WhatCannotBeAsked) {
  const std::vector<double> y{1, 2, 3, 4}, twice{1, 1, 1, 1, 1, 1, 1, 1}, ones(4, 1.0);
  EXPECT_THROW(static_cast<void>(mixed_model(y, ones, 1, std::vector<int>{1, 2, 3, 4})), Error);
  EXPECT_THROW(static_cast<void>(mixed_model(y, twice, 2, std::vector<int>{1, 1, 2, 2})), Error);
  EXPECT_THROW(static_cast<void>(mixed_model(y, ones, 2, std::vector<int>{1, 1, 2, 2})), Error);
  EXPECT_THROW(static_cast<void>(mixed_model(y, ones, 0, std::vector<int>{1, 1, 2, 2})), Error);
}

double loss(const MonotoneCurve& c, const std::vector<double>& x, const std::vector<double>& y, double share) {
  double sum = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double off = y[i] - c.at(x[i]);
    sum += off >= 0 ? share * off : (share - 1) * off;
  }
  return sum;
}

TEST(Isotonic, AsScikitLearnAndALinearProgramme) {
  const Json r = reference("isotonic");
  const auto x = numbers(r, "x"), y = numbers(r, "y");
  const MonotoneCurve rising = isotonic_mean(x, y, Trend::rising, numbers(r, "weights")),
                      falling = isotonic_mean(x, y, Trend::falling);
  EXPECT_EQ(rising.x, numbers(r, "places"));
  expect_same(rising.y, numbers(r, "rising_weighted"));
  expect_same(falling.y, numbers(r, "falling"));
  for (const Json& row : r.find("least_loss")->items()) {
    const auto v = numbers(row);
    const MonotoneCurve c = isotonic_quantile(x, y, v[0]);
    EXPECT_TRUE(std::is_sorted(c.y.begin(), c.y.end()));
    expect_same(loss(c, x, y, v[0]), v[1]);
    // Mirrored it is the same problem.
    std::vector<double> mirrored;
    for (const double at : x) mirrored.push_back(-at);
    expect_same(loss(isotonic_quantile(mirrored, y, v[0], Trend::falling), mirrored, y, v[0]), v[1]);
  }
}

TEST(Isotonic, OfOnePlaceIsTheQuantileItself) {
  const std::vector<double> x(5, 2.0), y{5, 1, 4, 2, 3};
  const MonotoneCurve median = isotonic_quantile(x, y, 0.5), mean_curve = isotonic_mean(x, y);
  EXPECT_EQ(median.y, std::vector<double>{3});
  EXPECT_EQ(mean_curve.y, std::vector<double>{3});
  EXPECT_EQ(isotonic_quantile(x, y, 0.01).y, std::vector<double>{1});
  EXPECT_EQ(isotonic_quantile(x, y, 0.99).y, std::vector<double>{5});
  EXPECT_EQ(median.at(-7), 3);
  EXPECT_TRUE(std::isnan(isotonic_mean({}, {}).at(0)));
  EXPECT_TRUE(isotonic_quantile({}, {}, 0.5).x.empty());
  EXPECT_THROW(static_cast<void>(isotonic_quantile(x, y, 1)), Error);
  EXPECT_THROW(static_cast<void>(isotonic_mean(x, y, Trend::rising, std::vector<double>(5, 0.0))), Error);
  const MonotoneCurve line = isotonic_mean(std::vector<double>{0, 2}, std::vector<double>{1, 5});
  EXPECT_EQ(line.at(0.5), 2);
  EXPECT_EQ(line.at(9), 5);
}

TEST(Isotonic, ManyValuesQuickly) {
  // A session's force against distance: 200 000 samples in a moment, the known quantile found.
  Random random(6);
  std::vector<double> x, y;
  for (int i = 0; i < 200000; ++i) {
    x.push_back(10 * random.uniform());
    y.push_back(x.back() * random.uniform());
  }
  const MonotoneCurve c = isotonic_quantile(x, y, 0.9);
  for (const double at : {2.0, 5.0, 8.0}) EXPECT_NEAR(c.at(at), 0.9 * at, 0.25);
}

}  // namespace
}  // namespace osteo::statistics
