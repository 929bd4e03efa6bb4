// Each command by its name, for people: the list of all, and a search in it by name, old name and synonym. Made from
// the table of keys, so that it shows the key which does the same. Private to libs/app/window; no ImGui, no screen.
#pragma once
#include <optional>
#include <string>
#include <vector>

#include "keys.h"

namespace osteo::inline app {

struct CommandRow {
  std::string name, group, synonyms;  ///< in English; tr() has group and synonyms in the language
  std::string gesture;                ///< of the mouse; what `keys` begin with
  std::string keys;                   ///< those that do it, with commas between them; empty: none
  std::optional<Command> command;     ///< none: a gesture of the mouse, which can only be told
  int value = 0;
  bool shift = false;
  bool held = false;  ///< works while its key is down: a click on its row cannot do it
};
/// Groups one after another, in the order of the work.
[[nodiscard]] const std::vector<CommandRow>& command_rows();
/// A row's name and keys in the language. Names of keys stay English, as they are on most keyboards.
[[nodiscard]] std::string shown_name(const CommandRow& row);
[[nodiscard]] std::string shown_keys(const CommandRow& row);
/// What a key or a button does in words: the row of its command and value; null: it has none.
[[nodiscard]] const CommandRow* row_of(Command command, int value);
/// Rows by how well they fit, best first; all of them for a text without letters. Each word of the text has to begin a
/// word of the row's name, synonyms or group, all of them in English or all of them in the language; accents and
/// capitals make no difference.
[[nodiscard]] std::vector<const CommandRow*> find_commands(const std::string& text);

/// A text that is being typed, what is found for it, and which of that is chosen.
class CommandSearch {
 public:
  CommandSearch() { look(); }
  void clear();
  void type(char32_t letter);
  void erase();  ///< the last letter
  void move(int rows);
  void choose(std::size_t row) { chosen_ = row; }
  [[nodiscard]] const std::string& text() const { return text_; }
  [[nodiscard]] const std::vector<const CommandRow*>& found() const { return found_; }
  [[nodiscard]] std::size_t chosen() const { return chosen_; }
  /// Null where nothing is found.
  [[nodiscard]] const CommandRow* row() const { return found_.empty() ? nullptr : found_[chosen_]; }

 private:
  void look();
  std::string text_;
  std::vector<const CommandRow*> found_;
  std::size_t chosen_ = 0;
};

}  // namespace osteo::inline app
