// What the analysis of a study says, of much and of too little, and its report.
#include "osteo/assessment/study/analysis.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "osteo/core/statistics/basics.h"
#include "study_example.h"

namespace osteo::study {
namespace {

double number(const Json& j, std::initializer_list<std::string_view> path) {
  const Json* at = &j;
  for (const std::string_view key : path) {
    at = at->find(key);
    if (at == nullptr) return std::nan("");
  }
  return at->number().value_or(std::nan(""));
}

bool refused(const Analysis& a, const std::string& what, const std::string& why) {
  for (const Json& r : a.json.find("refused")->items()) {
    if (r.find("what")->text()->starts_with(what) && r.find("why")->text()->find(why) != std::string::npos) return true;
  }
  return false;
}

TEST(Analyse, FindsWhatWasPutIn) {
  const Study s = example();
  const Analysis a = analyse(s, {0.95, 500});
  const Json& first = a.json.find("comparisons")->items()[0];
  EXPECT_EQ(*first.find("outcome")->text(), "rating: overall");
  EXPECT_EQ(*first.find("a")->text(), "expert");
  EXPECT_NEAR(number(first, {"difference"}), 1.5, 0.6);
  EXPECT_LT(number(first, {"permutation_p"}), 0.01);
  EXPECT_GT(number(first, {"hedges_g", "value"}), 1);
  EXPECT_EQ(number(first, {"mixed_model", "sessions"}), 28);
  EXPECT_NEAR(number(first, {"mixed_model", "difference"}), number(first, {"difference"}), 1e-9);
  const Json& noise = a.json.find("comparisons")->items()[2];
  EXPECT_EQ(*noise.find("outcome")->text(), "noise");
  EXPECT_GT(number(noise, {"p_holm"}), 0.05);
  const Json& seconds = a.json.find("correlations")->items()[0];
  EXPECT_LT(number(seconds, {"pearson", "value"}), -0.7);
  EXPECT_LT(std::abs(number(a.json.find("correlations")->items()[1], {"pearson", "value"})), 0.5);
  EXPECT_GT(number(a.json.find("roc")->items()[0], {"area", "value"}), 0.9);
  EXPECT_LT(number(a.json.find("roc")->items()[1], {"area", "value"}), 0.1);
  EXPECT_FALSE(*a.json.find("pass_marks")->items()[1].find("higher_is_better")->flag());
  EXPECT_GT(number(a.json, {"agreement", "overall", "icc_a_1", "value"}), 0.5);
  EXPECT_GT(number(a.json, {"agreement", "overall", "icc_a_k", "value"}),
            number(a.json, {"agreement", "overall", "icc_a_1", "value"}));
  // Of three comparisons together, and of one.
  EXPECT_NEAR(number(a.json.find("power")->items()[0], {"detectable_effect"}), 2.0, 0.15);
  Study one = s;
  one.plan.primary = {"rating: overall"};
  EXPECT_NEAR(number(analyse(one, {0.95, 100}).json.find("power")->items()[0], {"detectable_effect"}), 1.65, 0.15);
  EXPECT_TRUE(a.json.find("refused")->empty());
  EXPECT_EQ(a.json.dump(), analyse(s, {0.95, 500}).json.dump());
  EXPECT_EQ(sheet_html(a.sheet), sheet_html(analyse(s, {0.95, 500}).sheet));
  EXPECT_THROW(static_cast<void>(analyse(s, {1.5, 500})), Error);
  EXPECT_THROW(static_cast<void>(analyse(Study{plan_of(), {}, {}, {}, {}, {}})), Error);
}

TEST(Analyse, OneRater) {
  const Analysis a = analyse(example(5, 1), {0.95, 200});
  EXPECT_TRUE(refused(a, "Agreement", "one rater"));
  EXPECT_FALSE(a.json.find("comparisons")->empty());
}

TEST(Analyse, NoRatings) {
  const Analysis a = analyse(example(5, 0), {0.95, 200});
  EXPECT_TRUE(refused(a, "Agreement", "no ratings"));
  EXPECT_TRUE(refused(a, "Correlation", "no ratings"));
  EXPECT_EQ(*a.json.find("comparisons")->items()[0].find("outcome")->text(), "seconds");
}

TEST(Analyse, AllRatingsEqual) {
  Study s = example(5, 3);
  for (RaterSheet& r : s.raters) {
    for (auto& [blind, items] : r.sessions) items["overall"] = 3;
  }
  const Analysis a = analyse(s, {0.95, 200});
  EXPECT_EQ(number(a.json, {"agreement", "overall", "percent"}), 100);
  EXPECT_TRUE(std::isnan(number(a.json, {"agreement", "overall", "kappa"})));
  EXPECT_TRUE(std::isnan(number(a.json, {"agreement", "overall", "icc_a_1", "value"})));
  EXPECT_TRUE(refused(a, "Correlation of seconds", "never varies"));
  EXPECT_EQ(number(a.json.find("comparisons")->items()[0], {"permutation_p"}), 1);
  EXPECT_TRUE(std::isnan(number(a.json.find("comparisons")->items()[0], {"hedges_g", "value"})));
  // What has no value is null in the file.
  EXPECT_NE(a.json.dump().find("\"kappa\":null"), std::string::npos);
  EXPECT_EQ(number(a.json.find("roc")->items()[0], {"area", "value"}), 0.5);
  EXPECT_TRUE(refused(a, "Pass mark (rating: overall)", "do not cross"));
  EXPECT_FALSE(sheet_pdf(a.sheet).empty());
}

// The metric "echo" follows the ratings only because "seconds" does: once that is held, little is left.
TEST(Analyse, WhatIsHeldIsTakenAway) {
  Study s = example(12);
  s.metrics.push_back("echo");
  statistics::Random random(11);
  for (Session& one : s.sessions) one.metrics["echo"] = one.metrics["seconds"] + 40 * random.normal();
  s.sessions[5].metrics.erase("seconds");
  const Analysis plain = analyse(s, {0.95, 200}), a = analyse(s, {0.95, 200, {"seconds"}});
  const auto of = [](const Analysis& from, std::string_view metric) -> const Json& {
    for (const Json& c : from.json.find("correlations")->items())
      if (*c.find("metric")->text() == metric) return c;
    throw Error(ExitCode::failed, "no such correlation");
  };
  EXPECT_EQ(of(plain, "echo").find("partial_pearson"), nullptr);
  const Json &echo = of(a, "echo"), &own = of(a, "seconds");
  EXPECT_LT(number(echo, {"pearson", "value"}), -0.6);
  EXPECT_LT(std::abs(number(echo, {"partial_pearson", "value"})), 0.3);
  EXPECT_LT(std::abs(number(echo, {"partial_spearman", "value"})), 0.35);
  EXPECT_EQ(number(echo, {"sessions_with_all"}), number(echo, {"sessions"}) - 1);
  EXPECT_GT(number(echo, {"partial_pearson", "p"}), 0.01);
  // The other way round the cause keeps what it says.
  EXPECT_LT(number(of(analyse(s, {0.95, 200, {"echo"}}), "seconds"), {"partial_pearson", "value"}), -0.4);
  EXPECT_TRUE(std::isnan(number(own, {"partial_pearson", "value"})));
  EXPECT_TRUE(refused(a, "Partial correlation of seconds", "among what is held"));
  EXPECT_NE(sheet_html(a.sheet).find("r, held"), std::string::npos);
  EXPECT_EQ(sheet_html(plain.sheet).find("held"), std::string::npos);
  EXPECT_NE(message_of([&] {
              static_cast<void>(analyse(s, {0.95, 200, {"second"}}));
            }).find("'second' is no metric"),
            std::string::npos);
}

TEST(Analyse, MissingRatingsAndMetrics) {
  Study s = example(5, 3);
  s.raters[0].sessions.erase("B0");
  s.raters[1].sessions["B1"]["overall"].reset();
  for (RaterSheet& r : s.raters) r.sessions.erase("B2");
  s.sessions[3].metrics.erase("seconds");
  const Analysis a = analyse(s, {0.95, 200});
  EXPECT_EQ(number(a.json, {"agreement", "overall", "icc_sessions_left_out"}), 3);
  EXPECT_EQ(number(a.json, {"agreement", "overall", "sessions_rated_twice"}), 19);
  const auto& missing = a.json.find("missing")->items();
  ASSERT_EQ(missing.size(), 2U);
  EXPECT_EQ(number(missing[0], {"sessions_without"}), 1);
  EXPECT_EQ(number(a.json.find("correlations")->items()[0], {"sessions"}), 18);
  // What one rater left out alone is told too, though each of these sessions has a mean.
  const auto& ratings = a.json.find("ratings")->items();
  ASSERT_EQ(ratings.size(), 3U);
  EXPECT_EQ(number(ratings[0], {"given"}), 18);
  EXPECT_EQ(number(ratings[1], {"given"}), 18);
  EXPECT_EQ(number(ratings[2], {"given"}), 19);
  EXPECT_EQ(number(ratings[2], {"of"}), 20);
  EXPECT_NE(sheet_html(a.sheet).find("R1: 2 of 20 ratings were not given"), std::string::npos);
}

TEST(Analyse, OneGroup) {
  const Analysis a = analyse(example(6, 2, plan_of({"resident"})), {0.95, 200});
  EXPECT_TRUE(refused(a, "Comparison", "one group"));
  EXPECT_TRUE(refused(a, "ROC and pass mark", "one group"));
  EXPECT_TRUE(refused(a, "Power", "one group"));
  EXPECT_FALSE(a.json.find("agreement")->empty());
  EXPECT_EQ(a.json.find("correlations")->items().size(), 2U);
}

TEST(Analyse, ThreePeople) {
  Study s = example(2, 2);
  s.sessions.resize(6);
  s.participants.pop_back();
  for (RaterSheet& r : s.raters) {
    r.sessions.erase("B6");
    r.sessions.erase("B7");
  }
  const Analysis a = analyse(s, {0.95, 200});
  EXPECT_TRUE(refused(a, "Comparison of expert and novice", "3 in each are needed"));
  EXPECT_TRUE(refused(a, "Correlation of seconds", "5 are needed"));
  EXPECT_TRUE(refused(a, "ROC and pass mark", "3 each are needed"));
  EXPECT_TRUE(refused(a, "Power", "two people"));
  // Said once for each pair of groups, not for each outcome.
  int said = 0;
  for (const Json& r : a.json.find("refused")->items())
    said += r.find("what")->text()->starts_with("Comparison") ? 1 : 0;
  EXPECT_EQ(said, 1);
}

TEST(Analyse, ThreeInAGroupAreToldWhatTheyCannotShow) {
  const Analysis a = analyse(example(3, 2), {0.95, 200});
  EXPECT_EQ(number(a.json.find("comparisons")->items()[0], {"permutation_smallest_p"}), 0.1);
  EXPECT_NE(sheet_html(a.sheet).find("so few people that no result whatever"), std::string::npos);
  EXPECT_TRUE(refused(a, "Pass marks", "5 each are needed"));
}

TEST(Analyse, ThreeGroupsAndSeveralItems) {
  Plan plan = plan_of({"novice", "resident", "expert"});
  plan.items = {"overall", "care"};
  Study s = example(4, 2, plan);
  for (RaterSheet& r : s.raters) {
    for (auto& [blind, items] : r.sessions) items["care"] = 6 - *items["overall"];
  }
  const Analysis a = analyse(s, {0.95, 200});
  // Three pairs of groups, two items, their mean and two metrics.
  EXPECT_EQ(a.json.find("comparisons")->items().size(), 15U);
  // The mean of items that are each other's opposite never varies.
  EXPECT_TRUE(refused(a, "Correlation of seconds", "never varies"));
}

// Seven against seven that do not overlap in "seconds", and 88 columns more: the shape of a score's row.
Study separated(int each) {
  Study s = example(each, 0);
  for (Session& one : s.sessions) {
    const bool novice = one.participant[0] == 'n';
    one.metrics["seconds"] = (novice ? 500 : 300) + std::fmod(std::stod(one.participant.substr(1)) * 37, 40);
  }
  statistics::Random random(5);
  for (int m = 0; m < 88; ++m) {
    s.metrics.push_back("column " + std::to_string(m));
    for (Session& one : s.sessions) one.metrics[s.metrics.back()] = random.normal();
  }
  return s;
}
const Json& comparison(const Analysis& a, std::string_view outcome) {
  for (const Json& c : a.json.find("comparisons")->items())
    if (*c.find("outcome")->text() == outcome) return c;
  throw Error(ExitCode::failed, "no such comparison");
}

TEST(Plan, SevenAndSevenThatDoNotOverlapAreFoundWhereThePrimaryOutcomeWasNamed) {
  Study s = separated(7);
  // Of 90 nothing could be found, and the report says that.
  Analysis a = analyse(s, {0.95, 100});
  EXPECT_GT(number(comparison(a, "seconds"), {"p_holm"}), 0.05);
  EXPECT_TRUE(std::isnan(number(a.json.find("power")->items()[0], {"detectable_effect"})));
  EXPECT_NE(sheet_html(a.sheet).find("nothing can be found, however large the difference"), std::string::npos);
  EXPECT_NE(sheet_html(a.sheet).find("No primary outcome was named"), std::string::npos);

  s.plan.primary = {"seconds", "noise"};
  a = analyse(s, {0.95, 100});
  EXPECT_NEAR(number(comparison(a, "seconds"), {"p_holm"}), 2 * 2 / 3432.0, 1e-12);
  EXPECT_TRUE(*comparison(a, "seconds").find("primary")->flag());
  EXPECT_TRUE(comparison(a, "column 3").find("p_holm")->is_null());
  EXPECT_FALSE(*comparison(a, "column 3").find("primary")->flag());
  const Json& reach = a.json.find("power")->items()[0];
  EXPECT_EQ(number(reach, {"comparisons"}), 2);
  EXPECT_NEAR(number(reach, {"smallest_p"}), 2 / 3432.0, 1e-12);
  // Welch's test at 0.025 instead of 0.05 needs more than the 1.65 of one comparison.
  EXPECT_GT(number(reach, {"detectable_effect"}), 1.7);
  EXPECT_LT(number(reach, {"detectable_effect"}), 2.1);
  // What was not found, in its own unit; what was is not among it.
  const auto& missed = a.json.find("not_found")->items();
  ASSERT_EQ(missed.size(), 1U);
  EXPECT_EQ(*missed[0].find("outcome")->text(), "noise");
  EXPECT_GT(number(missed[0], {"least_difference"}), 0.3);
  EXPECT_LT(number(missed[0], {"least_difference"}), 4);

  s.plan.primary = {"seconds", "courage"};
  s.plan.primary_after = 3;
  a = analyse(s, {0.95, 100});
  EXPECT_TRUE(refused(a, "Primary outcome courage", "No session"));
  EXPECT_NE(sheet_html(a.sheet).find("3 sessions were in the study already"), std::string::npos);
}

TEST(Plan, TwelveAndTwelveAreExchangedInAllWaysOrOftenEnough) {
  Study s = separated(12);
  s.metrics.resize(8);
  s.plan.primary = {"seconds"};
  Analysis a = analyse(s, {0.95, 100});
  EXPECT_TRUE(*comparison(a, "seconds").find("permutation_exact")->flag());
  EXPECT_NEAR(number(comparison(a, "seconds"), {"p_holm"}), 2 / 2704156.0, 1e-12);
  // Where they are drawn, the smallest p leaves room for as many as are held together.
  s.plan.primary.clear();
  a = analyse(s, {0.95, 100});
  EXPECT_FALSE(*comparison(a, "seconds").find("permutation_exact")->flag());
  EXPECT_LT(number(comparison(a, "seconds"), {"p_holm"}), 0.01);
}

TEST(Plan, BeforeTheFirstSessionItGoesByWhoTakesPart) {
  Study s;
  s.plan = plan_of();
  for (int i = 0; i < 7; ++i)
    for (const char* const g : {"novice", "expert"}) s.participants.push_back({g + std::to_string(i), g});
  s.plan.primary = {"a", "b"};
  const std::vector<Reach> r = reach_of(s);
  ASSERT_EQ(r.size(), 1U);
  EXPECT_EQ(r[0].people_a, 7U);
  EXPECT_EQ(r[0].comparisons, 2U);
  EXPECT_NE(reported(r[0]).find("2 comparisons together"), std::string::npos);
  // More than a hundred at once: none.
  s.plan.primary.clear();
  EXPECT_TRUE(std::isnan(reach_of(s, 134)[0].detectable_effect));
  s.participants.resize(3);
  EXPECT_NE(reported(reach_of(s)[0]).find("too few"), std::string::npos);
}

TEST(Report, SaysWhereSessionsComeFromWhereTheyAreNotAlike) {
  Study s = example(4, 0);
  for (Session& one : s.sessions) one.source = {one.blind, "b", "p", "1", "1"};
  const AnalysisSettings quick{0.95, 100, {}};
  std::string html = sheet_html(analyse(s, quick).sheet);
  for (const char* const words :
       {"bare numbers", "drilled by a program", "cut short", "another bone", "different procedures", "versions"})
    EXPECT_EQ(html.find(words), std::string::npos) << words;
  s.sessions[0].source = {};
  s.sessions[1].source.simulated = true;
  s.sessions[2].source.cut_short = true;
  s.sessions[3].source.other_bone = true;
  s.sessions[4].source.procedure = "q";
  s.sessions[5].source.scored_by = "2";
  const Analysis a = analyse(s, quick);
  html = sheet_html(a.sheet);
  for (const char* const words :
       {"bare numbers", "drilled by a program", "cut short", "another bone", "different procedures", "versions"})
    EXPECT_NE(html.find(words), std::string::npos) << words;
  // Simulated sessions are labelled so whatever study.json says.
  EXPECT_NE(html.find("SIMULATED"), std::string::npos);
  EXPECT_TRUE(*a.json.find("simulated")->flag());
  EXPECT_EQ(number(a.json, {"sources", "unknown"}), 1);
}

TEST(Report, HasAChartForWhatItComparesAndSaysWhenItIsSimulated) {
  const auto count = [](const std::string& html, const std::string& what) {
    int n = 0;
    for (std::size_t at = html.find(what); at != std::string::npos; at = html.find(what, at + 1)) ++n;
    return n;
  };
  Study s = example();
  AnalysisSettings quick;
  quick.resamples = 100;
  const std::string html = sheet_html(analyse(s, quick).sheet);
  EXPECT_EQ(count(html, "id=\"groups-"), 3);  // a rating, two metrics
  EXPECT_EQ(count(html, "id=\"scatter-"), 2);
  EXPECT_EQ(count(html, "id=\"roc-"), 3);
  EXPECT_EQ(count(html, "id=\"agreement-"), 3);  // three pairs of raters
  EXPECT_EQ(count(html, "SIMULATED"), 0);
  // Whole numbers are written out.
  Study slow = s;
  for (Session& one : slow.sessions) one.metrics["seconds"] *= 10;
  EXPECT_EQ(count(sheet_html(analyse(slow, quick).sheet), "e+0"), 0);
  s.plan.simulated = true;
  const Analysis simulated = analyse(s, quick);
  EXPECT_GE(count(sheet_html(simulated.sheet), "SIMULATED"), 1);
  EXPECT_TRUE(*simulated.json.find("simulated")->flag());
  // One group: no charts of what is not compared, and no crash.
  EXPECT_EQ(count(sheet_html(analyse(example(3, 0, plan_of({"novice"})), quick).sheet), "id=\"roc-"), 0);
}

}  // namespace
}  // namespace osteo::study
