// All commands by name, and the search among them, without a window.
#include "commands.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "osteo/core/base/translate.h"

namespace osteo {
namespace {

TEST(Commands, EachHasNameGroupAndSynonymAndEachKeyARow) {
  std::set<std::string> names;
  for (const CommandRow& row : command_rows()) {
    EXPECT_TRUE(names.insert(row.name).second) << row.name;
    EXPECT_FALSE(row.group.empty()) << row.name;
    EXPECT_FALSE(row.synonyms.empty()) << row.name;
    EXPECT_TRUE(row.command || !row.keys.empty()) << row.name << ": a gesture says what it is";
  }
  for (const Key& key : key_table()) {
    const CommandRow* const row = row_of(key.command, key.value);
    ASSERT_NE(row, nullptr) << key_word(key.code);
    const std::string word = (key.with == kWithCtrl  ? "Ctrl-"
                              : key.with == kWithAlt ? "Alt-"
                                                     : "") +
                             key_word(key.code);
    EXPECT_NE((", " + row->keys + ",").find(", " + word + ","), std::string::npos) << row->name << ": " << row->keys;
    EXPECT_EQ(row->held, key.when == Key::When::held) << row->name;
  }
  // And each command that a button alone may have.
  for (int f = 0; f < static_cast<int>(EnumNames<HandFunction>::values.size()); ++f) {
    const ButtonCommand does = command_of(static_cast<HandFunction>(f));
    EXPECT_NE(row_of(does.command, does.value), nullptr)
        << EnumNames<HandFunction>::values[static_cast<std::size_t>(f)];
  }
}

TEST(Commands, GroupsAreNotTornApart) {
  std::set<std::string> over;
  std::string now;
  for (const CommandRow& row : command_rows()) {
    if (row.group == now) continue;
    EXPECT_TRUE(over.insert(row.group).second) << row.group;
    now = row.group;
  }
}

std::string best(const std::string& text) {
  const auto found = find_commands(text);
  return found.empty() ? "" : found[0]->name;
}

TEST(Commands, AreFoundByNameOldNameAndSynonym) {
  EXPECT_EQ(find_commands("").size(), command_rows().size());
  EXPECT_EQ(find_commands("  ").size(), command_rows().size());
  EXPECT_EQ(best("water"), "Irrigation on or off");
  EXPECT_EQ(best("bring"), "Approach: drill to the bone under the mouse");
  EXPECT_EQ(best("LIFT"), "Retract: drill out of the bone");
  EXPECT_EQ(best("take back"), "Undo: last stroke, cut, move or plate");
  EXPECT_EQ(best("plat"), "Plate: take one");
  EXPECT_EQ(best("full"), "Full screen");
  EXPECT_EQ(best("patient position"), "Patient position: supine");
  EXPECT_EQ(best("light"), "Colours: light");
  EXPECT_EQ(best("burr 4"), "Burr of 4 mm");
  EXPECT_EQ(best("xyzzy"), "");
  EXPECT_EQ(best("saw xyzzy"), "") << "each word has to fit";
}

// What one types may be of the language or English, with or without accents; Chinese has no blanks between words.
TEST(Commands, AreFoundInEnglishAndInTheLanguage) {
  const std::string english = command_rows().front().name;
  const auto command = [](const std::string& text) {
    const auto found = find_commands(text);
    return found.empty() ? std::nullopt : found[0]->command;
  };
  {
    const InLanguage german(Language::german);
    EXPECT_EQ(command_rows().front().name, english) << "rows are English, and shown in the language";
    for (const char* const text : {"spülung ein", "SPÜLUNG EIN", "spulung ein", "wasser", "water"})
      EXPECT_EQ(command(text), Command::irrigation) << text;
    for (const CommandRow& row : command_rows()) {
      const auto found = find_commands(shown_name(row));
      EXPECT_NE(std::find(found.begin(), found.end(), &row), found.end()) << shown_name(row);
      EXPECT_NE(shown_name(row), "");
    }
    EXPECT_EQ(shown_keys(*row_of(Command::deeper, 0)).find("Shift-wheel"), std::string::npos) << "gestures are";
  }
  {
    const InLanguage french(Language::french);
    EXPECT_EQ(command("plein ecran"), Command::full_screen);
    EXPECT_EQ(command("full screen"), Command::full_screen);
  }
  const InLanguage chinese(Language::chinese);
  EXPECT_EQ(command("\u5168\u5c4f"), Command::full_screen);
  EXPECT_EQ(command("\u540a\u540a"), std::nullopt);
  std::set<std::string> names;
  for (const CommandRow& row : command_rows()) EXPECT_TRUE(names.insert(shown_name(row)).second) << shown_name(row);
}

TEST(Commands, AShiftedKeyIsARowOfItsOwn) {
  const auto found = find_commands("look along");
  ASSERT_EQ(found.size(), 1U);
  EXPECT_TRUE(found[0]->shift);
  EXPECT_EQ(found[0]->keys, "Shift-G");
}

TEST(CommandSearch, TypesErasesAndMoves) {
  CommandSearch s;
  EXPECT_EQ(s.found().size(), command_rows().size());
  for (const char c : std::string("undo")) s.type(static_cast<char32_t>(c));
  ASSERT_NE(s.row(), nullptr);
  EXPECT_EQ(s.row()->command, Command::undo);
  s.move(100);
  EXPECT_EQ(s.chosen(), s.found().size() - 1);
  s.move(-100);
  EXPECT_EQ(s.chosen(), 0U);
  // Whole letters, of any script.
  s.clear();
  s.type(U' ');
  EXPECT_EQ(s.text(), "");
  s.type(U'\u00fc');
  s.type(U'\u4e2d');
  EXPECT_EQ(s.text(), "\u00fc\u4e2d");
  EXPECT_EQ(s.row(), nullptr);
  s.erase();
  EXPECT_EQ(s.text(), "\u00fc");
  s.erase();
  s.erase();
  EXPECT_EQ(s.found().size(), command_rows().size());
}

}  // namespace
}  // namespace osteo
