#include "scope_panel.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "osteo/core/base/param.h"
#include "osteo/core/base/translate.h"
#include "ui_kit.h"

namespace osteo::inline app {

void draw_scope(const ScopeView& view, const PictureArea& area, StereoMode stereo) {
  const auto line = static_cast<double>(ImGui::GetTextLineHeight());
  const ScaleBar bar = scale_bar(view.pixels_per_mm(area), std::min(0.12 * area.width, 12.0 * line));
  constexpr double kMicroscope = 2;  // below, the bar says enough
  const std::string length = shown_figures(format_number(bar.length_mm)) + " mm",
                    words = view.magnification < kMicroscope || area.width <= static_cast<double>(kNarrow * unit())
                                ? std::string()
                                : scope_text(view);
  ImDrawList* const list = ImGui::GetBackgroundDrawList();
  // At the lower right, of each eye's picture.
  const auto draw = [&](double right, double up, double squeezed) {
    const auto e = static_cast<float>(line);
    const float wide = static_cast<float>(bar.length_px * squeezed);
    const float most = std::max(wide, ImGui::CalcTextSize(words.empty() ? length.c_str() : words.c_str()).x);
    const float x = static_cast<float>(area.x + right * area.width) - 1.75F * e - most,
                y = static_cast<float>(area.y + area.height * (1 - up)) - 1.75F * e, high = words.empty() ? 1.6F : 2.6F;
    constexpr ImU32 kInk = IM_COL32(235, 235, 235, 255);
    // Legible on white bone too.
    list->AddRectFilled({x - 0.75F * e, y - high * e}, {x + most + 0.75F * e, y + 0.75F * e}, IM_COL32(10, 14, 20, 190),
                        0.5F * e);
    list->AddRectFilled({x + most - wide, y - 3}, {x + most, y}, kInk);
    const float length_wide = ImGui::CalcTextSize(length.c_str()).x;
    list->AddText({x + most - length_wide, y - 5 - e}, kInk, length.c_str());
    if (!words.empty()) list->AddText({x, y - 7 - 2 * e}, kInk, words.c_str());
  };
  draw(stereo == StereoMode::side_by_side ? 0.5 : 1, 0, stereo == StereoMode::side_by_side ? 0.5 : 1);
  if (stereo == StereoMode::side_by_side) draw(1, 0, 0.5);
  if (stereo == StereoMode::top_bottom) draw(1, 0.5, 1);
}

namespace {

void draw_stereo(StereoScreen& screen) {
  const std::string modes[] = {tr("one picture"),          tr("side by side"),    tr("top and bottom"),
                               tr("anaglyph (red, cyan)"), tr("interlaced rows"), tr("quad buffer")};
  StereoParams& s = screen.params;
  if (const int mode = kit_list(tr("Stereo"), modes, static_cast<int>(s.mode)); mode >= 0)
    s.mode = static_cast<StereoMode>(mode);
  if (s.mode == StereoMode::quad_buffer && !screen.has_quad_buffer())
    ImGui::TextWrapped(
        "%s", tr("This display has no buffer for each eye, or the window was not opened with --stereo quad_buffer: the "
                 "left eye is shown."));
  if (s.mode == StereoMode::off) return;
  static_cast<void>(kit_slider(tr("Between the eyes"), shown_number(s.base_mm, 0) + " mm", s.base_mm, 0, 65, 1));
  static_cast<void>(kit_slider(tr("In front of the screen"), shown_number(s.convergence_mm, 0) + " mm",
                               s.convergence_mm, -50, 50, 1));
  static_cast<void>(kit_switch(tr("Eyes swapped"), s.swap));
}

// Buttons side by side, in the next row where one has no room.
class Row {
 public:
  bool button(const std::string& words) {
    const float gap = kGap * unit();
    if (!first_ && ImGui::GetItemRectMax().x + gap + button_width(words) <= right_) ImGui::SameLine(0, gap);
    first_ = false;
    return kit_button(words);
  }

 private:
  bool first_ = true;
  float right_ = ImGui::GetCursorScreenPos().x + ImGui::GetContentRegionAvail().x;
};

}  // namespace

void draw_quality(QualityChoice& quality) {
  const std::string words[] = {tr("Automatic"), tr("Plain"), tr("Calm"), tr("Deep")};
  if (const int n = kit_list(tr("Picture quality"), words, static_cast<int>(quality.wish())); n >= 0)
    quality.want(static_cast<Quality>(n));
}

void draw_scope_panel(ScopeInput& scope, StereoScreen& stereo, const ScopeScene& scene) {
  ScopeControl& control = scope.control;
  ImGui::TextDisabled("%s", tr("Look from"));
  Row from;
  if (from.button(tr_of("seen from", "left"))) scope.overview(StandardView::left, scene, true);
  if (from.button(tr_of("seen from", "right"))) scope.overview(StandardView::right, scene, true);
  if (from.button(tr_of("seen from", "front"))) scope.overview(StandardView::front, scene, true);
  if (from.button(tr_of("seen from", "above"))) scope.overview(StandardView::above, scene, true);
  if (from.button(tr_of("seen from", "surgeon"))) scope.overview(StandardView::surgeon, scene, true);
  if (from.button(tr("drill (G)"))) control.look_at(scene.drill_mm);
  if (from.button(tr("along it"))) control.look_along(scene.drill_mm, scene.handle);
  if (from.button(tr("Camera back (Backspace)"))) static_cast<void>(control.undo());
  ImGui::TextDisabled("%s", tr("Kept views"));
  Row kept;
  for (std::size_t n = 0; n < ScopeControl::kBookmarks; ++n) {
    const std::string key = "F" + std::to_string(6 + n);
    if (control.bookmark(n) && kept.button(key)) static_cast<void>(control.go_to_bookmark(n));
    if (kept.button(filled(tr("keep as {key}"), {{"key", key}}))) control.set_bookmark(n);
  }
  ImGui::TextDisabled("%s", tr("Microscope"));
  const double times = scope.view().magnification;
  double steps = std::log2(times);
  if (kit_slider(tr("Magnification"), shown_number(times, 1) + "x", steps, -1, std::log2(40.0), 0.1))
    control.zoom(std::exp2(steps) / times);
  double distance = scope.view().working_distance_mm;
  if (kit_slider(tr("Working distance"), shown_number(distance, 0) + " mm", distance, 150, 600, 10))
    control.set_working_distance(distance);
  bool upright = control.target().upright;
  if (kit_switch(tr("Head stays up"), upright)) control.set_upright(upright);
  static_cast<void>(kit_switch(tr("Fly to views (0.4 s)"), control.flights));
  static_cast<void>(kit_slider(tr("Inertia"), shown_number(control.arm.params.inertia_s, 2) + " s",
                               control.arm.params.inertia_s, 0, 0.5, 0.02));
  ImGui::TextDisabled("%s", tr("O, pedal: the device"));
  const std::string modes[] = {tr("moves"), tr("turns"), tr("both")};
  if (const int mode = choice("guide", modes, static_cast<int>(scope.mode)); mode >= 0)
    scope.mode = static_cast<CameraGuide>(mode);
  draw_stereo(stereo);
}

}  // namespace osteo::inline app
