// The window's keys, without a window.
#include "keys.h"
#include "folders.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <set>
#include <sstream>
#include <string>
#include <utility>

namespace osteo {
namespace {

using Event = Keyboard::Event;

TEST(Keys, EachKeyHasOneMeaning) {
  std::set<std::pair<int, int>> codes;
  for (const Key& k : key_table()) {
    EXPECT_TRUE(codes.insert({k.code, k.with}).second) << k.code;
    EXPECT_EQ(find_key(k.code, k.with)->command, k.command);
  }
  // With Ctrl another than alone; with Ctrl where it means nothing, as alone.
  EXPECT_EQ(find_key('L', kWithCtrl)->command, Command::regions);
  EXPECT_EQ(find_key('L', kWithShift)->command, Command::plates);
  EXPECT_EQ(find_key('J', kWithCtrl)->command, Command::quality);
  EXPECT_EQ(find_key('T', kWithCtrl)->command, Command::timeline);
  EXPECT_EQ(find_key('J')->command, Command::quality);
  EXPECT_EQ(find_key('J', kWithAlt | kWithShift)->command, Command::quality) << "Alt means nothing to it";
  EXPECT_EQ(find_key('8'), nullptr);
  EXPECT_EQ(find_key(263)->command, Command::earlier) << "Left, without Alt";
}

// What other programs' users press.
TEST(Keys, UndoSearchAndFocus) {
  EXPECT_EQ(find_key('Z', kWithCtrl)->command, Command::undo);
  EXPECT_EQ(find_key('Z')->command, Command::undo);
  EXPECT_EQ(find_key('K', kWithCtrl)->command, Command::palette);
  EXPECT_EQ(find_key('K')->command, Command::second_hand);
  EXPECT_EQ(find_key(258)->command, Command::focus_next) << "Tab";
  EXPECT_EQ(find_key(258, kWithShift)->command, Command::focus_next);
  EXPECT_EQ(find_key(258, kWithCtrl)->command, Command::wheel);
  EXPECT_EQ(find_key('I')->command, Command::irrigation);
  EXPECT_EQ(find_key('H'), nullptr) << "no help by accident";
}

TEST(Keys, ThePageOfKeysHasEach) {
  std::ifstream file(source_folder() / "docs/how-to/keys.md");
  std::stringstream text;
  text << file.rdbuf();
  // Of the tables the first column.
  std::string keys, line;
  while (std::getline(text, line)) {
    if (line.starts_with("| ")) keys += " " + line.substr(2, line.find(" |", 2) - 2) + ",";
  }
  std::erase(keys, '*');
  for (const Key& k : key_table()) {
    if (k.code < 'A' || k.code > 'Z') continue;
    const std::string name = std::string(k.with == kWithCtrl  ? "Ctrl-"
                                         : k.with == kWithAlt ? "Alt-"
                                                              : "") +
                             static_cast<char>(k.code);
    EXPECT_NE(keys.find(" " + name + ","), std::string::npos) << name;
  }
  for (const char* name : {" F5,",         " Enter,",     " Esc,",          " Home,",       " Space,",   " Up,",
                           " Down,",       " F1,",        " 1 to 7,",       " F2,",         " F9,",      " F10,",
                           " F11,",        " Tab,",       " Ctrl-Tab,",     " Alt-arrows,", " Page Up,", " Insert,",
                           " apostrophe,", " backslash,", " grave accent,", " -,",          " =,",       " 9,",
                           " 0,",          " Alt-H,",     " Ctrl-H,",       " Ctrl-T,",     " Left,",    " Right,"})
    EXPECT_NE(keys.find(name), std::string::npos) << name << " in" << keys;
}

// At few pictures a second a key goes down and up between two of them.
TEST(Keyboard, AShortPressIsNotMissed) {
  Keyboard k;
  k.on('V', Event::pressed);
  k.on('V', Event::released);
  k.on('X', Event::pressed);
  k.on('X', Event::released);
  const auto presses = k.frame(false);
  ASSERT_EQ(presses.size(), 2U);
  EXPECT_EQ(presses[1].command, Command::saw);
  EXPECT_FALSE(presses[1].shift);
  EXPECT_TRUE(k.held(Command::suck));
  EXPECT_TRUE(k.frame(false).empty());
  EXPECT_FALSE(k.held(Command::suck));
}

TEST(Keyboard, ShiftBelongsToItsPress) {
  Keyboard k;
  k.on('G', Event::pressed, kWithShift);
  k.on('G', Event::released);
  k.on('G', Event::pressed);
  const auto presses = k.frame(false);
  ASSERT_EQ(presses.size(), 2U);
  EXPECT_TRUE(presses[0].shift);
  EXPECT_FALSE(presses[1].shift);
}

TEST(Keyboard, AHeldKeyIsHeldUntilItIsLetGo) {
  Keyboard k;
  k.on('V', Event::pressed);
  for (int frame = 0; frame < 3; ++frame) {
    static_cast<void>(k.frame(false));
    EXPECT_TRUE(k.held(Command::suck));
    EXPECT_FALSE(k.held(Command::wash));
    k.on('V', Event::repeated);
  }
  k.on('V', Event::released);
  static_cast<void>(k.frame(false));
  static_cast<void>(k.frame(false));
  EXPECT_FALSE(k.held(Command::suck));
}

TEST(Keyboard, OnlySomeKeysRepeat) {
  Keyboard k;
  k.on(264, Event::pressed);  // Down
  k.on(264, Event::repeated);
  k.on('R', Event::pressed);
  k.on('R', Event::repeated);
  const auto presses = k.frame(false);
  ASSERT_EQ(presses.size(), 3U);
  EXPECT_EQ(presses[1].command, Command::deeper);
  EXPECT_EQ(presses[2].command, Command::reset);
}

TEST(Keyboard, DigitsSayTheDiameter) {
  Keyboard k;
  for (int d = 1; d <= 7; ++d) k.on('0' + d, Event::pressed);
  const auto presses = k.frame(false);
  ASSERT_EQ(presses.size(), 7U);
  for (int d = 1; d <= 7; ++d) EXPECT_EQ(presses[static_cast<std::size_t>(d - 1)].value, d);
}

// Into a field of the panel.
TEST(Keyboard, WhatIsWrittenAsTextIsNoCommand) {
  Keyboard k;
  k.on('Q', Event::pressed);
  k.on('V', Event::pressed);
  EXPECT_TRUE(k.frame(true).empty());
  EXPECT_FALSE(k.held(Command::suck));
}

}  // namespace
}  // namespace osteo
