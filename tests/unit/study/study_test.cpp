// A study's files: what is written, what is rejected and where; forms and ratings.
#include "osteo/assessment/study/study.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <regex>
#include <set>

#include "osteo/assessment/study/analysis.h"
#include "osteo/core/base/files.h"
#include "scratch.h"
#include "study_example.h"

namespace osteo::study {
namespace {

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

// The first row has no other to be compared with.
TEST_F(InAFolder, TheStudysOwnProcedureBindsTheFirstRowToo) {
  new_study(folder_, plan_of());
  add_participant(folder_, "", "novice");
  write_file(folder_ / "procedure.json", "{}");
  std::vector<std::string> notes;
  const auto add = [&](const std::string& procedure, const std::vector<std::string>& accepted) {
    Measurements m = scored("one");
    m.source.procedure = procedure;
    return message_of([&] { add_session(folder_, "P01", "left", 1, m, accepted, notes); });
  };
  EXPECT_NE(add("none", {}).find("another procedure than the study's own"), std::string::npos);
  EXPECT_NE(add("steps", {"program"}).find("another procedure than the study's own"), std::string::npos);
  EXPECT_EQ(add("none", {"procedure"}), "no error");
  remove(folder_, "P01", "left", 1);
  const std::string own = hash_text("{}").substr(0, 16);
  EXPECT_EQ(add(own + " mirrored", {}), "no error");
  remove(folder_, "P01", "left", 1);
  EXPECT_EQ(add(own, {}), "no error");
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

}  // namespace
}  // namespace osteo::study
