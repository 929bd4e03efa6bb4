// Comparison of groups, correlation, decisions: as Python's libraries, by definition, and where there is too little.
#include "osteo/core/statistics/compare.h"

#include "osteo/core/base/error.h"
#include "osteo/core/statistics/curves.h"
#include "reference.h"

namespace osteo::statistics {
namespace {

TEST(Compare, AsTheLibrariesOfPython) {
  const Json all = reference("compare");
  for (const Json& set : all.find("sets")->items()) {
    const auto a = numbers(set, "a"), b = numbers(set, "b");
    const Welch w = welch(a, b);
    expect_same({w.t, w.df, w.p, w.interval.lo, w.interval.hi}, numbers(set, "welch"), "welch");
    const MannWhitney u = mann_whitney(a, b);
    EXPECT_TRUE(u.exact);
    expect_same(u.u, number(set, "u"), "u");
    expect_same(u.p, number(set, "u_p"), "p of u");
    if (const Json* p = set.find("permutation_p")) {
      const Permutation exact = permutation_of_means(a, b);
      EXPECT_TRUE(exact.exact);
      expect_same(exact.p, number(*p), "permutation");
      // By chance nearly the same.
      const Permutation drawn = permutation_of_means(a, b, {10, 20000, 3});
      EXPECT_FALSE(drawn.exact);
      EXPECT_NEAR(drawn.p, exact.p, 0.02);
    }
    const Estimate g = hedges_g(a, b), d = cliffs_delta(a, b);
    expect_same({g.value, g.interval.lo, g.interval.hi}, numbers(set, "g"), "g");
    expect_same({d.value, d.interval.lo, d.interval.hi}, numbers(set, "delta"), "delta");
    const Roc r = roc(a, b);
    const Json& expected = *set.find("roc");
    expect_same(r.area.value, number(expected, "area"));
    expect_same(r.standard_error, number(expected, "standard_error"));
    expect_same(r.area.interval.lo, number(expected, "lo"));
    expect_same(r.area.interval.hi, number(expected, "hi"));
    std::vector<double> true_positive, false_positive;
    for (const auto& p : r.curve) {
      true_positive.push_back(p.true_positive);
      false_positive.push_back(p.false_positive);
    }
    expect_same(true_positive, numbers(expected, "true_positive"));
    expect_same(false_positive, numbers(expected, "false_positive"));
    // Where no threshold is better than letting nobody pass, it is infinite, which JSON has no number for.
    const double best = number(expected, "best_threshold");
    if (std::isnan(best)) {
      EXPECT_TRUE(std::isinf(r.best.threshold));
    } else {
      expect_same(r.best.threshold, best);
    }
  }
}

TEST(Compare, BeyondEightyPeopleByTheNormalCurve) {
  // The exact count of the same groups, of which the libraries' approximation is checked too.
  const Json all = reference("compare");
  for (const Json& set : all.find("sets")->items()) {
    auto a = numbers(set, "a"), b = numbers(set, "b");
    std::vector<double> aa, bb;
    for (int k = 0; k < 12; ++k) {
      aa.insert(aa.end(), a.begin(), a.end());
      bb.insert(bb.end(), b.begin(), b.end());
    }
    if (aa.size() + bb.size() <= 80) continue;
    const MannWhitney u = mann_whitney(aa, bb);
    EXPECT_FALSE(u.exact);
    expect_same(u.u, 144 * number(set, "u"));
    EXPECT_GT(u.p, 0);
    EXPECT_LE(u.p, number(set, "u_p"));
  }
  EXPECT_EQ(mann_whitney(std::vector<double>(50, 1.0), std::vector<double>(50, 1.0)).p, 1);
}

TEST(Compare, TurnedRoundIsTheOther) {
  const std::vector<double> a{1, 2, 2, 5, 7}, b{2, 3, 3, 4};
  EXPECT_DOUBLE_EQ(welch(a, b).t, -welch(b, a).t);
  EXPECT_DOUBLE_EQ(hedges_g(a, b).value, -hedges_g(b, a).value);
  EXPECT_NEAR(hedges_g(a, b).interval.lo, -hedges_g(b, a).interval.hi, 1e-9);
  EXPECT_NEAR(cliffs_delta(a, b).interval.lo, -cliffs_delta(b, a).interval.hi, 1e-12);
  EXPECT_DOUBLE_EQ(mann_whitney(a, b).p, mann_whitney(b, a).p);
  EXPECT_DOUBLE_EQ(mann_whitney(a, b).u, 20 - mann_whitney(b, a).u);
  EXPECT_DOUBLE_EQ(roc(a, b).area.value, 1 - roc(b, a).area.value);
  EXPECT_NEAR(cliffs_delta(a, b).value, 2 * roc(a, b).area.value - 1, 1e-12);
}

TEST(Compare, GroupsThatDoNotOverlap) {
  const std::vector<double> low{1, 2, 3}, high{11, 12, 13, 14};
  expect_same(mann_whitney(low, high).p, 2.0 / 35);
  expect_same(permutation_of_means(low, high).smallest_p, 2.0 / 35);
  const Estimate d = cliffs_delta(high, low);
  EXPECT_EQ(d.value, 1);
  EXPECT_EQ(d.interval.hi, 1);
  // Three people cannot show that there is no overlap at all.
  EXPECT_LT(d.interval.lo, 0.1);
  const Roc r = roc(high, low);
  EXPECT_EQ(r.area.value, 1);
  EXPECT_NEAR(r.area.interval.lo, (1 + d.interval.lo) / 2, 1e-9);
  EXPECT_EQ(r.best.threshold, 11);
  EXPECT_GT(hedges_g(high, low).interval.lo, 0);
}

TEST(Compare, NoOverlapIsExactlyOneForAnySizes) {
  for (int m = 2; m <= 12; ++m) {
    for (int n = 2; n <= 12; ++n) {
      std::vector<double> high, low;
      for (int i = 0; i < m; ++i) high.push_back(100 + 0.1 * i);
      for (int i = 0; i < n; ++i) low.push_back(0.1 * i);
      const Estimate d = cliffs_delta(high, low), turned = cliffs_delta(low, high);
      EXPECT_EQ(d.value, 1);
      EXPECT_LT(d.interval.lo, 0.7);
      EXPECT_EQ(turned.value, -1);
      EXPECT_GT(turned.interval.hi, -0.7);
      EXPECT_EQ(roc(high, low).area.value, 1);
      EXPECT_LT(roc(high, low).area.interval.lo, 0.85);
      EXPECT_EQ(roc(low, high).area.value, 0);
    }
  }
}

TEST(Compare, TooLittle) {
  const std::vector<double> one{1}, two{1, 2}, same{3, 3, 3};
  EXPECT_TRUE(std::isnan(welch(one, two).p));
  EXPECT_DOUBLE_EQ(welch(one, two).difference, -0.5);
  EXPECT_TRUE(std::isnan(welch(same, same).t));
  EXPECT_TRUE(std::isnan(hedges_g(same, same).value));
  EXPECT_TRUE(std::isnan(hedges_g(one, two).value));
  EXPECT_TRUE(std::isnan(mann_whitney({}, two).p));
  EXPECT_TRUE(std::isnan(permutation_of_means({}, two).p));
  EXPECT_EQ(mann_whitney(same, same).p, 1);
  EXPECT_EQ(permutation_of_means(same, same).p, 1);
  EXPECT_EQ(cliffs_delta(same, same).value, 0);
  EXPECT_TRUE(std::isnan(roc({}, two).area.value));
  EXPECT_TRUE(std::isnan(roc(one, two).standard_error));
  EXPECT_THROW(static_cast<void>(welch(std::vector<double>{kUndefined}, two)), Error);
  EXPECT_THROW(static_cast<void>(welch(two, two, 1.0)), Error);
}

TEST(Correlation, AsScipy) {
  const Json r = reference("correlation");
  const auto x = numbers(r, "x");
  const Correlation p = pearson(x, numbers(r, "y")), s = spearman(x, numbers(r, "y_tied"));
  expect_same({p.r, p.p, p.interval.lo, p.interval.hi}, numbers(r, "pearson"));
  expect_same({s.r, s.p}, numbers(r, "spearman"));
}

TEST(Correlation, OfWhatDoesNotVaryOrVariesWholly) {
  const std::vector<double> x{1, 2, 3, 4}, same(4, 0.1), squares{1, 4, 9, 16};
  EXPECT_TRUE(std::isnan(pearson(x, same).r));
  EXPECT_TRUE(std::isnan(spearman(same, x).r));
  EXPECT_EQ(pearson(x, x).r, 1);
  EXPECT_EQ(pearson(x, x).p, 0);
  EXPECT_EQ(spearman(x, squares).r, 1);
  EXPECT_TRUE(std::isnan(pearson(std::vector<double>{1, 2}, std::vector<double>{1, 2}).r));
  EXPECT_THROW(static_cast<void>(pearson(x, std::vector<double>{1})), Error);
}

TEST(Correlation, WithOthersHeldAsPingouin) {
  const Json r = reference("partial_correlation");
  const auto x = numbers(r, "x"), y = numbers(r, "y");
  const std::vector<std::vector<double>> both{numbers(r, "first"), numbers(r, "second")};
  const auto all_of = [](const Correlation& c) { return std::vector<double>{c.r, c.p, c.interval.lo, c.interval.hi}; };
  expect_same(all_of(partial_pearson(x, y, std::span(both).first(1))), numbers(r, "pearson_one"));
  expect_same(all_of(partial_pearson(x, y, both)), numbers(r, "pearson_two"));
  expect_same(all_of(partial_spearman(x, y, both)), numbers(r, "spearman_two"));
  // Nothing held: the plain one.
  const Correlation plain = pearson(x, y);
  expect_same(all_of(partial_pearson(x, y, {})), all_of(plain));
  // In other units it is the same.
  std::vector<std::vector<double>> scaled = both;
  for (double& v : scaled[1]) v = 1e6 * v - 3e8;
  expect_same({partial_pearson(x, y, scaled).r}, {partial_pearson(x, y, both).r});
}

TEST(Correlation, WhatIsHeldMayLeaveNothing) {
  const std::vector<double> x{1, 2, 3, 4, 5, 7}, y{2, 1, 4, 3, 6, 5}, same(6, 0.1);
  const auto just = [](std::vector<double> v) { return std::vector<std::vector<double>>{std::move(v)}; };
  std::vector<double> of_x = x;
  for (double& v : of_x) v = 3 * v + 1;
  EXPECT_TRUE(std::isnan(partial_pearson(x, y, just(of_x)).r)) << "x itself is held";
  EXPECT_TRUE(std::isnan(partial_pearson(x, y, just(same)).r)) << "a list that never varies";
  std::vector<double> twice = y;
  for (double& v : twice) v *= 2;
  const std::vector<double> other{5, 1, 2, 8, 3, 4};
  EXPECT_TRUE(std::isnan(partial_pearson(x, other, std::vector<std::vector<double>>{y, twice}).r))
      << "one follows from the other";
  EXPECT_TRUE(std::isnan(partial_pearson(std::span(x).first(3), std::span(y).first(3), just({1, 5, 2})).r));
  EXPECT_TRUE(std::isfinite(partial_pearson(x, y, just(other)).r));
  EXPECT_THROW(static_cast<void>(partial_pearson(x, y, just({1, 2}))), Error);
  EXPECT_THROW(static_cast<void>(partial_spearman(x, y, just(std::vector<double>(6, kUndefined)))), Error);
}

// Twenty sessions of four people who differ: the interval knows that there are four.
TEST(Correlation, PeopleNotSessionsAreDrawn) {
  Random random(4);
  std::vector<double> x, y;
  std::vector<int> person, everyone_another;
  for (int p = 0; p < 10; ++p) {
    const double a = random.normal(), b = random.normal();
    for (int k = 0; k < 6; ++k) {
      x.push_back(a + 0.1 * random.normal());
      y.push_back(b + 0.1 * random.normal());
      person.push_back(100 - p);
      everyone_another.push_back(static_cast<int>(x.size()));
    }
  }
  const auto by_people = correlation_by_people(x, y, person), by_pairs = correlation_by_people(x, y, everyone_another);
  EXPECT_EQ(by_people.people, 10U);
  EXPECT_EQ(by_people.pairs, 60U);
  const auto width = [](const Bootstrap& b) { return b.interval.hi - b.interval.lo; };
  EXPECT_GT(width(by_people.pearson_by_people), 1.7 * width(by_pairs.pearson_by_people));
  EXPECT_GT(width(by_people.spearman_by_people), 1.7 * width(by_pairs.spearman_by_people));
  EXPECT_EQ(by_people.pearson.r, by_pairs.pearson.r);
}

TEST(PassMark, AsItsDefinition) {
  const Json r = reference("decide");
  const PassMark m = contrasting_groups(numbers(r, "a"), numbers(r, "b"), {500, 0.95, 1});
  expect_same(m.mark.value, number(r, "mark"));
  expect_same(m.competent_fail_fitted, number(r, "competent_fail"));
  expect_same(m.other_pass_fitted, number(r, "other_pass"));
  EXPECT_LT(m.mark.interval.lo, m.mark.value);
  EXPECT_GT(m.mark.interval.hi, m.mark.value);
  EXPECT_TRUE(m.higher_is_better);
}

TEST(PassMark, HalfWayOfEqualSpreads) {
  const std::vector<double> better{4, 5, 6}, worse{1, 2, 3};
  const PassMark m = contrasting_groups(better, worse, {200, 0.95, 1});
  EXPECT_NEAR(m.mark.value, 3.5, 1e-12);
  EXPECT_EQ(m.competent_fail_counted, 0);
  EXPECT_EQ(m.other_pass_counted, 0);
  // Seconds: fewer are better.
  const PassMark down = contrasting_groups(worse, better, {200, 0.95, 1});
  EXPECT_FALSE(down.higher_is_better);
  EXPECT_NEAR(down.mark.value, 3.5, 1e-12);
  EXPECT_NEAR(down.competent_fail_fitted, m.competent_fail_fitted, 1e-12);
  EXPECT_TRUE(std::isnan(contrasting_groups(better, better).mark.value));
  EXPECT_TRUE(std::isnan(contrasting_groups(better, std::vector<double>{1, 1, 1}).mark.value));
  EXPECT_TRUE(std::isnan(contrasting_groups(std::vector<double>{4}, worse).mark.value));
  // One spread so much wider that the curves do not cross between the means.
  EXPECT_TRUE(
      std::isnan(contrasting_groups(std::vector<double>{-9, 0.05, 9.1}, std::vector<double>{-0.1, 0, 0.1}).mark.value));
}

TEST(Power, AsTheNonCentralT) {
  const Json r = reference("decide");
  for (const Json& row : r.find("power")->items()) {
    const auto v = numbers(row);
    const auto n = static_cast<std::size_t>(v[1]);
    PowerSettings s;
    s.effect = v[0];
    s.draws = 5000;
    // Welch's test loses a little to Student's where groups are tiny.
    EXPECT_NEAR(power_two_groups(n, n, s).value, v[2], n < 10 ? 0.06 : 0.02) << v[0] << " of " << n;
  }
  for (const Json& row : r.find("needed")->items()) {
    const auto v = numbers(row);
    PowerSettings s;
    s.effect = v[0];
    EXPECT_NEAR(people_needed(0.8, s), v[1], 1.5 + 0.04 * v[1]);
  }
}

TEST(Power, SessionsOfOnePersonHelpOnlySoFar) {
  PowerSettings once, often, alike;
  often.sessions = 4;
  alike.sessions = 4;
  alike.icc = 1;
  const double p = power_two_groups(10, 10, once).value;
  EXPECT_GT(power_two_groups(10, 10, often).value, p + 0.2);
  EXPECT_EQ(power_two_groups(10, 10, alike).value, p);
  const double effect = detectable_effect(8, 7);
  EXPECT_GT(effect, 1.4);
  EXPECT_LT(effect, 1.8);
  PowerSettings none;
  none.effect = 0;
  EXPECT_TRUE(std::isnan(people_needed(0.8, none)));
  EXPECT_TRUE(std::isnan(detectable_effect(2, 2, 0.999)));
  EXPECT_THROW(static_cast<void>(power_two_groups(1, 5, once)), Error);
}

}  // namespace
}  // namespace osteo::statistics
