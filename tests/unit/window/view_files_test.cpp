// What a person chose, and what the start page offers.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

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
        "\"sideways\"}");
  PersonSettings p(file);
  ASSERT_EQ(p.complaints().size(), 3U);
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

}  // namespace
}  // namespace osteo
