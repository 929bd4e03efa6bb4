// The dialog of the desktop, with a program in its place that says what the test wants.
#include "file_dialog.h"

#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <thread>

#include "osteo/core/base/files.h"
#include "scratch.h"

namespace osteo {
namespace {

// A zenity of a few lines of shell, the first on the PATH.
class Desktop : public testing::Test {
 protected:
  void zenity(const std::string& script) {
    const fs::path program = scratch_ / "zenity";
    std::ofstream(program) << "#!/bin/sh\n" << script << "\n";
    fs::permissions(program, fs::perms::owner_all);
    ::setenv("PATH", (scratch_.path().string() + ":" + before_).c_str(), 1);
  }
  FileDialog::Answer answer(const std::string& script) {
    zenity(script);
    FileDialog dialog;
    EXPECT_EQ(dialog.open(scratch_.path()), "");
    EXPECT_TRUE(dialog.is_open());
    for (int n = 0; n < 20000; ++n) {
      if (const auto a = dialog.poll()) {
        EXPECT_FALSE(dialog.is_open());
        EXPECT_FALSE(dialog.poll()) << "once";
        return *a;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    ADD_FAILURE() << "no answer: " << script;
    return {};
  }
  void TearDown() override { ::setenv("PATH", before_.c_str(), 1); }
  test::ScratchFolder scratch_;
  std::string before_ = std::getenv("PATH");
};

TEST_F(Desktop, WhatIsChosenIsAFolder) {
  const FileDialog::Answer a = answer("echo \"$@\" > '" + (scratch_ / "asked").string() + "'; echo '/data/a case'");
  ASSERT_TRUE(a.chosen) << a.why;
  EXPECT_EQ(*a.chosen, "/data/a case");
  EXPECT_EQ(a.why, "");
  const std::string asked = read_text(scratch_ / "asked");
  EXPECT_NE(asked.find("--file-selection --directory"), std::string::npos) << asked;
  EXPECT_NE(asked.find("--filename=" + scratch_.path().string() + "/"), std::string::npos) << asked;
}

TEST_F(Desktop, WhoGivesUpIsToldNothing) {
  const FileDialog::Answer a = answer("exit 1");
  EXPECT_FALSE(a.chosen);
  EXPECT_EQ(a.why, "");
}

TEST_F(Desktop, WhatIsNoFolderIsNotTaken) {
  for (const char* script : {"echo relative", "echo", "true", "printf '/one\\n/two\\n'", "printf '/a\\000b\\n'",
                             "head -c 3000000 /dev/zero | tr '\\0' '/'; exit 0"}) {
    const FileDialog::Answer a = answer(script);
    EXPECT_FALSE(a.chosen) << script;
    EXPECT_NE(a.why.find("named no folder"), std::string::npos) << script << ": " << a.why;
  }
  for (const char* script : {"kill -9 $$", "echo /data/case; exit 5"}) {
    const FileDialog::Answer a = answer(script);
    EXPECT_FALSE(a.chosen) << script;
    EXPECT_NE(a.why.find("without an answer"), std::string::npos) << script << ": " << a.why;
  }
}

TEST_F(Desktop, ADialogThatStaysOpenHoldsNobodyUp) {
  zenity("trap '' TERM; echo $$ > '" + (scratch_ / "number").string() + "'; while :; do sleep 1; done");
  pid_t number = 0;
  {
    FileDialog dialog;
    ASSERT_EQ(dialog.open(scratch_.path()), "");
    for (int n = 0; n < 10000 && number == 0; ++n) {
      std::ifstream(scratch_ / "number") >> number;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    ASSERT_GT(number, 0);
    EXPECT_FALSE(dialog.poll());
    EXPECT_EQ(dialog.open("/"), "") << "one at a time";
    EXPECT_EQ(::kill(number, 0), 0);
  }
  EXPECT_NE(::kill(number, 0), 0) << "gone with the page";
}

TEST_F(Desktop, WithoutItThereIsNone) {
  ::setenv("PATH", (scratch_ / "empty").c_str(), 1);
  EXPECT_FALSE(FileDialog::there());
  FileDialog dialog;
  EXPECT_NE(dialog.open("/").find("zenity"), std::string::npos);
  EXPECT_FALSE(dialog.is_open());
  zenity("true");
  EXPECT_TRUE(FileDialog::there());
}

}  // namespace
}  // namespace osteo
