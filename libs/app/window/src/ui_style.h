// Text and colours of Dear ImGui at a scale. Private to libs/app/window; an ImGui context, no GL.
#pragma once
#include <imgui.h>

#include <string>

#include "palette.h"
#include "room_layout.h"

namespace osteo::inline app {

struct UiFont {
  std::string file;     ///< empty: ImGui's own small one, made larger
  std::string missing;  ///< what to do about it then
};
/// DejaVu Sans, else the system's next best outline font without serifs; found by fontconfig, so that no path is built
/// in. Once per process: 20 ms.
[[nodiscard]] const UiFont& ui_font();
/// Puts the font at this height into the context's atlas, in place of what is there, and sets sizes and colours that go
/// with it. The atlas' texture has to be made again by whoever owns one.
void set_ui_style(int em_pixels);

[[nodiscard]] inline ImVec4 im_colour(Colour c, float alpha = 1) {
  return {c.red, c.green, c.blue, alpha};
}
[[nodiscard]] inline ImU32 im_colour32(Colour c, float alpha = 1) {
  return ImGui::ColorConvertFloat4ToU32(im_colour(c, alpha));
}
/// Height of text now.
[[nodiscard]] inline float em() {
  return ImGui::GetFontSize();
}

/// A window at a fixed place that only scrolls. End() follows as after ImGui::Begin.
void begin_fixed(const char* name, const ScreenBox& box, ImGuiWindowFlags more = 0);
/// One line of text in a box, as large as fits, at most `em_pixels` high; centred in height, from the left or in the
/// middle.
void fitted_text(ImDrawList* draw, const ScreenBox& box, float em_pixels, Colour colour, const std::string& text,
                 bool middle = false);
/// The sign of a state: a disc for 0 corners.
void draw_sign(ImDrawList* draw, ImVec2 centre, float radius, int corners, Colour colour);

}  // namespace osteo::inline app
