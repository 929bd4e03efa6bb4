// Text and colours of Dear ImGui at a scale. Private to libs/app/window; an ImGui context, no GL.
#pragma once
#include <imgui.h>

#include <set>
#include <string>
#include <string_view>

#include "palette.h"
#include "view_layout.h"

namespace osteo::inline app {

/// Puts Noto Sans into the context's atlas, an em of it so high, in place of what is there, and sets sizes and colours
/// that go with it. It is part of the program, no file is looked for. The atlas has Western Europe's letters, those of
/// the language, and what need_letters() was told of; of many letters those that were not drawn for long are forgotten.
/// Its texture has to be made again by whoever owns one.
void set_ui_style(int em_pixels);
/// What cases and people bring along, names and notes: their letters are in the atlas from its next making on. Latin,
/// Greek, Cyrillic, and of Chinese, Japanese and Korean what the fonts have (libs/app/window/fonts). Cheap where all of
/// them are there already; what is drawn by this header and ui_kit.h asks for itself.
void need_letters(std::string_view text);
void need_letter(char32_t letter);
/// Some are not there yet, or the language is another one: between two pictures set_ui_style() is due.
[[nodiscard]] bool letters_missing();
/// Colours alone, as theme() has them now; and a person's theme by its name in the settings, into use.
void set_ui_colours();
void take_theme(const std::string& name);
/// For figures and titles: digits of equal width, so that nothing moves while they change. kBoldEm em high; Chinese,
/// Japanese and Korean are not bold in it.
inline constexpr float kBoldEm = 1.5F;
/// From line to line, in em. ImGui's size of a font is this: an em of letters is em() high.
inline constexpr float kLineEm = 1.25F;
/// Labels and keys, and nothing smaller: 14 pixels of 16.
inline constexpr float kLabelEm = 0.875F;
[[nodiscard]] ImFont* bold_font();

[[nodiscard]] inline ImVec4 im_colour(Colour c, float alpha = 1) {
  return {c.red, c.green, c.blue, alpha};
}
[[nodiscard]] inline ImU32 im_colour32(Colour c, float alpha = 1) {
  return ImGui::ColorConvertFloat4ToU32(im_colour(c, alpha));
}
/// An em of the letters now: 16 pixels at scale 1, of which a capital has 0.714.
[[nodiscard]] inline float em() {
  return ImGui::GetFontSize() / kLineEm;
}

/// A window at a fixed place that only scrolls. End() follows as after ImGui::Begin.
void begin_fixed(const char* name, const ScreenBox& box, ImGuiWindowFlags more = 0);
/// One line of text in a box, its em at most `em_pixels` high; centred in height, from the left or in the middle. Too
/// long it is smaller, down to 14 pixels at scale 1; longer still it loses its middle, and is whole on hovering.
void fitted_text(ImDrawList* draw, const ScreenBox& box, float em_pixels, Colour colour, const std::string& text,
                 bool middle = false, bool bold = false);
/// Of a text that is too long for its place: without its middle, "superior ... left side".
[[nodiscard]] std::string shortened(const std::string& text, float width, float size, ImFont* font = nullptr);
/// Texts that had no room and lost their middle since the program began, each once: what a test of the window asks for.
[[nodiscard]] const std::set<std::string>& texts_cut();
void forget_texts_cut();
/// The sign of a state: a disc for 0 corners.
void draw_sign(ImDrawList* draw, ImVec2 centre, float radius, int corners, Colour colour);

}  // namespace osteo::inline app
