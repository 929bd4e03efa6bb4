#include "status_panel.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace osteo {
namespace {

constexpr double kDisplayForceN = 4;  // full length of the force bar
constexpr double kWarnMm = 2, kAlarmMm = 0.5;
const ImVec4 kAmber(1.0F, 0.8F, 0.35F, 1), kRed(1.0F, 0.45F, 0.35F, 1);

}  // namespace

void draw_status(const Rehearsal& rehearsal, const TickRecord& tick) {
  const double force = length(from_floats(tick.force_n));
  char text[64];
  std::snprintf(text, sizeof text, "%.2f N", force);
  ImGui::Text("Force");
  const float share = static_cast<float>(std::min(1.0, force / kDisplayForceN));
  ImGui::PushStyleColor(ImGuiCol_PlotHistogram, ImVec4(0.3F + 0.65F * share, 0.75F - 0.5F * share, 0.25F, 1));
  ImGui::ProgressBar(share, {-1, 22}, text);
  ImGui::PopStyleColor();
  ImGui::Text("Depth of burr in bone  %.2f mm", static_cast<double>(tick.depth_mm));
  if (tick.thickness_mm > 0)
    ImGui::Text("Bone under the burr  %s%.1f mm", tick.thickness_mm >= 10 ? "over " : "", static_cast<double>(tick.thickness_mm));
  if (const StructureMap* const structures = rehearsal.structures()) {
    const auto clearance = static_cast<double>(tick.clearance_mm);
    if (tick.structure == 0) {
      ImGui::Text("No structure within %.0f mm", structures->reach_mm());
    } else {
      const ImVec4 colour = clearance < kAlarmMm ? kRed : clearance < kWarnMm ? kAmber : ImGui::GetStyleColorVec4(ImGuiCol_Text);
      const std::string name = structures->name_of(static_cast<std::uint8_t>(tick.structure));
      if (clearance <= 0) {
        ImGui::TextColored(colour, "%s: TOUCHED", name.c_str());
      } else {
        ImGui::TextColored(colour, "%s: %.1f mm away", name.c_str(), clearance);
      }
    }
  }
  const Instrument& held = instrument_of(tick.device.tool);
  const Burr* const burr = held.as_burr();
  if (const std::string small = burr != nullptr ? too_small_for_voxels(*burr, rehearsal.finest_voxel_mm()) : std::string();
      !small.empty()) {
    ImGui::PushStyleColor(ImGuiCol_Text, kAmber);
    ImGui::TextWrapped("%s", small.c_str());
    ImGui::PopStyleColor();
  }
  if ((tick.flags & kNoRoom) != 0) ImGui::TextColored(kAmber, "no room: bone is left at the burr's rim");
  if ((tick.flags & kShaftContact) != 0) ImGui::TextColored(kAmber, "the shaft touches bone");
  if ((tick.flags & kEscape) != 0) ImGui::TextColored(kRed, "the burr is buried in bone");
  if (rehearsal.pieces() > 1) ImGui::Text("The bone is in %d pieces", rehearsal.pieces());
  ImGui::Text("Removed  %.1f mm3", rehearsal.removed_mm3());
  if (rehearsal.soft() != nullptr) ImGui::Text("Tissue cut off  %.1f mm3", rehearsal.tissue_mm3());
  if (const std::string trouble = rehearsal.trouble(); !trouble.empty()) {
    ImGui::PushStyleColor(ImGuiCol_Text, rehearsal.recording().failure ? kRed : kAmber);
    ImGui::TextWrapped("%s", trouble.c_str());
    ImGui::PopStyleColor();
  }
  const double seconds = static_cast<double>(tick.tick) / rehearsal.rate_hz();
  ImGui::Text("Time  %d:%04.1f", static_cast<int>(seconds) / 60, std::fmod(seconds, 60.0));
}

// The words of the import's verdict.
void draw_scan(const VerdictSummary& scan) {
  if (scan.status.empty()) return;
  const bool open = ImGui::TreeNode("scan", "Scan: %s (%d notes)", scan.status.c_str(), static_cast<int>(scan.findings.size()));
  if (!open) return;
  for (const Finding& f : scan.findings) {
    const ImVec4 colour = f.severity == Severity::info ? ImVec4(0.75F, 0.8F, 0.85F, 1) : ImVec4(1.0F, 0.8F, 0.35F, 1);
    ImGui::PushStyleColor(ImGuiCol_Text, colour);
    ImGui::TextWrapped("%s [%s]", f.message.c_str(), f.code.c_str());
    ImGui::PopStyleColor();
    if (!f.advice.empty()) ImGui::TextWrapped("%s", f.advice.c_str());
  }
  ImGui::TreePop();
  ImGui::Separator();
}

void draw_approval(const std::string& words, bool ended) {
  if (words.empty()) return;
  ImGui::PushStyleColor(ImGuiCol_Text, ended ? ImVec4(1.0F, 0.8F, 0.35F, 1) : ImVec4(0.75F, 0.8F, 0.85F, 1));
  ImGui::TextWrapped("Case: %s", words.c_str());
  ImGui::PopStyleColor();
}

}  // namespace osteo
