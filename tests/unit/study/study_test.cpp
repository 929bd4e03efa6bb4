// A study from its first file to its report: what is written, what is rejected and where, and what the analysis says of
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
      Session one{"B" + std::to_string(s.sessions.size()), p.code, c, 1, {}, {}};
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
  std::string add(const std::string& who, const std::string& case_name, int attempt, const fs::path& file,
                  std::vector<std::string>& notes) {
    return add_session(folder_, who, case_name, attempt, read_measurements(read_text(file), file.string(), notes), {},
                       notes);
  }
};

TEST_F(InAFolder, GrowsAndIsReadAgain) {
  new_study(folder_, plan_of());
  EXPECT_THROW(new_study(folder_, plan_of()), Error);
  EXPECT_EQ(add_participant(folder_, "", "expert"), "P01");
  EXPECT_EQ(add_participant(folder_, "K-7", "novice"), "K-7");
  EXPECT_EQ(add_participant(folder_, "", "novice"), "P02");
  std::vector<std::string> notes;
  const std::string first =
      add("P01", "left", 1, file("a.json", "{\"seconds\": 10.5, \"who\": \"x\", \"volume_mm3\": 3}"), notes);
  ASSERT_EQ(notes.size(), 2U);
  EXPECT_NE(notes[1].find("of an unknown session"), std::string::npos);
  EXPECT_NE(notes[0].find("'who' is no number"), std::string::npos);
  const std::string second = add("K-7", "left", 1, file("b.csv", "seconds,\"peak, N\"\r\n20,1.5\r\n"), notes);
  add("K-7", "left", 2, file("c.json", "[{\"name\": \"seconds\", \"value\": 30, \"unit\": \"s\"}]"), notes);
  add("K-7", "right", 1, file("d.json", "{\"metrics\": {\"seconds\": 40}}"), notes);
  const Study s = read_study(folder_);
  EXPECT_EQ(s.metrics, (std::vector<std::string>{"seconds", "volume_mm3", "peak, N"}));
  ASSERT_EQ(s.sessions.size(), 4U);
  EXPECT_EQ(s.sessions[0].metrics.size(), 2U);
  EXPECT_EQ(s.sessions[1].metrics.at("peak, N"), 1.5);
  EXPECT_EQ(s.sessions[2].metrics.at("seconds"), 30);
  EXPECT_NE(first, second);
  EXPECT_EQ(first.size(), 5U);
  EXPECT_EQ(first.find("P01"), std::string::npos);
  EXPECT_THROW(add("P01", "left", 1, root_ / "a.json", notes), Error);
  EXPECT_THROW(add("P09", "left", 1, root_ / "a.json", notes), Error);
  EXPECT_THROW(add("P01", "up", 1, root_ / "a.json", notes), Error);
  EXPECT_THROW(add("P01", "left", 3, root_ / "a.json", notes), Error);
  EXPECT_THROW(add("P01", "left", 2, file("e.json", "{\"seconds\": \"soon\"}"), notes), Error);
  EXPECT_THROW(add_participant(folder_, "K-7", "novice"), Error);
  EXPECT_THROW(add_participant(folder_, "Ann Miller", "novice"), Error);
  EXPECT_THROW(add_participant(folder_, "", "nurse"), Error);
}

// A row of a session of its own: what distinguishes it from others is in it.
Measurements scored(const std::string& stream) {
  Measurements m;
  m.metrics = {{"force_n", -1.5}};
  m.source = {stream, "bone-left", "steps", "1.0", "1.0"};
  return m;
}

TEST_F(InAFolder, ARowKnowsItsSessionAndWhatDoesNotBelongIsRefusedOrAsked) {
  new_study(folder_, plan_of());
  for (int i = 0; i < 3; ++i) add_participant(folder_, "", "novice");
  std::vector<std::string> notes;
  const auto said = [&](const Measurements& m, const std::string& case_name = "left", const std::string& who = "P02",
                        const std::vector<std::string>& accepted = {}) {
    return message_of([&] { add_session(folder_, who, case_name, 1, m, accepted, notes); });
  };
  const auto has = [](const std::string& text, const std::string& what) {
    EXPECT_NE(text.find(what), std::string::npos) << text;
  };
  add_session(folder_, "P01", "left", 1, scored("one"), {}, notes);
  EXPECT_TRUE(notes.empty());
  const Session kept = read_study(folder_).sessions.at(0);
  EXPECT_EQ(kept.source.stream, "one");
  EXPECT_EQ(kept.source.bone, "bone-left");
  EXPECT_EQ(kept.source.procedure, "steps");
  EXPECT_EQ(kept.source.recorded_by + kept.source.scored_by, "1.01.0");
  EXPECT_EQ(kept.metrics.at("force_n"), -1.5);
  // Never.
  has(said(scored("one")), "in the study already: as P01's attempt 1 of left");
  Measurements m = scored("two");
  m.source.guided = true;
  has(said(m), "guided session");
  m = scored("two");
  m.source.simulated = true;
  has(said(m, "left", "P02", {"program", "cut-short", "other-bone", "procedure"}), "drilled by a program");
  // Asked: each by its name, and no name takes another.
  const auto asks = [&](const Measurements& other, const std::string& as, const std::string& case_name = "left") {
    has(said(other, case_name), "differs from what the study holds");
    for (const std::string_view name : acceptable_differences()) {
      if (name == as) continue;
      has(said(other, case_name, "P02", {std::string(name)}), "differs from what the study holds");
    }
    EXPECT_EQ(said(other, case_name, "P02", {as}), "no error") << as;
    const Study s = read_study(folder_);
    const Session taken = s.sessions.back();
    EXPECT_EQ(taken.participant, "P02");
    EXPECT_EQ(remove(folder_, "P02", case_name, 1).sessions, 1U);
    return taken.source;
  };
  m = scored("two");
  m.source.cut_short = true;
  EXPECT_TRUE(asks(m, "cut-short").cut_short);
  m = scored("two");
  m.source.bone = "bone-right";
  EXPECT_TRUE(asks(m, "other-bone").other_bone);
  EXPECT_TRUE(asks(scored("two"), "other-bone", "right").other_bone) << "the left case's bone as the right one's";
  m = scored("two");
  m.source.procedure = "none";
  asks(m, "procedure");
  m.source.procedure = "steps mirrored";
  asks(m, "procedure");
  m.source.bone = "bone-right";
  EXPECT_EQ(said(m, "right"), "no error") << "the other side of the other case";
  m = scored("three");
  m.source.recorded_by = "0.9";
  asks(m, "program");
  m = scored("three");
  m.source.scored_by = "1.1";
  asks(m, "program");
  has(said(m, "left", "P02", {"everything"}), "nothing that can be accepted");
  // What is on another bone is no measure for the next.
  m = scored("three");
  m.source.bone = "bone-lower-jaw";
  EXPECT_EQ(said(m, "left", "P02", {"other-bone"}), "no error");
  EXPECT_EQ(said(scored("four"), "left", "P03"), "no error");
}

TEST_F(InAFolder, PeopleDoNotStandInSimulatedStudies) {
  Plan plan = plan_of();
  plan.simulated = true;
  new_study(folder_, plan);
  add_participant(folder_, "", "novice");
  std::vector<std::string> notes;
  Measurements m = scored("one");
  EXPECT_NE(message_of([&] { add_session(folder_, "P01", "left", 1, m, {}, notes); }).find("drilled by a person"),
            std::string::npos);
  m.source.simulated = true;
  add_session(folder_, "P01", "left", 1, m, {}, notes);
  EXPECT_TRUE(read_study(folder_).sessions.at(0).source.simulated);
}

TEST_F(InAFolder, TakesWhatScoreWritesWithTheSameNamesByJsonAndByCsv) {
  std::vector<std::string> notes;
  const Measurements j = read_measurements(
      R"({"osteotome_score": 1, "source": {"stream": "s", "bone": "b", "procedure": "p mirrored", "recorded_by": "1",
      "scored_by": "2", "marks": "simulated cut-short"}, "metrics": [
      {"name": "phase_s", "of": "1", "value": 3}, {"name": "phase_s", "of": "2", "value": 4.5},
      {"name": "seen_share", "of": null, "value": null, "word": "no camera"}, {"name": "work_mj", "of": null, "value": 7}],
      "items": [{"name": "sinus shown", "value": 0.4, "pass": false}, {"name": "nerve", "value": null, "pass": null}]})",
      "m.json", notes);
  const Measurements c = read_measurements(
      "session,stream,bone,procedure,recorded_by,scored_by,marks,phase_s[1],phase_s[2],seen_share,work_mj,"
      "item[sinus shown],pass[sinus shown],item[nerve],pass[nerve]\n"
      "'=x,s,b,p mirrored,1,2,simulated cut-short,3,4.5,,7,0.4,0,,\n",
      "m.csv", notes);
  EXPECT_EQ(j.metrics, c.metrics);
  EXPECT_EQ(j.metrics.size(), 5U);
  EXPECT_EQ(j.metrics[1], (std::pair<std::string, double>{"phase_s[2]", 4.5}));
  EXPECT_EQ(j.metrics[4], (std::pair<std::string, double>{"pass[sinus shown]", 0}));
  for (const Source& s : {j.source, c.source}) {
    EXPECT_EQ(s.stream + s.bone + s.procedure + s.recorded_by + s.scored_by, "sbp mirrored12");
    EXPECT_TRUE(s.simulated && s.cut_short && !s.guided && !s.other_bone);
  }
  EXPECT_TRUE(notes.empty()) << notes[0];
  EXPECT_TRUE(
      read_measurements(R"({"guided": "led", "metrics": [{"name": "a", "value": 1}]})", "m.json", notes).source.guided);
}

TEST_F(InAFolder, NothingThatASpreadsheetWorksOutIsWritten) {
  std::vector<std::string> notes;
  for (const std::string lead : {"=", "+", "-", "@", "\t"}) {
    Plan plan = plan_of();
    plan.groups = {lead + "a", "b"};
    EXPECT_NE(message_of([&] { new_study(folder_, plan); }).find("formula"), std::string::npos) << lead;
    EXPECT_NE(
        message_of([&] {
          static_cast<void>(read_measurements("{\"" + (lead == "\t" ? "\\t" : lead) + "x\": 1}", "m.json", notes));
        }).find("formula"),
        std::string::npos)
        << lead;
  }
  new_study(folder_, plan_of());
  EXPECT_NE(message_of([&] { add_participant(folder_, "-1", "novice"); }).find("not a code"), std::string::npos);
  add_participant(folder_, "p01", "novice");
  EXPECT_NE(message_of([&] { add_participant(folder_, "P01", "novice"); }).find("'p01' is there"), std::string::npos);
  EXPECT_EQ(add_participant(folder_, "", "novice"), "P02");
  write_file(folder_ / "sessions.csv", "blind,participant,case,attempt,=1\nX,p01,left,1,2\n");
  EXPECT_NE(message_of([&] { static_cast<void>(read_study(folder_)); }).find("line 1: a metric is called '=1'"),
            std::string::npos);
}

TEST_F(InAFolder, WhoWithdrawsIsTakenOutWithAllThatIsKept) {
  new_study(folder_, plan_of());
  for (int i = 0; i < 2; ++i) add_participant(folder_, "", "novice");
  make_order(folder_);
  std::vector<std::string> notes;
  std::vector<std::string> blinds;
  for (const char* const who : {"P01", "P02"})
    for (const char* const where : {"left", "right"}) {
      Measurements m = scored(std::string(who) + where);
      m.source.bone = where;
      if (std::string(who) == "P01") m.metrics.emplace_back("only_p01", 1);
      blinds.push_back(add_session(folder_, who, where, 1, m, {}, notes));
    }
  for (const char* const sub : {"movies", "forms", "ratings"}) fs::create_directory(folder_ / sub);
  std::string rows;
  for (const std::string& b : blinds) {
    write_file(folder_ / "movies" / (b + ".mp4"), "x");
    rows +=
        (rows.empty() ? "" : ",") + std::string("{\"session\": \"") + b + "\", \"item\": \"overall\", \"value\": 3}";
  }
  write_file(folder_ / "ratings/R1.json", "{\"osteotome_ratings\": 1, \"rater\": \"R1\", \"ratings\": [" + rows + "]}");
  write_file(folder_ / "forms/R1.html", form_html(read_study(folder_), "R1"));

  Removed r = remove(folder_, "P01", "right", 1);
  EXPECT_EQ(r.sessions, 1U);
  EXPECT_EQ(r.ratings, 1U);
  EXPECT_EQ(r.movies, 1U);
  EXPECT_EQ(read_study(folder_).sessions.size(), 3U);
  EXPECT_EQ(read_study(folder_).participants.size(), 2U);
  EXPECT_NE(message_of([&] { remove(folder_, "P01", "right", 1); }).find("has no attempt 1"), std::string::npos);
  // Out of sessions.csv by hand: the ratings that are left stop everything, and remove mends it.
  Study s = read_study(folder_);
  const std::string table = read_text(folder_ / "sessions.csv");
  const std::size_t from = table.find(blinds[0]), to = table.find('\n', from) + 1;
  write_file(folder_ / "sessions.csv", table.substr(0, from) + table.substr(to));
  EXPECT_THROW(static_cast<void>(read_study(folder_)), Error);
  r = remove(folder_, "P01");
  EXPECT_EQ(r.ratings, 1U);
  s = read_study(folder_);
  ASSERT_EQ(s.participants.size(), 1U);
  EXPECT_EQ(s.participants[0].code, "P02");
  EXPECT_EQ(s.order.size(), 2U);
  EXPECT_EQ(s.sessions.size(), 2U);
  EXPECT_EQ(s.raters.at(0).sessions.size(), 2U);
  EXPECT_EQ(make_order(folder_), 0U);
  r = remove(folder_, "P02");
  EXPECT_EQ(r.sessions, 2U);
  EXPECT_EQ(r.forms, std::vector<std::string>{"R1"});
  s = read_study(folder_);
  EXPECT_TRUE(s.participants.empty() && s.sessions.empty() && s.order.empty() && s.metrics.empty());
  EXPECT_FALSE(fs::exists(folder_ / "forms/R1.html"));
  EXPECT_NE(message_of([&] { remove(folder_, "P02"); }).find("no participant"), std::string::npos);
}

TEST_F(InAFolder, PrimaryOutcomesAreNamedAndKept) {
  new_study(folder_, plan_of());
  set_primary(folder_, {"force_n", "rating: overall"});
  EXPECT_EQ(read_study(folder_).plan.primary, (std::vector<std::string>{"force_n", "rating: overall"}));
  EXPECT_EQ(read_study(folder_).plan.primary_after, 0);
  EXPECT_THROW(set_primary(folder_, {"a", "a"}), Error);
  EXPECT_THROW(set_primary(folder_, {}), Error);
  add_participant(folder_, "", "novice");
  std::vector<std::string> notes;
  add_session(folder_, "P01", "left", 1, scored("one"), {}, notes);
  EXPECT_NE(message_of([&] { set_primary(folder_, {"force"}); }).find("no outcome of this study"), std::string::npos);
  set_primary(folder_, {"rating: overall", "force_n"});
  EXPECT_EQ(read_study(folder_).plan.primary_after, 1);
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
  has(fault("participants.csv", "participant,group\nA,nurse\n"), "line 2: 'nurse' is not one of the groups");
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
      "'care' is not one of");
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
