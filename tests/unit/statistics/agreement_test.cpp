// Agreement of raters: tables of textbooks, other people's programs, and what happens when there is nothing to agree
// about.
#include "osteo/core/statistics/agreement.h"

#include "osteo/core/base/error.h"
#include "reference.h"

namespace osteo::statistics {
namespace {

Ratings ratings_of(const Json& rows) {
  const std::size_t n = rows.items().size(), k = rows.items()[0].items().size();
  Ratings r(n, k);
  for (std::size_t t = 0; t < n; ++t) {
    for (std::size_t c = 0; c < k; ++c) r.at(t, c) = rows.items()[t].items()[c].number();
  }
  return r;
}
Ratings all_equal(std::size_t targets, std::size_t raters, double value) {
  Ratings r(targets, raters);
  for (std::size_t t = 0; t < targets; ++t) {
    for (std::size_t c = 0; c < raters; ++c) r.at(t, c) = value;
  }
  return r;
}
const std::vector<double> kOneToFive{1, 2, 3, 4, 5};

TEST(Kappa, OfATextbook) {
  std::vector<int> a, b;
  const auto add = [&](int i, int j, int n) {
    a.insert(a.end(), static_cast<std::size_t>(n), i);
    b.insert(b.end(), static_cast<std::size_t>(n), j);
  };
  add(0, 0, 20);
  add(0, 1, 5);
  add(1, 0, 10);
  add(1, 1, 15);
  const Kappa k = cohen_kappa(a, b, 2);
  expect_same(k.value, 0.4);
  expect_same(k.observed, 0.7);
  expect_same(k.expected, 0.5);
  expect_same(cohen_kappa(b, a, 2).value, 0.4);
  // With two categories there is nothing to weigh.
  expect_same(cohen_kappa(a, b, 2, Weights::quadratic).standard_error, k.standard_error);
}

TEST(Kappa, AsStatsmodels) {
  const Json r = reference("agreement");
  const auto a = wholes(r, "a"), b = wholes(r, "b");
  for (const auto& [name, weights] : {std::pair{"none", Weights::none}, std::pair{"linear", Weights::linear},
                                      std::pair{"quadratic", Weights::quadratic}}) {
    const Json& expected = *r.find("kappa")->find(name);
    const Kappa k = cohen_kappa(a, b, 5, weights);
    expect_same(k.value, number(expected, "value"), name);
    expect_same(k.standard_error, number(expected, "standard_error"), name);
    expect_same(k.interval.lo, number(expected, "lo"), name);
    expect_same(k.interval.hi, number(expected, "hi"), name);
  }
}

TEST(Kappa, WhereChanceWouldAgreeOnEverything) {
  const std::vector<int> same(10, 1), mixed{0, 1, 0, 1, 0, 1, 0, 1, 0, 1};
  EXPECT_TRUE(std::isnan(cohen_kappa(same, same, 3).value));
  EXPECT_NEAR(cohen_kappa(same, mixed, 3).value, 0, 1e-12);
  expect_same(cohen_kappa(mixed, mixed, 3).value, 1);
  EXPECT_TRUE(std::isnan(cohen_kappa({}, {}, 3).value));
  EXPECT_THROW(static_cast<void>(cohen_kappa(same, mixed, 1)), Error);
  EXPECT_THROW(static_cast<void>(cohen_kappa(same, std::vector<int>(10, 3), 3)), Error);
  EXPECT_THROW(static_cast<void>(cohen_kappa(same, std::vector<int>(9, 1), 3)), Error);
}

TEST(CategoryAgreement, AsGwetsWithAndWithoutHoles) {
  const Json r = reference("agreement");
  for (const auto& [data, result] : {std::pair{"ratings", "ac1"}, std::pair{"with_holes", "ac1_with_holes"}}) {
    const Json& expected = *r.find(result);
    const CategoryAgreement c = category_agreement(ratings_of(*r.find(data)), kOneToFive);
    expect_same(c.percent, number(expected, "percent"), data);
    expect_same(c.ac1.value, number(expected, "value"), data);
    expect_same(c.ac1_standard_error, number(expected, "standard_error"), data);
    expect_same(c.ac1.interval.lo, number(expected, "lo"), data);
    expect_same(c.ac1.interval.hi, number(expected, "hi"), data);
    EXPECT_EQ(c.pairs_without_kappa, 0);
    EXPECT_GT(c.kappa_quadratic, c.kappa);
  }
  EXPECT_EQ(category_agreement(ratings_of(*r.find("with_holes")), kOneToFive).targets, 24U);
}

// The paradox: nearly all pass, raters agree on nine of ten, kappa says they do no better than chance; AC1 does not.
TEST(CategoryAgreement, WhereNearlyAllPass) {
  Ratings r = all_equal(20, 2, 1);
  r.at(3, 0) = 0;
  r.at(7, 1) = 0;
  const CategoryAgreement c = category_agreement(r, std::vector<double>{0, 1});
  expect_same(c.percent, 90);
  EXPECT_LT(c.kappa, 0);
  EXPECT_GT(c.ac1.value, 0.88);
}

TEST(CategoryAgreement, OfHardCases) {
  const CategoryAgreement equal = category_agreement(all_equal(8, 3, 4), kOneToFive);
  expect_same(equal.percent, 100);
  expect_same(equal.ac1.value, 1);
  EXPECT_TRUE(std::isnan(equal.kappa));
  EXPECT_EQ(equal.pairs_without_kappa, 3);
  const CategoryAgreement one = category_agreement(all_equal(8, 1, 4), kOneToFive);
  EXPECT_EQ(one.targets, 0U);
  EXPECT_TRUE(std::isnan(one.percent));
  EXPECT_TRUE(std::isnan(one.ac1.value));
  EXPECT_TRUE(std::isnan(category_agreement(Ratings(5, 2), kOneToFive).percent));
  EXPECT_THROW(static_cast<void>(category_agreement(all_equal(8, 2, 2.5), kOneToFive)), Error);
}

TEST(Icc, ShroutAndFleiss) {
  const Json r = reference("agreement");
  const Icc i = icc(ratings_of(*r.find("shrout_fleiss")));
  EXPECT_NEAR(i.ms_targets, 11.242, 5e-4);
  EXPECT_NEAR(i.ms_raters, 32.486, 5e-4);
  EXPECT_NEAR(i.ms_error, 1.019, 5e-4);
  EXPECT_NEAR(i.ms_within, 6.264, 5e-4);
  EXPECT_NEAR(i.one_1.value, 0.166, 5e-4);
  EXPECT_NEAR(i.a_1.value, 0.290, 5e-4);
  EXPECT_NEAR(i.c_1.value, 0.715, 5e-4);
  EXPECT_NEAR(i.one_k.value, 0.443, 5e-4);
  EXPECT_NEAR(i.a_k.value, 0.620, 5e-4);
  EXPECT_NEAR(i.c_k.value, 0.909, 5e-4);
}

TEST(Icc, AsPingouinAndMcGrawAndWong) {
  const Json r = reference("agreement");
  for (const auto& [data, result] : {std::pair{"shrout_fleiss", "icc_shrout_fleiss"}, std::pair{"ratings", "icc"}}) {
    const Icc i = icc(ratings_of(*r.find(data)));
    const Json& expected = *r.find(result);
    expect_same({i.ms_targets, i.ms_raters, i.ms_error, i.ms_within}, numbers(expected, "ms"), data);
    for (const auto& [form, estimate] : {std::pair{"1,1", i.one_1}, std::pair{"A,1", i.a_1}, std::pair{"C,1", i.c_1},
                                         std::pair{"1,k", i.one_k}, std::pair{"A,k", i.a_k}, std::pair{"C,k", i.c_k}})
      expect_same({estimate.value, estimate.interval.lo, estimate.interval.hi}, numbers(expected, form), form);
  }
}

TEST(Icc, AStrictRaterCountsForAgreementOnly) {
  Ratings r(12, 2);
  for (std::size_t t = 0; t < 12; ++t) {
    r.at(t, 0) = static_cast<double>(t);
    r.at(t, 1) = static_cast<double>(t) - 3;
  }
  const Icc i = icc(r);
  expect_same(i.c_1.value, 1);
  EXPECT_NEAR(i.a_1.value, 13.0 / (13.0 + 4.5), 1e-9);
  r.at(4, 1).reset();
  EXPECT_EQ(icc(r).left_out, 1U);
  EXPECT_EQ(icc(r).targets, 11U);
}

TEST(Icc, OfNothingToTellApart) {
  for (const Ratings& r : {all_equal(6, 3, 4), all_equal(6, 1, 4), all_equal(1, 3, 4), Ratings(6, 3)}) {
    const Icc i = icc(r);
    for (const Estimate& e : {i.one_1, i.a_1, i.c_1, i.one_k, i.a_k, i.c_k}) EXPECT_TRUE(std::isnan(e.value));
  }
}

TEST(BlandAltman, OfTwelvePairs) {
  const Json r = reference("agreement");
  const BlandAltman b = bland_altman(numbers(r, "x"), numbers(r, "y"));
  const Json& expected = *r.find("bland_altman");
  expect_same({b.bias.value, b.bias.interval.lo, b.bias.interval.hi}, numbers(expected, "bias"));
  expect_same(b.lower.value, number(expected, "lower"));
  expect_same((b.lower.interval.hi - b.lower.interval.lo) / 2, number(expected, "half"));
  expect_same(b.upper.value + b.lower.value, 2 * b.bias.value);
  EXPECT_TRUE(std::isnan(bland_altman(std::vector<double>{1, 2}, std::vector<double>{1, 2}).sd));
}

}  // namespace
}  // namespace osteo::statistics
