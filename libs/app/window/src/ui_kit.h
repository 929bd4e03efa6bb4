// The window's components, each once: tile, button, choice, switch, slider, list, row, field, chip, card, dialog. Drawn
// by draw lists in the theme's colours; ImGui keeps focus and clicks. Sizes are of docs/design/window.md, in pixels at
// scale 1. Private to libs/app/window; ImGui, no GL.
#pragma once
#include <imgui.h>

#include <array>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "palette.h"
#include "ui_style.h"
#include "view_layout.h"

namespace osteo::inline app {

/// Pixels of the screen for one of the design's.
[[nodiscard]] inline float unit() {
  return em() / static_cast<float>(kTextPixels);
}
inline constexpr float kTile = 40, kControl = 40, kSlider = 48, kSmallControl = 32, kRow = 36, kGap = 8, kRound = 8,
                       kCardRound = 12;

/// Of who drives the window: from now on middles of the components in each picture are kept, by their words or, where
/// they have none, by what ImGui calls them; also of the entries of an open list.
void keep_places();
[[nodiscard]] const std::map<std::string, std::array<float, 2>>& kept_places();
/// Windows of the last picture by name, and whether one holds more than it shows and cannot be scrolled to.
struct ShownWindow {
  std::string name;
  ScreenBox box;
  bool cut = false;
};
[[nodiscard]] std::vector<ShownWindow> shown_windows();

/// Outline of 24 x 24 in a square of `side` pixels; a name of icon_lines.h. No-op for a name that it lacks.
void draw_icon(ImDrawList* draw, ImVec2 corner, float side, std::string_view name, ImU32 colour);
[[nodiscard]] bool has_icon(std::string_view name);

struct TileLook {
  bool selected = false;  ///< in the hand: accent outline, bar at the left
  bool on = false;        ///< works now: raised, bar below; not a selection
  bool enabled = true;
  std::string words;  ///< name and key, or why it is off: after 0.4 s
};
/// At the cursor. True: pressed. ImGui::IsItemActive() tells whether it is held.
/// `side`: pixels; 0: kTile.
[[nodiscard]] bool tile(const char* id, std::string_view icon, const TileLook& look, float side = 0);

enum class ButtonLook { usual, main, quiet };
/// As wide as its words need, at least `width`; 40 high. Where there is less room than that they have several lines.
[[nodiscard]] bool kit_button(const std::string& words, ButtonLook look = ButtonLook::usual, float width = 0,
                              float high = kControl);
[[nodiscard]] float button_width(const std::string& words);
/// What choice() takes of a line.
[[nodiscard]] float choice_width(std::span<const std::string> words);
/// One of several in a row; the one pressed, else -1. Where the row has no room below each other.
[[nodiscard]] int choice(const char* id, std::span<const std::string> words, int selected, float high = kControl);
/// In a strip that is no wider than `width` pixels, kSmallControl high: that, or where it has no room the selected one
/// alone, of which a click takes the next.
[[nodiscard]] int narrow_choice(const char* id, std::span<const std::string> words, int selected, float width);
/// `width`: pixels; 0: as there is room. 40 high, or as its words need in that.
[[nodiscard]] bool kit_switch(const std::string& words, bool& on, float width = 0);
/// 48 high, 68 where name and value have no room in one line: name above at the left, value at the right, neither on
/// the track. A drag or a click moves the knob; with
/// the focus Left and Right by `step`, with Shift by ten. `width`: pixels; 0: as there is room. True: `at` is another.
[[nodiscard]] bool kit_slider(const std::string& name, const std::string& value, double& at, double least, double most,
                              double step, float width = 0);
/// The same for what may be small or large: small values have as much of the track as large ones, by the cube root.
[[nodiscard]] bool kit_root_slider(const std::string& name, const std::string& value, double& at, double least,
                                   double most);
/// A square of this colour (parts of 1); pressed, it opens some colours and a slider for red, green and blue. True: it
/// is another.
[[nodiscard]] bool kit_colour(const char* id, std::array<float, 3>& rgb, float side = kRow);
/// Its name, where it has one, and below it a field that opens a list. The one that was chosen now, else -1. `shown`:
/// in the field where none of `words` is selected.
[[nodiscard]] int kit_list(const std::string& name, std::span<const std::string> words, int selected,
                           const std::string& shown = {});
/// A row of a list, as wide as there is room, with a second line where one is too short for both; `icon`: of
/// icon_lines.h, behind all words. `width`: pixels, in place of all the room.
[[nodiscard]] bool list_row(const std::string& words, const std::string& right, bool selected, float high = kRow,
                            std::string_view icon = {}, float width = 0);

/// Above a card or a column, bold, so many em high.
void kit_title(const std::string& words, float ems = 1.25F);
/// Above what belongs together, in the labels' colour; and words in lines as there is room.
void kit_heading(const std::string& words);
void kit_text(const std::string& words, Colour colour);
/// A field for a line of text, as wide as there is room but `less` pixels; `hint`: in it while it is empty. True:
/// Enter.
[[nodiscard]] bool kit_field(const char* id, const std::string& hint, std::string& text, float less = 0,
                             ImGuiInputTextFlags more = 0);

/// One question in the middle of a window: 448 wide, answers below each other where they have no room beside. The first
/// is the one that changes nothing; keys are the caller's, and stand in the answers. The one pressed, else -1.
[[nodiscard]] int kit_dialog(const ScreenBox& window, const std::string& title, std::span<const std::string> texts,
                             std::span<const std::string> answers);

/// A heading that folds out what is below it: true where it is open. It is no selection, so not in the accent.
[[nodiscard]] bool fold(const char* words);

/// A chip as wide as its words, or narrower: in a box of chip_height() it then has lines. Its sign says how serious,
/// its words are never in that colour.
struct ChipLook {
  Colour colour;
  int corners = 0;      ///< draw_sign()
  bool filled = false;  ///< contact: black words on the colour
};
[[nodiscard]] float chip_width(const std::string& words);
/// Of one so wide: 32 for a line, more where the words need several.
[[nodiscard]] float chip_height(const std::string& words, float width);
void draw_chip(ImDrawList* draw, const ScreenBox& box, const std::string& words, const ChipLook& look);

/// The panel behind a card: nearly opaque, edges as lines.
void draw_card(ImDrawList* draw, const ScreenBox& box);
/// begin_fixed() without a frame and ground of its own, for a card of this box; `padding`: within it. End() follows.
void begin_card(const char* name, const ScreenBox& box, ImVec2 padding, ImGuiWindowFlags more = 0);

}  // namespace osteo::inline app
