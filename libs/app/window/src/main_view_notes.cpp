// What is pinned to the bone and measured on it, and what stands below a picture that is kept.
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>
#include <vector>

#include "main_view.h"
#include "osteo/core/base/translate.h"
#include "ui_kit.h"
#include "ui_style.h"

namespace osteo::inline app {

void MainView::draw_note_field(RehearsalControl& control) {
  const float e = em(), wide = std::min(layout_.view.width - e, 26 * e);
  ImGui::SetNextWindowPos({layout_.view.x + (layout_.view.width - wide) / 2, layout_.view.y + e});
  ImGui::SetNextWindowSize({wide, 0});
  ImGui::Begin(tr("Note (without names)"), nullptr,
               ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoCollapse);
  if (write_focus_) ImGui::SetKeyboardFocusHere();
  write_focus_ = false;
  static_cast<void>(kit_field("##note", {}, note_text_));
  kit_text(tr("Enter keeps it; empty: marks this moment; Esc: nothing"), theme().quiet);
  ImGui::End();
  const int answer = std::exchange(note_answer_, 0);
  if (answer > 0) {
    if (const auto note = notes_.pin(*writing_, note_text_)) {
      control.rehearsal().note("note", *note);
      control.say([&] {
        return filled(tr("note {n} is pinned"), {{"n", std::to_string(notes_.all().back().number)}});
      });
    } else {
      control.rehearsal().note("mark", "{}");
      control.say([&] { return tr("marked"); });
    }
  }
  if (answer != 0) writing_.reset();
}

void MainView::draw_marks(const ViewScene& scene) {
  ImDrawList* const draw = ImGui::GetBackgroundDrawList();
  const float e = em();
  const ScreenBox& v = layout_.view;
  draw->PushClipRect({v.x, v.y}, {v.right(), v.bottom()});
  const auto words = [&](float x, float y, const std::string& text, Colour colour) {
    need_letters(text);
    const ImVec2 size = ImGui::CalcTextSize(text.c_str());
    x = std::clamp(x, v.x, std::max(v.x, v.right() - size.x - e / 2));
    y = std::clamp(y, v.y, std::max(v.y, v.bottom() - size.y));
    draw->AddRectFilled({x - e / 4, y}, {x + size.x + e / 4, y + size.y}, im_colour32(theme().ground, 0.8F));
    draw->AddText({x, y}, im_colour32(colour), text.c_str());
  };
  for (const PinnedNote& note : notes_.all()) {
    const auto at = scene.project(note.at_mm);
    if (!at) continue;
    const float x = (*at)[0], y = (*at)[1];
    draw->AddLine({x, y}, {x, y - 2 * e}, im_colour32(palette::kYellow), e / 8);
    draw->AddRectFilled({x, y - 2 * e}, {x + 1.4F * e, y - e}, im_colour32(palette::kYellow));
    const std::string number = std::to_string(note.number);
    draw->AddText({x + 0.35F * e, y - 2.1F * e}, IM_COL32(0, 0, 0, 255), number.c_str());
    words(x + 1.7F * e, y - 2 * e, note.text.size() > 40 ? note.text.substr(0, 40) + "..." : note.text, theme().text);
  }
  std::vector<std::array<float, 2>> ends;
  for (const Vec3 p : ruler_.points_mm()) {
    if (const auto at = scene.project(p)) {
      ends.push_back(*at);
      draw->AddCircle({(*at)[0], (*at)[1]}, e * 0.35F, im_colour32(palette::kSkyBlue), 16, e / 8);
    }
  }
  if (ends.size() == 2 && ruler_.length_mm()) {
    draw->AddLine({ends[0][0], ends[0][1]}, {ends[1][0], ends[1][1]}, im_colour32(palette::kSkyBlue), e / 8);
    const std::string text = shown_number(*ruler_.length_mm(), 1) + " mm";
    words((ends[0][0] + ends[1][0]) / 2 + e / 2, (ends[0][1] + ends[1][1]) / 2, text, palette::kSkyBlue);
  }
  if (before_) words(v.x + e, v.y + e / 2, tr("BONE AT THE START (W goes back)"), palette::kYellow);
  draw->PopClipRect();
}

void MainView::draw_caption(const ViewScene& scene) {
  ImDrawList* const draw = ImGui::GetForegroundDrawList();
  const float e = em();
  const ScreenBox& v = layout_.view;
  const double bar_mm = scale_bar_mm(scene.pixels_per_mm, static_cast<double>(v.width) / 4);
  const StateFacts state = state_of_tick(scene.tick, nullptr, scene.control.rehearsal().rate_hz());
  char length[32];
  std::snprintf(length, sizeof length, "%.4g", bar_mm);
  const std::string text =
      filled(tr("case {case}, {tool}, {time}, {mm} mm"), {{"case", scene.machine.case_hash.substr(0, 8)},
                                                          {"tool", state.tool},
                                                          {"time", state.time},
                                                          {"mm", shown_figures(length)}});
  const float bar = static_cast<float>(bar_mm * scene.pixels_per_mm), y = v.bottom() - 2 * e;
  draw->AddRectFilled({v.x, y}, {v.right(), v.bottom()}, im_colour32(theme().ground, 0.85F));
  const float x = v.right() - bar - e;
  draw->AddRectFilled({x, y + e * 0.8F}, {x + bar, y + e * 1.2F}, im_colour32(theme().text));
  fitted_text(draw, {v.x + e / 2, y, v.width - bar - 2.5F * e, 2 * e}, e, theme().text, text);
}

}  // namespace osteo::inline app
