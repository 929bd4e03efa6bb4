#include "scope_panel.h"

#include <imgui.h>

#include <algorithm>
#include <string>

#include "osteo/core/base/param.h"
#include "osteo/core/base/translate.h"

namespace osteo::inline app {

void draw_scope(const ScopeView& view, const PictureArea& area, StereoMode stereo) {
  const auto line = static_cast<double>(ImGui::GetTextLineHeight());
  const ScaleBar bar = scale_bar(view.pixels_per_mm(area), std::min(0.12 * area.width, 12.0 * line));
  constexpr double kMicroscope = 2;  // below, the bar says enough
  const std::string length = shown_figures(format_number(bar.length_mm)) + " mm",
                    words = view.magnification < kMicroscope ? std::string() : scope_text(view);
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
  const char* const modes[] = {tr("one picture"),          tr("side by side"),    tr("top and bottom"),
                               tr("anaglyph (red, cyan)"), tr("interlaced rows"), tr("quad buffer")};
  StereoParams& s = screen.params;
  int mode = static_cast<int>(s.mode);
  ImGui::SetNextItemWidth(-1);
  if (ImGui::Combo("##stereo", &mode, modes, IM_ARRAYSIZE(modes))) s.mode = static_cast<StereoMode>(mode);
  if (s.mode == StereoMode::quad_buffer && !screen.has_quad_buffer())
    ImGui::TextWrapped(
        "%s", tr("This display has no buffer for each eye, or the window was not opened with --stereo quad_buffer: the "
                 "left eye is shown."));
  if (s.mode == StereoMode::off) return;
  auto base = static_cast<float>(s.base_mm), convergence = static_cast<float>(s.convergence_mm);
  if (ImGui::SliderFloat(tr("base, mm"), &base, 0, 65, "%.0f")) s.base_mm = static_cast<double>(base);
  if (ImGui::SliderFloat(tr("in front, mm"), &convergence, -50, 50, "%.0f"))
    s.convergence_mm = static_cast<double>(convergence);
  ImGui::Checkbox(tr("eyes swapped"), &s.swap);
}

}  // namespace

void draw_scope_panel(ScopeInput& scope, StereoScreen& stereo, const ScopeScene& scene) {
  ImGui::TextUnformatted(tr("Look from"));
  const auto button = [&](const char* name, StandardView from, bool last = false) {
    if (ImGui::Button(name)) scope.overview(from, scene, true);
    if (!last) ImGui::SameLine();
  };
  button(tr_of("seen from", "left"), StandardView::left);
  button(tr_of("seen from", "right"), StandardView::right);
  button(tr_of("seen from", "front"), StandardView::front);
  button(tr_of("seen from", "above"), StandardView::above, true);
  button(tr_of("seen from", "surgeon"), StandardView::surgeon);
  if (ImGui::Button(tr("drill (G)"))) scope.control.look_at(scene.drill_mm);
  ImGui::SameLine();
  if (ImGui::Button(tr("along it"))) scope.control.look_along(scene.drill_mm, scene.handle);
  ImGui::Text("%s", scope_text(scope.view()).c_str());
  if (!ImGui::TreeNode("microscope", "%s", tr("Microscope"))) return;
  ScopeControl& control = scope.control;
  ImGui::PushItemWidth(-5.5F * ImGui::GetFontSize());  // room for their names
  if (ImGui::Button(tr("Camera back (Backspace)"), {-1, 0})) static_cast<void>(control.undo());
  auto m = static_cast<float>(scope.view().magnification);
  if (ImGui::SliderFloat("x", &m, 0.5F, 40, "%.1f", ImGuiSliderFlags_Logarithmic))
    control.zoom(static_cast<double>(m) / scope.view().magnification);
  auto wd = static_cast<float>(scope.view().working_distance_mm);
  if (ImGui::SliderFloat(tr("WD, mm"), &wd, 150, 600, "%.0f")) control.set_working_distance(static_cast<double>(wd));
  bool upright = control.target().upright;
  if (ImGui::Checkbox(tr("head stays up"), &upright)) control.set_upright(upright);
  ImGui::Checkbox(tr("fly to views (0.4 s)"), &control.flights);
  auto inertia = static_cast<float>(control.arm.params.inertia_s);
  if (ImGui::SliderFloat(tr("inertia, s"), &inertia, 0, 0.5F, "%.2f"))
    control.arm.params.inertia_s = static_cast<double>(inertia);
  ImGui::TextUnformatted(tr("O, pedal: the device"));
  int mode = static_cast<int>(scope.mode);
  bool changed = ImGui::RadioButton(tr("moves"), &mode, 0);
  ImGui::SameLine();
  changed = ImGui::RadioButton(tr("turns"), &mode, 1) || changed;
  ImGui::SameLine();
  changed = ImGui::RadioButton(tr("both"), &mode, 2) || changed;
  if (changed) scope.mode = static_cast<CameraGuide>(mode);
  for (int n = 0; n < static_cast<int>(ScopeControl::kBookmarks); ++n) {
    const std::string name = "F" + std::to_string(6 + n), keep = std::string(tr("keep")) + "##" + name;
    const bool kept = control.bookmark(static_cast<std::size_t>(n)).has_value();
    if (!kept) ImGui::PushStyleVar(ImGuiStyleVar_Alpha, 0.5F);
    if (ImGui::Button(name.c_str()) && kept) static_cast<void>(control.go_to_bookmark(static_cast<std::size_t>(n)));
    if (!kept) ImGui::PopStyleVar();
    ImGui::SameLine();
    if (ImGui::Button(keep.c_str())) control.set_bookmark(static_cast<std::size_t>(n));
    if (n + 1 < static_cast<int>(ScopeControl::kBookmarks)) ImGui::SameLine();
  }
  ImGui::TextUnformatted(tr("Stereo"));
  draw_stereo(stereo);
  ImGui::PopItemWidth();
  ImGui::TreePop();
}

}  // namespace osteo::inline app
