// Sessions begin, end and fail under the window's keys, without a window.
#include <gtest/gtest.h>

#include <filesystem>

#include "osteo/core/base/json_document.h"
#include "osteo/core/base/translate.h"
#include "osteo/session/recording/session_reader.h"
#include "rehearsal_bar.h"

namespace osteo {
namespace {

using namespace test;

TEST(RehearsalControl, SavesGoesOnAndBeginsAnew) {
  SessionRunner session_runner;
  RehearsalControl control = session_runner.control();
  control.look_from(kFromAbove);
  ASSERT_TRUE(control.begin(true, false));
  const double whole = session_runner.first.volume_mm3();
  control.rehearsal().act(SceneAction::saw({{5, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1}));
  ASSERT_TRUE(frames_until(control, [&] { return steps(control) == 1; }));
  press(control, Command::saw);
  press(control, Command::save);
  EXPECT_EQ(session_runner.begun, 2);
  EXPECT_EQ(session_runner.shown, 2);
  EXPECT_EQ(control.tools().tool(), HandTools::Tool::drill);
  EXPECT_NE(control.message().find("saved"), std::string::npos);
  EXPECT_LT(of_world(control, [](const World& w) { return w.volume_mm3(); }), whole - 50);
  press(control, Command::reset);
  EXPECT_EQ(of_world(control, [](const World& w) { return w.volume_mm3(); }), whole);
  EXPECT_FALSE(control.failure());
  EXPECT_FALSE(control.lost());
  session_runner.running->stop();
}

TEST(RehearsalControl, EndsAndGoesOnFromThere) {
  SessionRunner session_runner;
  RehearsalControl control = session_runner.control();
  control.look_from(kFromAbove);
  ASSERT_TRUE(control.begin(true, false));
  control.latch(true);
  EXPECT_TRUE(control.end());
  EXPECT_EQ(session_runner.running, nullptr);
  EXPECT_FALSE(control.latched());
  control.watch();  // that nothing runs is no failure
  EXPECT_FALSE(control.failure());
  ASSERT_TRUE(control.begin(false, false));
  EXPECT_EQ(session_runner.begun, 2);
  // What could not be saved is told, and lost.
  session_runner.fails_to_save = Error(ExitCode::cannot_write, "disk full");
  EXPECT_FALSE(control.end());
  ASSERT_TRUE(control.failure());
  EXPECT_STREQ(control.failure()->what(), "disk full");
  EXPECT_TRUE(control.lost());
}

TEST(RehearsalControl, WhatFailsIsToldAndCanBePutRight) {
  SessionRunner session_runner;
  RehearsalControl control = session_runner.control();
  control.look_from(kFromAbove);
  session_runner.fails_to_begin = Error(ExitCode::no_input, "no case");
  EXPECT_FALSE(control.begin(true, false));
  ASSERT_TRUE(control.failure());
  EXPECT_STREQ(control.failure()->what(), "no case");
  EXPECT_EQ(session_runner.running, nullptr);
  // What cannot be shown does not run on unseen.
  session_runner.fails_to_show = Error(ExitCode::resources, "no texture");
  EXPECT_FALSE(control.begin(true, false));
  EXPECT_STREQ(control.failure()->what(), "no texture");
  EXPECT_EQ(session_runner.running, nullptr);
  EXPECT_FALSE(control.lost());
  ASSERT_TRUE(control.begin(true, false));
  EXPECT_FALSE(control.failure());
  // The recording fails: the session is closed, and that is lost.
  session_runner.failed = Error(ExitCode::cannot_write, "disk full");
  control.watch();
  ASSERT_TRUE(control.failure());
  EXPECT_STREQ(control.failure()->what(), "disk full");
  EXPECT_TRUE(control.lost());
  EXPECT_EQ(session_runner.running, nullptr);
  session_runner.failed.reset();
  ASSERT_TRUE(control.begin(false, false));
  // It cannot be saved: nothing new is begun before someone says so.
  session_runner.fails_to_save = Error(ExitCode::cannot_write, "still full");
  control.save();
  EXPECT_STREQ(control.failure()->what(), "still full");
  EXPECT_EQ(session_runner.begun, 3);
  ASSERT_TRUE(control.begin(true, false));
  // A rehearsal that ends by itself is told of.
  ASSERT_TRUE(frames_until(control, [&] { return session_runner.running->latest().tick > 10; }));
  session_runner.running->stop();
  control.watch();
  ASSERT_TRUE(control.failure());
  EXPECT_NE(std::string(control.failure()->what()).find("ended by itself"), std::string::npos);
}

TEST(RehearsalControl, ASessionKeepsItsMessagesInEnglishInAnyLanguage) {
  SessionRunner session_runner;
  RehearsalControl control = session_runner.control();
  control.look_from(kFromAbove);
  std::vector<std::string> shown;
  {
    const InLanguage german(Language::german);
    ASSERT_TRUE(control.begin(true, false));
    const auto said = [&] { shown.push_back(control.message()); };
    press(control, Command::burr_speed, -1);
    said();
    press(control, Command::second_hand);
    said();
    press(control, Command::saw);
    said();
    control.tools().keep_planned("");
    ASSERT_TRUE(frames_until(control, [&] { return control.message() != shown.back(); }));
    said();
    control.say([] { return shown_number(2.5, 1) + " mm"; });
    said();
  }
  session_runner.running.reset();
  const SessionReader file(session_runner.scratch / "1.oss");
  std::vector<std::string> kept;
  auto parts = file.parts();
  while (const SessionPart* const part = parts.next()) {
    for (const Note& note : part->notes) {
      const auto text = note.kind == "message" ? Json::parse(note.json) : std::nullopt;
      if (text && text->text() != nullptr) kept.push_back(*text->text());
    }
  }
  ASSERT_EQ(kept.size(), shown.size());
  EXPECT_EQ(kept[0], "burr at most at 75 % of its speed");
  EXPECT_EQ(kept[1].find("second hand: "), 0U) << kept[1];
  EXPECT_EQ(kept[2].find("saw: "), 0U) << kept[2];
  EXPECT_EQ(kept[3], "a planned cut needs a name");
  EXPECT_EQ(kept[4], "2.5 mm");
  for (std::size_t n = 0; n < kept.size(); ++n) EXPECT_NE(kept[n], shown[n]) << "on screen it is German";
  EXPECT_EQ(shown[4], "2,5 mm");
}

}  // namespace
}  // namespace osteo
