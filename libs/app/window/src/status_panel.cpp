#include "status_panel.h"

#include <imgui.h>

#include "osteo/core/base/translate.h"
#include "ui_kit.h"
#include "ui_style.h"

namespace osteo::inline app {
// The words of the import's verdict.
void draw_scan(const VerdictSummary& scan) {
  if (scan.status.empty()) return;
  const std::string words =
      filled(tr_n("Scan: {status} ({n} note)", "Scan: {status} ({n} notes)", static_cast<double>(scan.findings.size())),
             {{"status", tr(scan.status)}, {"n", std::to_string(scan.findings.size())}});
  if (!fold((words + "###scan").c_str())) return;
  for (const Finding& f : scan.findings) {
    const ImVec4 colour = f.severity == Severity::info ? im_colour(theme().quiet) : im_colour(ink_of(palette::kYellow));
    ImGui::PushStyleColor(ImGuiCol_Text, colour);
    ImGui::TextWrapped("%s [%s]", f.message.c_str(), f.code.c_str());
    ImGui::PopStyleColor();
    if (!f.advice.empty()) ImGui::TextWrapped("%s", f.advice.c_str());
  }
  ImGui::Separator();
}

void draw_approval(const std::string& words, bool ended) {
  if (words.empty()) return;
  ImGui::PushStyleColor(ImGuiCol_Text, ended ? im_colour(ink_of(palette::kYellow)) : im_colour(theme().quiet));
  ImGui::TextWrapped("%s", filled(tr("Case: {approval}"), {{"approval", words}}).c_str());
  ImGui::PopStyleColor();
}

}  // namespace osteo::inline app
