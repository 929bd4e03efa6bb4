// The same people under several conditions, beside statsmodels, pingouin and SciPy.
#include "osteo/core/statistics/repeated.h"

#include "osteo/core/base/error.h"
#include "reference.h"

namespace osteo::statistics {
namespace {

TEST(Within, RepeatedMeasuresAsPingouinAndStatsmodels) {
  const Json all = reference("within");
  for (const Json& c : all.find("anova")->items()) {
    const auto k = static_cast<std::size_t>(number(c, "conditions"));
    const std::vector<double> values = numbers(c, "values");
    const RepeatedAnova a = repeated_anova(values, k);
    expect_same(a.f, number(c, "f"), "f");
    expect_same(a.p, number(c, "p"), "p");
    expect_same(a.df_conditions, number(c, "df_conditions"));
    expect_same(a.df_error, number(c, "df_error"));
    expect_same(a.epsilon_gg, number(c, "epsilon_gg"), "gg");
    expect_same(a.epsilon_hf, number(c, "epsilon_hf"), "hf");
    expect_same(a.p_gg, number(c, "p_gg"));
    expect_same(a.p_hf, number(c, "p_hf"));
    expect_same(a.partial_eta2, number(c, "partial_eta2"));
    expect_same(a.generalised_eta2, number(c, "generalised_eta2"));
    std::vector<std::vector<double>> groups(k);
    for (std::size_t i = 0; i < values.size(); ++i) groups[i % k].push_back(values[i]);
    const OneWayAnova pooled = one_way_anova(groups);
    expect_same(pooled.f, number(c, "pooled_f"));
    expect_same(pooled.p, number(c, "pooled_p"));
    const Paired d = paired(groups[0], groups[1]);
    const Json& p = *c.find("paired");
    expect_same(d.difference, number(p, "difference"));
    expect_same(d.t, number(p, "t"));
    expect_same(d.p, number(p, "p"));
    expect_same({d.interval.lo, d.interval.hi}, numbers(p, "interval"));
    expect_same(d.dz.value, number(p, "dz"));
    expect_same({d.dz.interval.lo, d.dz.interval.hi}, numbers(p, "dz_interval"), "dz");
    expect_same(d.g_av.value, number(p, "g_av"));
    expect_same({d.g_av.interval.lo, d.g_av.interval.hi}, numbers(p, "g_av_interval"), "g");
    // Two conditions: the analysis of variance is the t test.
    if (k == 2) expect_same(a.f, d.t * d.t);
  }
}

TEST(Within, PowerAsStatsmodels) {
  const Json all = reference("within");
  for (const Json& c : all.find("power")->items())
    expect_same(power_paired(static_cast<std::size_t>(number(c, "people")), number(c, "dz")), number(c, "power"));
  EXPECT_EQ(people_needed_paired(0.5), 34);
  EXPECT_EQ(people_needed_paired(0.8), 15);
  EXPECT_EQ(people_needed_paired(0.5, 0.8, 0.05 / 3), 45);
  EXPECT_NEAR(detectable_dz(12), 0.89, 0.005);
  EXPECT_NEAR(power_paired(12, detectable_dz(12)), 0.8, 1e-6);
  EXPECT_TRUE(std::isnan(people_needed_paired(0)));
}

TEST(Within, WhatIsNotDefinedAndWhatCannotBeAsked) {
  // Everybody alike: nothing is left to err.
  EXPECT_TRUE(std::isnan(repeated_anova(std::vector<double>{1, 2, 1, 2, 1, 2}, 2).f));
  EXPECT_TRUE(std::isnan(paired(std::vector<double>{1, 2, 3}, std::vector<double>{2, 3, 4}).p));
  EXPECT_TRUE(std::isnan(paired(std::vector<double>{1}, std::vector<double>{2}).p));
  EXPECT_THROW((void)repeated_anova(std::vector<double>{1, 2, 3}, 2), Error);
  EXPECT_THROW((void)repeated_anova(std::vector<double>{1, 2}, 2), Error);
  EXPECT_THROW((void)repeated_anova(std::vector<double>{1, 2, 3, kUndefined}, 2), Error);
  EXPECT_THROW((void)one_way_anova(std::vector<std::vector<double>>{{1, 2}}), Error);
  EXPECT_THROW((void)one_way_anova(std::vector<std::vector<double>>{{1, 2}, {}}), Error);
  EXPECT_THROW((void)paired(std::vector<double>{1, 2}, std::vector<double>{1}), Error);
  EXPECT_THROW((void)power_paired(1, 0.5), Error);
}

}  // namespace
}  // namespace osteo::statistics
