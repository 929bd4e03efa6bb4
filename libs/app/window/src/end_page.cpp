// The page at the end of a session: what was done, what was found, what comes next.
#include <imgui.h>

#include <cmath>
#include <vector>

#include "main_view.h"
#include "osteo/core/base/translate.h"
#include "status_panel.h"
#include "ui_kit.h"
#include "ui_style.h"

namespace osteo::inline app {

namespace {

void draw_figures(const std::vector<EndLine>& lines) {
  if (!ImGui::BeginTable("done", 2)) return;
  const float u = unit();
  ImGui::TableSetupColumn("what", ImGuiTableColumnFlags_WidthStretch, 0.45F);
  ImGui::TableSetupColumn("value", ImGuiTableColumnFlags_WidthStretch, 0.55F);
  for (const EndLine& line : lines) {
    ImGui::TableNextRow();
    ImGui::TableSetColumnIndex(0);
    ImGui::TextWrapped("%s", line.what.c_str());
    ImGui::TableSetColumnIndex(1);
    if (line.nearness != Nearness::unknown) {
      const NearnessLook& look = look_of(line.nearness);
      const ImVec2 at = ImGui::GetCursorScreenPos();
      draw_sign(ImGui::GetWindowDrawList(), {at.x + 8 * u, at.y + ImGui::GetFontSize() / 2}, 7 * u, look.corners,
                look.colour);
      ImGui::SetCursorPosX(ImGui::GetCursorPosX() + 20 * u);
    }
    ImGui::TextWrapped("%s", line.value.c_str());
  }
  ImGui::EndTable();
}

}  // namespace

EndChoice MainView::end_choice(Command command) {
  switch (command) {
    case Command::reset:
      return EndChoice::again;
    case Command::save:
      return EndChoice::resume;
    case Command::home:
      return EndChoice::another;
    case Command::quit:
      return EndChoice::close;
    default:
      return EndChoice::none;
  }
}

EndChoice MainView::draw_end(const EndFacts& facts, const EndParts& parts) {
  ImGuiIO& io = ImGui::GetIO();
  io.ConfigFlags |= ImGuiConfigFlags_NavEnableKeyboard;
  begin_fixed("end", layout_.page);
  const float u = unit();
  const ImVec2 corner = ImGui::GetCursorScreenPos();
  const float wide = ImGui::GetContentRegionAvail().x;
  fitted_text(ImGui::GetWindowDrawList(), {corner.x, corner.y, wide, 32 * u}, kBoldEm * em(), theme().text,
              facts.past ? tr("A session, looked at again") : tr("Session saved"), false, true);
  ImGui::Dummy({0, 32 * u});
  ImGui::PushStyleColor(ImGuiCol_Text, im_colour(theme().quiet));
  ImGui::TextWrapped("%s", facts.summary.c_str());
  ImGui::PopStyleColor();
  for (const std::string& w : facts.warnings) {
    ImGui::PushStyleColor(ImGuiCol_Text, im_colour(ink_of(palette::kYellow)));
    ImGui::TextWrapped("! %s", w.c_str());
    ImGui::PopStyleColor();
  }
  parts.findings();
  ImGui::Dummy({0, 4 * u});
  ImGui::TextDisabled("%s", tr("Next"));
  EndChoice choice = EndChoice::none;
  const float half = std::floor((wide - ImGui::GetStyle().ItemSpacing.x) / 2);
  const auto button = [&](const char* words, EndChoice of, ButtonLook look, float width) {
    if (kit_button(words, look, width)) choice = of;
  };
  // What was found serious is tried again on a whole bone; else one goes on.
  if (facts.past) {
    button(tr("Another case (Home)"), EndChoice::another, ButtonLook::main, wide);
    button(tr("Close (Q)"), EndChoice::close, ButtonLook::usual, half);
  } else {
    const bool again = parts.try_again;
    button(again ? tr("Try it again: bone reset (R)") : tr("Continue from here (F5)"),
           again ? EndChoice::again : EndChoice::resume, ButtonLook::main, wide);
    button(again ? tr("Continue (F5)") : tr("Reset bone (R)"), again ? EndChoice::resume : EndChoice::again,
           ButtonLook::usual, half);
    ImGui::SameLine();
    button(tr("Another case (Home)"), EndChoice::another, ButtonLook::usual, half);
    button(tr("Close (Q)"), EndChoice::close, ButtonLook::usual, half);
  }
  parts.course();
  if (fold(tr("All figures"))) draw_figures(facts.lines);
  if (fold(tr("All findings"))) parts.all_findings();
  if (fold(tr("Files"))) {
    ImGui::TextWrapped("%s", facts.folder.string().c_str());
    ImGui::TextWrapped("%s", tr("summary.json has the numbers, stream.oss every tick: osteo replay SESSION"));
  }
  ImGui::End();
  return choice;
}

}  // namespace osteo::inline app
