// What helps to find a command: the card of ten keys, and the searchable list of all. Private to libs/app/window;
// ImGui, no GL.
#pragma once
#include <string>
#include <vector>

#include "commands.h"
#include "view_layout.h"

namespace osteo::inline app {

/// A row of the card: keys, and what they do, in the language.
struct TenKeysRow {
  std::string keys, text;
};
[[nodiscard]] std::vector<TenKeysRow> ten_keys();

class CommandPalette {
 public:
  enum class Shown { nothing, ten_keys, commands, all };
  [[nodiscard]] Shown shown() const { return shown_; }
  void show(Shown what);
  /// F1: the card; again: all commands by groups; again: nothing.
  void help();
  /// Letters are the search's, and no other command's.
  [[nodiscard]] bool typing() const { return shown_ == Shown::commands || shown_ == Shown::all; }
  [[nodiscard]] const CommandSearch& search() const { return search_; }

  /// Each key as it is pressed or repeats, as GLFW numbers it, and each letter that is typed: looked at in their order
  /// when it is drawn next, also those that come before the picture in which Ctrl-K opens it.
  void key(int code, int modifiers);
  void letter(char32_t letter);
  /// Of the card of ten keys, in pixels now.
  [[nodiscard]] static float card_width();
  /// Between ImGui::NewFrame and Render. The card lies on `view`, the list in the middle of `window`. The row that is
  /// to be done; null: none.
  [[nodiscard]] const CommandRow* draw(const ScreenBox& window, const ScreenBox& view);

 private:
  struct Line {
    const CommandRow* row;  // null: a heading
    std::size_t found;      // its place among those found
    std::string heading;
    float high;
  };
  [[nodiscard]] bool take_keys();
  [[nodiscard]] std::vector<Line> lines(float wide) const;
  void draw_ten_keys(const ScreenBox& view);
  [[nodiscard]] const CommandRow* draw_list(const ScreenBox& window, bool run);

  Shown shown_ = Shown::nothing;
  CommandSearch search_;
  struct Pressed {
    int code, modifiers;
    char32_t letter;  // 0: a key
  };
  std::vector<Pressed> pressed_;
  bool opens_ = false;  // Ctrl-K was pressed since the last picture
  float scroll_ = 0;
  std::size_t shown_chosen_ = 0;  // the chosen row is in sight
};

}  // namespace osteo::inline app
