// A study from its first file to its report: what is written, what is refused and where, and what the analysis says of
// too little.
#include "osteo/assessment/study/study.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <regex>
#include <set>

#include "osteo/assessment/study/analysis.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/param.h"
#include "osteo/core/statistics/basics.h"
#include "scratch.h"

namespace osteo::study {
namespace {

Plan plan_of(std::vector<std::string> groups = {"novice", "expert"}) {
  Plan p;
  p.title = "Facial recess";
  p.procedure = "cortical mastoidectomy";
  p.competent = groups.back();
  p.groups = std::move(groups);
  p.cases = {"left", "right"};
  p.attempts = 2;
  p.items = {"overall"};
  p.seed = 7;
  return p;
}

// People of unlike skill, sessions whose seconds fall and whose ratings rise with it.
Study example(int each = 7, int raters = 3, Plan plan = plan_of()) {
  Study s;
  s.plan = std::move(plan);
  s.metrics = {"seconds", "noise"};
  statistics::Random random(3);
  for (std::size_t g = 0; g < s.plan.groups.size(); ++g) {
    for (int i = 0; i < each; ++i)
      s.participants.push_back({s.plan.groups[g].substr(0, 1) + std::to_string(i), s.plan.groups[g]});
  }
  for (int r = 0; r < raters; ++r) s.raters.push_back({"R" + std::to_string(r + 1), {}});
  for (const Participant& p : s.participants) {
    const double skill = (p.group == s.plan.competent ? 1.5 : 0) + 0.4 * random.normal();
    for (const std::string& c : s.plan.cases) {
      Session one{"B" + std::to_string(s.sessions.size()), p.code, c, 1, {}};
      const double now = skill + 0.3 * random.normal();
      one.metrics["seconds"] = 600 - 100 * now + 10 * random.normal();
      one.metrics["noise"] = random.normal();
      for (RaterSheet& r : s.raters)
        r.sessions[one.blind]["overall"] = std::clamp(std::round(2.2 + now + 0.4 * random.normal()), 1.0, 5.0);
      s.sessions.push_back(std::move(one));
    }
  }
  return s;
}
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
std::string message_of(const auto& call) {
  try {
    call();
  } catch (const Error& e) {
    return e.what();
  }
  return "no error";
}

TEST(Williams, EachCaseAsOftenAtEachPlaceAndAfterEachOther) {
  for (int n = 1; n <= 7; ++n) {
    const auto rows = williams(n);
    EXPECT_EQ(rows.size(), static_cast<std::size_t>(n % 2 == 0 ? n : 2 * n));
    std::map<std::pair<int, int>, int> places, followers;
    for (const auto& row : rows) {
      EXPECT_EQ(std::set<int>(row.begin(), row.end()).size(), static_cast<std::size_t>(n));
      for (int c = 0; c < n; ++c) {
        ++places[{c, row[static_cast<std::size_t>(c)]}];
        if (c > 0) ++followers[{row[static_cast<std::size_t>(c - 1)], row[static_cast<std::size_t>(c)]}];
      }
    }
    for (const auto& [place, count] : places) EXPECT_EQ(count, static_cast<int>(rows.size()) / n);
    EXPECT_EQ(followers.size(), static_cast<std::size_t>(n * (n - 1)));
    for (const auto& [pair, count] : followers) EXPECT_EQ(count, followers.begin()->second) << n;
  }
}

class InAFolder : public testing::Test {
 protected:
  test::ScratchFolder scratch_;
  fs::path root_ = scratch_.path(), folder_ = root_ / "s";
  fs::path file(const std::string& name, const std::string& text) {
    write_file(root_ / name, text);
    return root_ / name;
  }
};

TEST_F(InAFolder, GrowsAndIsReadAgain) {
  new_study(folder_, plan_of());
  EXPECT_THROW(new_study(folder_, plan_of()), Error);
  EXPECT_EQ(add_participant(folder_, "", "expert"), "P01");
  EXPECT_EQ(add_participant(folder_, "K-7", "novice"), "K-7");
  EXPECT_EQ(add_participant(folder_, "", "novice"), "P02");
  std::vector<std::string> notes;
  const std::string first = add_session(
      folder_, "P01", "left", 1, file("a.json", "{\"seconds\": 10.5, \"who\": \"x\", \"volume_mm3\": 3}"), notes);
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_NE(notes[0].find("'who' is no number"), std::string::npos);
  const std::string second =
      add_session(folder_, "K-7", "left", 1, file("b.csv", "seconds,\"peak, N\"\r\n20,1.5\r\n"), notes);
  add_session(folder_, "K-7", "left", 2, file("c.json", "[{\"name\": \"seconds\", \"value\": 30, \"unit\": \"s\"}]"),
              notes);
  add_session(folder_, "K-7", "right", 1, file("d.json", "{\"metrics\": {\"seconds\": 40}}"), notes);
  const Study s = read_study(folder_);
  EXPECT_EQ(s.metrics, (std::vector<std::string>{"seconds", "volume_mm3", "peak, N"}));
  ASSERT_EQ(s.sessions.size(), 4U);
  EXPECT_EQ(s.sessions[0].metrics.size(), 2U);
  EXPECT_EQ(s.sessions[1].metrics.at("peak, N"), 1.5);
  EXPECT_EQ(s.sessions[2].metrics.at("seconds"), 30);
  EXPECT_NE(first, second);
  EXPECT_EQ(first.size(), 5U);
  EXPECT_EQ(first.find("P01"), std::string::npos);
  EXPECT_THROW(add_session(folder_, "P01", "left", 1, root_ / "a.json", notes), Error);
  EXPECT_THROW(add_session(folder_, "P09", "left", 1, root_ / "a.json", notes), Error);
  EXPECT_THROW(add_session(folder_, "P01", "up", 1, root_ / "a.json", notes), Error);
  EXPECT_THROW(add_session(folder_, "P01", "left", 3, root_ / "a.json", notes), Error);
  EXPECT_THROW(add_session(folder_, "P01", "left", 2, file("e.json", "{\"seconds\": \"soon\"}"), notes), Error);
  EXPECT_THROW(add_participant(folder_, "K-7", "novice"), Error);
  EXPECT_THROW(add_participant(folder_, "Ann Miller", "novice"), Error);
  EXPECT_THROW(add_participant(folder_, "", "nurse"), Error);
}

TEST_F(InAFolder, OrderIsBalancedAndWhoComesLaterChangesNothing) {
  new_study(folder_, plan_of());
  for (int i = 0; i < 6; ++i) add_participant(folder_, "", i % 2 == 0 ? "expert" : "novice");
  EXPECT_EQ(make_order(folder_), 6U);
  const std::string before = read_text(folder_ / "order.csv");
  std::map<std::string, int> first;
  for (const OrderRow& r : read_study(folder_).order) first[r.case_name] += r.position == 1 ? 1 : 0;
  EXPECT_GE(first["left"], 2);
  EXPECT_GE(first["right"], 2);
  EXPECT_EQ(make_order(folder_), 0U);
  add_participant(folder_, "", "expert");
  EXPECT_EQ(make_order(folder_), 1U);
  EXPECT_TRUE(read_text(folder_ / "order.csv").starts_with(before));
}

TEST_F(InAFolder, EveryFaultNamesFileAndLine) {
  new_study(folder_, plan_of());
  fs::create_directory(folder_ / "ratings");
  const auto fault = [&](const std::string& name, const std::string& text) {
    write_file(folder_ / name, text);
    const std::string said = message_of([&] { static_cast<void>(read_study(folder_)); });
    fs::remove(folder_ / name);
    return said.find(name) == std::string::npos ? "file not named: " + said : said;
  };
  const auto has = [](const std::string& said, const std::string& what) {
    EXPECT_NE(said.find(what), std::string::npos) << said;
  };
  has(fault("participants.csv", "participant,group\nA,novice\nA,expert\n"), "line 3: 'A' is there twice");
  has(fault("participants.csv", "participant,group\nA,nurse\n"), "line 2: 'nurse' is none of the groups");
  has(fault("participants.csv", "participant,group\nA,novice,1\n"), "line 2: 3 fields");
  has(fault("participants.csv", "participant,group\nAnn B,novice\n"), "not a code");
  has(fault("participants.csv", "group,participant\n"), "line 1");
  has(fault("participants.csv", "participant,group\n\"A,novice\n"), "line 2: a quote is not closed");
  write_file(folder_ / "participants.csv", "participant,group\nA,novice\n");
  const std::string head = "blind,participant,case,attempt,seconds\n";
  has(fault("sessions.csv", head + "X,A,left,1,12\nX,A,left,2,13\n"), "line 3: the blind code");
  has(fault("sessions.csv", head + "X,A,left,1,12\nY,A,left,1,13\n"), "line 3: this attempt");
  has(fault("sessions.csv", head + "X,A,left,1,fast\n"), "line 2: seconds is 'fast'");
  has(fault("sessions.csv", head + "X,A,left,one,1\n"), "line 2: attempt is 'one'");
  has(fault("sessions.csv", head + "X,B,left,1,1\n"), "line 2: there is no participant 'B'");
  has(fault("sessions.csv", "blind,participant,case,attempt,s,s\n"), "line 1: column 's' is there twice");
  write_file(folder_ / "sessions.csv", head + "X,A,left,1,NaN\n");
  EXPECT_TRUE(read_study(folder_).sessions[0].metrics.empty());
  has(fault("ratings/R.json",
            "{\"osteotome_ratings\": 1, \"rater\": \"R\", \"ratings\": [\n{\"session\": \"X\", \"item\": \"overall\", "
            "\"value\": 9}]}"),
      "line 2");
  has(fault("ratings/R.json",
            "{\"osteotome_ratings\": 1, \"rater\": \"R\", \"ratings\": [\n{\"session\": \"Q\", \"item\": \"overall\", "
            "\"value\": 3}]}"),
      "no session 'Q'");
  has(fault("ratings/R.json",
            "{\"osteotome_ratings\": 1, \"rater\": \"R\", \"ratings\": [\n{\"session\": \"X\", \"item\": \"care\", "
            "\"value\": 3}]}"),
      "'care' is none");
  has(fault("ratings/R.json", "{\"osteotome_ratings\": 1, \"study\": \"other\", \"rater\": \"R\", \"ratings\": []}"),
      "of another study");
  has(fault("study.json", "{\"osteotome_study\": 1,\n\"groups\": [\"a\"], \"cases\": [\"c\"], \"grops\": 1}"), "grops");
  has(fault("study.json", "{\"osteotome_study\": 1, \"groups\": [\"a\", \"a\"], \"cases\": [\"c\"]}"),
      "groups name one twice");
  has(fault("study.json", "{\"osteotome_study\": 1, \"groups\": [\"a\"], \"cases\": [\"c\"], \"competent\": \"b\"}"),
      "competent is 'b'");
  EXPECT_NE(message_of([&] { static_cast<void>(read_study(root_ / "none")); }).find("is no study"), std::string::npos);
}

TEST(Form, HoldsWhatARaterMayKnowAndNothingElse) {
  Study s = example();
  s.plan.title = "A </script><b> title";
  const std::string one = form_html(s, "R1"), two = form_html(s, "R2");
  EXPECT_EQ(one, form_html(s, "R1"));
  EXPECT_NE(one, two);
  for (const Session& x : s.sessions) EXPECT_NE(one.find("\"" + x.blind + "\""), std::string::npos);
  for (const Participant& p : s.participants) EXPECT_EQ(one.find("\"" + p.code + "\""), std::string::npos);
  EXPECT_EQ(one.find("expert"), std::string::npos);
  EXPECT_EQ(one.find("http:"), std::string::npos);
  EXPECT_EQ(one.find("https:"), std::string::npos);
  EXPECT_EQ(one.find("</script><b>"), std::string::npos);
  EXPECT_FALSE(std::regex_search(one, std::regex("(19|20)[0-9]{2}[-./][0-9]{1,2}|[0-9]{1,2}[./-](19|20)[0-9]{2}")))
      << "a date";
  EXPECT_LT(one.find("\"B"), one.size());
  EXPECT_THROW(static_cast<void>(form_html(s, "Dr. Miller")), Error);
  s.sessions.clear();
  EXPECT_THROW(static_cast<void>(form_html(s, "R1")), Error);
}

TEST(Form, OrderFollowsSeedAndRaterAndNotHowSessionsWereAdded) {
  Study s = example();
  std::vector<std::string> added;
  for (const Session& x : s.sessions) added.push_back(x.blind);
  const std::vector<std::string> order = rating_order(s, "R1");
  EXPECT_EQ(order, rating_order(s, "R1"));
  EXPECT_NE(order, rating_order(s, "R2"));
  EXPECT_NE(order, added);
  EXPECT_TRUE(std::is_permutation(order.begin(), order.end(), added.begin(), added.end()));
  // The form lists them so, whatever else it holds.
  const std::string form = form_html(s, "R1");
  std::size_t last = form.find("\"sessions\"");
  for (const std::string& blind : order) {
    const std::size_t here = form.find("\"" + blind + "\"");
    EXPECT_LT(last, here) << blind;
    last = here;
  }
  ++s.plan.seed;
  EXPECT_NE(order, rating_order(s, "R1"));
}

TEST(Ratings, WhatIsMissingIsTold) {
  const Study s = example(1, 0);
  std::vector<std::string> notes;
  const RaterSheet r = read_ratings("{\"osteotome_ratings\": 1, \"study\": \"" + study_id(s.plan) +
                                        "\", \"rater\": \"R1\", \"ratings\": [{\"session\": \"B0\", \"item\": "
                                        "\"overall\", \"value\": 4}, {\"session\": \"B1\", "
                                        "\"item\": \"overall\", \"value\": null}]}",
                                    "r.json", s, notes);
  EXPECT_EQ(r.sessions.at("B0").at("overall"), 4);
  EXPECT_FALSE(r.sessions.at("B1").at("overall"));
  ASSERT_EQ(notes.size(), 2U);
  EXPECT_NE(notes[0].find("2 ratings are missing"), std::string::npos);
  EXPECT_NE(notes[1].find("1 could not be judged"), std::string::npos);
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
  EXPECT_NEAR(number(a.json.find("power")->items()[0], {"detectable_effect"}), 1.65, 0.15);
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
