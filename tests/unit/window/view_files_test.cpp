// What a person chose, and what the start page offers.
#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "case_card.h"
#include "case_maker.h"
#include "osteo/app/window/person_settings.h"
#include "osteo/core/base/files.h"
#include "scratch.h"
#include "start_list.h"

namespace osteo {
namespace {

void write(const fs::path& file, const std::string& text) {
  fs::create_directories(file.parent_path());
  std::ofstream(file) << text;
}

TEST(PersonSettings, AreKept) {
  const test::ScratchFolder scratch;
  const fs::path file = scratch / "config/settings.json";
  fs::create_directories(scratch / "a");
  {
    PersonSettings p(file);
    EXPECT_TRUE(p.complaints().empty());
    EXPECT_EQ(p.save(), "");
    EXPECT_FALSE(fs::exists(file));  // nothing was chosen
    p.values.scale = 1.21;
    p.values.layout = "plan";
    p.opened(scratch / "b");
    p.opened(scratch / "a");
    p.opened(scratch / "a/../a");  // the same
    EXPECT_EQ(p.save(), "");
  }
  PersonSettings again(file);
  EXPECT_TRUE(again.complaints().empty());
  EXPECT_EQ(again.values.scale, 1.21);
  EXPECT_EQ(again.values.layout, "plan");
  ASSERT_EQ(again.cases().size(), 2U);
  EXPECT_EQ(again.cases()[0].filename(), "a");
  // Not remembered: not in the file either.
  again.values.remember_cases = false;
  again.opened(scratch / "c");
  EXPECT_EQ(again.save(), "");
  EXPECT_EQ(read_text(file).find(scratch.path().string()), std::string::npos) << read_text(file);
}

TEST(PersonSettings, WhatIsWrongIsToldWithItsLineAndTheRestIsTaken) {
  const test::ScratchFolder scratch;
  const fs::path file = scratch / "settings.json";
  write(file,
        "{\"osteotome_settings\": 1,\n\"volume\": 0.25,\n\"colour\": \"red\",\n\"scale\": 99,\n\"layout\": "
        "\"sideways\",\n\"position\": \"upside down\"}");
  PersonSettings p(file);
  ASSERT_EQ(p.complaints().size(), 4U);
  EXPECT_EQ(p.values.position, "supine");
  EXPECT_NE(p.complaints()[0].find("line 3"), std::string::npos) << p.complaints()[0];
  EXPECT_NE(p.complaints()[1].find("line 4"), std::string::npos) << p.complaints()[1];
  EXPECT_NE(p.complaints()[2].find("line 5"), std::string::npos) << p.complaints()[2];
  EXPECT_EQ(p.values.volume, 0.25);
  EXPECT_EQ(p.values.scale, 1);
  EXPECT_EQ(p.values.layout, "operate");
  p.values.alarms = true;
  EXPECT_EQ(p.save(), "");
  const auto j = nlohmann::json::parse(read_text(file));
  EXPECT_EQ(j["colour"], "red");  // of a later version, perhaps
  EXPECT_EQ(j["alarms"], true);
}

TEST(PersonSettings, ThemeAndLayoutByName) {
  const test::ScratchFolder scratch;
  const fs::path file = scratch / "settings.json";
  write(file, R"({"osteotome_settings": 1, "layout": "beside", "theme": "high_contrast"})");
  PersonSettings p(file);
  EXPECT_TRUE(p.complaints().empty());
  EXPECT_EQ(p.values.layout, "operate") << "the layout that was called so is no more";
  EXPECT_EQ(p.values.theme, "high_contrast");
  write(file, R"({"osteotome_settings": 1, "theme": "pink"})");
  PersonSettings q(file);
  ASSERT_EQ(q.complaints().size(), 1U);
  EXPECT_NE(q.complaints()[0].find("dark, light or high_contrast"), std::string::npos);
  EXPECT_EQ(q.values.theme, "dark");
}

TEST(PersonSettings, AFileThatCannotBeReadIsLeftAlone) {
  const test::ScratchFolder scratch;
  for (const std::string text : {"{\"osteotome_settings\": 1,\n", "[]", "{\"osteotome_settings\": 2}",
                                 "{\"osteotome_settings\": 1, // mine\n\"volume\": 1}"}) {
    const fs::path file = scratch / "settings.json";
    write(file, text);
    PersonSettings p(file);
    EXPECT_EQ(p.complaints().size(), 1U) << text;
    p.values.scale = 2;
    EXPECT_NE(p.save().find("not kept"), std::string::npos);
    EXPECT_EQ(read_text(file), text);
  }
  PersonSettings nowhere{fs::path()};
  nowhere.values.scale = 2;
  EXPECT_NE(nowhere.save().find("HOME"), std::string::npos);
  // A file where the folder should be.
  write(scratch / "file", "x");
  PersonSettings blocked(scratch / "file/settings.json");
  blocked.values.scale = 2;
  EXPECT_NE(blocked.save().find("not kept"), std::string::npos);
}

TEST(PersonSettings, ButtonsAreKeptWhereTheyAreNotAsUsual) {
  const test::ScratchFolder scratch;
  const fs::path file = scratch / "settings.json";
  {
    PersonSettings p(file);
    p.buttons.assign(*button_named("key F13"), HandFunction::undo);
    p.buttons.assign(button::kPedal + 1, HandFunction::suck);
    p.buttons.clear(button::kPedal + 2);
    p.values.left_handed = true;
    p.values.motion_one_to = 4;
    EXPECT_EQ(p.save(), "");
  }
  const auto j = nlohmann::json::parse(read_text(file));
  EXPECT_EQ(j["buttons"], (nlohmann::json{{"key F13", "undo"}, {"pedal 2", "suction"}, {"pedal 3", "nothing"}}));
  PersonSettings again(file);
  EXPECT_TRUE(again.complaints().empty());
  EXPECT_EQ(again.buttons.function(302), HandFunction::undo);
  EXPECT_EQ(again.buttons.function(button::kPedal), HandFunction::drill);
  EXPECT_EQ(again.buttons.function(button::kPedal + 1), HandFunction::suck);
  EXPECT_FALSE(again.buttons.function(button::kPedal + 2));
  // Names of before are read, and written as they are now.
  write_file(file, R"({"osteotome_settings": 1, "buttons": {"pedal 1": "water", "pedal 2": "bring"}})");
  PersonSettings older(file);
  EXPECT_TRUE(older.complaints().empty());
  EXPECT_EQ(older.buttons.function(button::kPedal), HandFunction::water);
  EXPECT_EQ(older.buttons.function(button::kPedal + 1), HandFunction::bring);
  EXPECT_TRUE(again.values.left_handed);
  EXPECT_EQ(again.values.motion_one_to, 4);
  again.buttons = HandButtons::usual();
  EXPECT_EQ(again.save(), "");
  EXPECT_FALSE(nlohmann::json::parse(read_text(file)).contains("buttons"));
}

TEST(PersonSettings, AWrongButtonIsToldWithItsLineAndTheOthersAreTaken) {
  const test::ScratchFolder scratch;
  const fs::path file = scratch / "settings.json";
  write(file,
        "{\"osteotome_settings\": 1,\n\"buttons\": {\n\"knee 1\": \"drill\",\n\"pedal 1\": \"fly\",\n\"pedal 2\": "
        "3,\n\"pedal 3\": "
        "\"undo\"},\n\"motion_one_to\": 3}");
  PersonSettings p(file);
  ASSERT_EQ(p.complaints().size(), 4U);
  for (std::size_t n = 0; n < 3; ++n)
    EXPECT_NE(p.complaints()[n].find("line " + std::to_string(n + 3)), std::string::npos) << p.complaints()[n];
  EXPECT_NE(p.complaints()[0].find("knee 1"), std::string::npos);
  EXPECT_NE(p.complaints()[1].find("fly"), std::string::npos);
  EXPECT_NE(p.complaints()[3].find("1, 2, 4 or 8"), std::string::npos);
  EXPECT_EQ(p.buttons.function(button::kPedal), HandFunction::drill);
  EXPECT_EQ(p.buttons.function(button::kPedal + 2), HandFunction::undo);
  EXPECT_EQ(p.values.motion_one_to, 1);
  // What was not understood stays as the person wrote it.
  p.values.alarms = true;
  EXPECT_EQ(p.save(), "");
  const auto j = nlohmann::json::parse(read_text(file));
  EXPECT_EQ(j["buttons"]["knee 1"], "drill");
  EXPECT_EQ(j["buttons"]["pedal 1"], "fly");
  EXPECT_EQ(j["buttons"]["pedal 3"], "undo");
  write(file, "{\"osteotome_settings\": 1,\n\"buttons\": [1]}");
  EXPECT_EQ(PersonSettings(file).complaints().size(), 1U);
}

TEST(PersonSettings, OnlySoManyCasesAreRemembered) {
  const test::ScratchFolder scratch;
  PersonSettings p(scratch / "settings.json");
  for (int n = 0; n < 30; ++n) p.opened(scratch / std::to_string(n));
  ASSERT_EQ(p.cases().size(), PersonSettings::kMaxCases);
  EXPECT_EQ(p.cases().front().filename(), "29");
}

struct Folders {
  test::ScratchFolder scratch;
  Folders() {
    write(scratch / "cases/ear/manifest.json", "{}");
    for (const char* n : {"1", "2", "10"})
      write(scratch / "cases/ear/sessions" / n / "session.json", R"({"osteotome_session": 1, "case": "../.."})");
    fs::create_directories(scratch / "cases/ear/sessions/11");  // nothing in it
    fs::create_directories(scratch / "cases/empty");
    write(scratch / "cases/.hidden/manifest.json", "{}");
    write(scratch / "cases/scan.nrrd", "x");
  }
  [[nodiscard]] fs::path cases() const { return scratch / "cases"; }
};
int index_of(const StartList& list, const std::string& words) {
  for (std::size_t n = 0; n < list.entries().size(); ++n) {
    if (list.entries()[n].words.find(words) != std::string::npos) return static_cast<int>(n);
  }
  return -1;
}

TEST(StartList, FindsItsWayToACase) {
  const Folders f;
  StartList list({}, f.scratch.path());
  EXPECT_EQ(index_of(list, "hidden"), -1);
  list.select(index_of(list, "cases"));
  EXPECT_FALSE(list.open());
  EXPECT_EQ(list.folder(), f.cases());
  EXPECT_EQ(index_of(list, "scan"), -1);
  ASSERT_GE(index_of(list, "case: ear"), 0);
  list.select(index_of(list, "case: ear"));
  const auto choice = list.open();
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->case_folder, f.cases() / "ear");
  EXPECT_TRUE(choice->resume.empty());
  list.up();
  EXPECT_EQ(list.folder(), f.scratch.path());
}

TEST(StartList, RecentCasesComeFirstAndTheirLastSessionToo) {
  const Folders f;
  StartList list({f.cases() / "ear", f.cases() / "gone"}, f.cases());
  EXPECT_EQ(list.selected(), 0);
  EXPECT_NE(list.entries()[0].words.find("ear"), std::string::npos);
  EXPECT_NE(list.entries()[1].words.find("no longer there"), std::string::npos);
  EXPECT_EQ(list.entries()[2].folder, f.cases() / "ear/sessions/10");  // after 2
  list.select(2);
  const auto session = list.open();
  ASSERT_TRUE(session) << list.message();
  EXPECT_EQ(session->resume, f.cases() / "ear/sessions/10");
  EXPECT_TRUE(fs::equivalent(session->case_folder, f.cases() / "ear"));
  list.select(1);
  EXPECT_FALSE(list.open());
  EXPECT_NE(list.message().find("not there"), std::string::npos);
  list.forget_recent();
  EXPECT_EQ(index_of(list, "gone"), -1);
  // By keys: stops at the ends.
  list.move(-5);
  EXPECT_EQ(list.selected(), 0);
  list.move(1000);
  EXPECT_EQ(list.selected(), static_cast<int>(list.entries().size()) - 1);
}

TEST(StartList, WhatIsDroppedIsACaseOrSaysWhyNot) {
  const Folders f;
  StartList list({}, f.scratch.path());
  EXPECT_TRUE(list.take({f.cases() / "ear"}));
  EXPECT_TRUE(list.take({f.cases() / "ear/manifest.json"}));
  EXPECT_EQ(list.take({f.cases() / "ear/sessions/2/session.json"})->resume, f.cases() / "ear/sessions/2");
  EXPECT_FALSE(list.take({f.cases() / "scan.nrrd"}));
  EXPECT_NE(list.message().find("osteo prepare"), std::string::npos);
  EXPECT_FALSE(list.take({f.cases()}));
  EXPECT_EQ(list.folder(), f.cases());
  EXPECT_FALSE(list.take({f.cases() / "nothing"}));
  EXPECT_NE(list.message().find("not there"), std::string::npos);
}

// Onto a session that runs: only what can be opened ends it.
TEST(StartList, OfSeveralThingsDroppedTheFirstThatCanBeOpenedCounts) {
  const Folders f;
  std::string why = "before";
  auto choice = choice_of({f.cases() / "scan.nrrd", f.cases() / "ear/sessions/2", f.cases() / "ear"}, why);
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->resume, f.cases() / "ear/sessions/2");
  EXPECT_EQ(why, "");
  EXPECT_FALSE(choice_of({f.cases() / "scan.nrrd", f.cases() / "nothing"}, why));
  EXPECT_NE(why.find("scan.nrrd"), std::string::npos) << "of the first";
  EXPECT_FALSE(choice_of(std::vector<fs::path>{}, why));
  EXPECT_EQ(why, "");
  StartList list({}, f.scratch.path());
  EXPECT_TRUE(list.take({f.cases() / "scan.nrrd", f.cases() / "ear"}));
  EXPECT_FALSE(list.take({f.cases() / "scan.nrrd", f.cases() / "empty"}));
  EXPECT_NE(list.message().find("scan.nrrd"), std::string::npos);
}

// What a card says of a case, of a broken one, and of one that is gone; and of a session.
TEST(CaseCard, SaysWhatMattersOfACase) {
  const test::ScratchFolder scratch;
  const fs::path folder = scratch / "ear";
  const std::string manifest =
      R"({"osteotome_case": 1, "recipe": {"settings": {"names": "5=ossicles, 6=facial nerve, 7=sigmoid sinus, 12=labyrinth"}},
      "files": {"bone": {"file": "bone.vdb", "hash": "a"}, "picture": {"file": "preview.png", "hash": "b"}},
      "frame": {"spacing_mm": [0.3, 0.3, 0.6]}})";
  write(folder / "manifest.json", manifest);
  write(folder / "preview.png", "x");
  const CaseCard lacks = card_of(folder);
  EXPECT_EQ(lacks.state, CaseCard::State::broken);
  EXPECT_EQ(lacks.why, "bone.vdb is missing: prepare it again");
  write(folder / "bone.vdb", "x");
  for (const char* n : {"1", "2"})
    write(folder / "sessions" / n / "session.json", R"({"osteotome_session": 1, "case": "../.."})");
  const CaseCard good = card_of(folder);
  EXPECT_EQ(good.state, CaseCard::State::plain) << good.why;
  EXPECT_EQ(good.name, "ear");
  EXPECT_EQ(good.facts.find("0.3 mm · 2 sessions · today "), 0U) << good.facts;
  EXPECT_EQ(good.structures, "ossicles, facial nerve, sigmoid sinus, 1 more");
  EXPECT_EQ(good.words, "not approved");
  EXPECT_EQ(good.preview, folder / "preview.png");
  write(folder / "manifest.json", manifest.substr(0, 40));
  const CaseCard torn = card_of(folder);
  EXPECT_EQ(torn.state, CaseCard::State::broken);
  EXPECT_NE(torn.why.find("JSON"), std::string::npos) << torn.why;
  EXPECT_EQ(card_of(scratch / "gone").why, "it is no longer there");

  const fs::path session = folder / "sessions/1";
  EXPECT_EQ(session_figures(session), "");
  write(session / "summary.json",
        R"({"ticks": 90000, "rate_hz": 1000, "removed_mm3": 600.4, "sawn_mm3": 26, "structures": [
          {"name": "dura", "least_clearance_mm": 2}, {"name": "sigmoid sinus", "least_clearance_mm": 0.44}]})");
  EXPECT_EQ(session_figures(session), "1.5 min, 626 mm³; nearest: the sigmoid sinus, 0.4 mm");
  write(session / "summary.json",
        R"({"ticks": 900000, "rate_hz": 1000, "removed_mm3": 1.25, "structures": [
          {"name": "dura", "least_clearance_mm": -0.2}]})");
  EXPECT_EQ(session_figures(session), "15 min, 1.2 mm³; touched: dura");
  write(session / "summary.json", "{");
  EXPECT_EQ(session_figures(session), "");
}

TEST(StartList, AFolderOfDicomIsAScan) {
  const Folders f;
  const fs::path series = f.scratch / "cases/series";
  write(series / "a.dcm", std::string(128, '\0') + "DICM and more");
  write(f.scratch / "cases/short/a.dcm", "DICM");
  EXPECT_EQ(look_at_path(series).kind, FolderKind::scan);
  EXPECT_EQ(look_at_path(f.scratch / "cases/short").kind, FolderKind::folder);
  StartList list({}, f.cases());
  EXPECT_GE(index_of(list, "CT: series"), 0);
  // As any folder it can be looked into.
  list.select(index_of(list, "CT: series"));
  EXPECT_FALSE(list.open());
  EXPECT_EQ(list.folder(), series);
  // A case of it would be beside it, and never in the place of another.
  EXPECT_EQ(CaseMaker::case_beside(series), f.cases() / "series-case");
  fs::create_directories(f.cases() / "series-case");
  EXPECT_EQ(CaseMaker::case_beside(series), f.cases() / "series-case-2");
}

TEST(StartList, AFolderOfNnUNetIsATrainedNetwork) {
  const Folders f;
  const fs::path model = f.scratch / "cases/T__P__3d_fullres";
  write(model / "plans.json", R"({"configurations": {}})");
  EXPECT_EQ(look_at_path(model).kind, FolderKind::folder);
  write(model / "dataset.json", R"({"labels": {}})");
  EXPECT_EQ(look_at_path(model).kind, FolderKind::network);
  // Plans and a data set of something else, by the same names.
  const fs::path other = f.scratch / "cases/holidays";
  for (const char* const text : {"{}", "[1, 2]", "no JSON"}) {
    write(other / "plans.json", text);
    write(other / "dataset.json", R"({"labels": {}})");
    EXPECT_EQ(look_at_path(other).kind, FolderKind::folder) << text;
    write(other / "network.json", text);
    EXPECT_EQ(look_at_path(other).kind, FolderKind::folder) << text;
    fs::remove(other / "network.json");
  }
  write(other / "network.json", R"({"osteotome_network": 1})");
  EXPECT_EQ(look_at_path(other).kind, FolderKind::network);
  StartList list({}, f.cases());
  list.select(index_of(list, "trained network: T__P__3d_fullres"));
  EXPECT_FALSE(list.open());
  EXPECT_EQ(list.folder(), model);
}

// A stand-in for 'osteo' that says what it would: how far it is, and what is wrong.
TEST(CaseMaker, FollowsWhatItStartsAndSaysWhyThereIsNoCase) {
  const test::ScratchFolder scratch;
  const fs::path program = scratch / "osteo", scan = scratch / "a scan's", the_case = scratch / "it's here";
  const auto does = [&](const std::string& script) {
    write(program, "#!/bin/sh\n" + script);
    fs::permissions(program, fs::perms::owner_all);
  };
  CaseMaker maker(program);
  EXPECT_FALSE(maker.can_make());
  const auto ended = [&] {
    std::optional<CaseMaker::Made> made;
    while (!(made = maker.poll())) std::this_thread::sleep_for(std::chrono::milliseconds(2));
    return *made;
  };
  does(
      "[ \"$1\" = prepare ] && [ \"$3\" = -o ] && mkdir \"$4\" && echo '{\"progress\":0.5,\"activity\":\"body\"}' "
      ">&2\n");
  EXPECT_TRUE(maker.can_make());
  EXPECT_FALSE(maker.poll());
  ASSERT_EQ(maker.make(scan, the_case), "");
  EXPECT_EQ(maker.making(), the_case);
  EXPECT_EQ(maker.make(scan, scratch / "another"), "") << "one at a time";
  EXPECT_EQ(ended().why, "");
  EXPECT_TRUE(fs::exists(the_case)) << "names with blanks and quotes";
  EXPECT_TRUE(maker.making().empty());
  // With a network, and without one no empty word.
  does("[ $# = 8 ] && [ \"$5\" = --structures ] && [ \"$6\" = \"/a net's\" ]\n");
  ASSERT_EQ(maker.make(scan, scratch / "by a network", "/a net's"), "");
  EXPECT_EQ(ended().why, "");
  does("[ $# = 6 ] && [ \"$5\" = --progress ]\n");
  ASSERT_EQ(maker.make(scan, scratch / "by no network"), "");
  EXPECT_EQ(ended().why, "");
  does(
      "echo 'scan: 0.07 s' >&2; echo \"osteo: '$2' holds no DICOM image\" >&2; echo '  give the folder' >&2; exit 4\n");
  ASSERT_EQ(maker.make(scan, the_case), "");
  EXPECT_EQ(ended().why, "'" + scan.string() + "' holds no DICOM image; give the folder");
  does("exit 3\n");
  ASSERT_EQ(maker.make(scan, the_case), "");
  EXPECT_NE(ended().why.find("without a word"), std::string::npos);
  // Left in the middle it is ended with all that it started.
  does("sleep 60 & wait\n");
  const auto begun = std::chrono::steady_clock::now();
  {
    CaseMaker left(program);
    ASSERT_EQ(left.make(scan, the_case), "");
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(30));
}

TEST(StartList, TheDemoIsOfferedBehindTheCasesAndMadeWhenItIsWanted) {
  const Folders f;
  const fs::path demo = f.scratch / "data/demo/case";
  StartList list({f.cases() / "ear"}, f.scratch.path(), demo);
  const int at = index_of(list, "demo ear");
  EXPECT_EQ(at, 1);
  list.select(at);
  EXPECT_FALSE(list.open());
  EXPECT_TRUE(list.wants_demo());
  EXPECT_FALSE(list.wants_demo()) << "once";
  write(demo / "manifest.json", "{}");
  list.select(0);
  list.refresh(demo);
  EXPECT_EQ(list.selected(), at);
  const auto choice = list.open();
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->case_folder, demo);
  EXPECT_FALSE(list.wants_demo());
  list.select(0);
  list.refresh(f.scratch / "never made");
  EXPECT_EQ(list.selected(), 0);
  // Among the cases opened last it stands once.
  const StartList again({demo}, f.scratch.path(), demo);
  EXPECT_EQ(index_of(again, "demo ear"), -1);
  EXPECT_EQ(again.entries()[0].folder, demo);
}

}  // namespace
}  // namespace osteo
