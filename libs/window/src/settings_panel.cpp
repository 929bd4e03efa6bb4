#include "settings_panel.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace osteo {
namespace {

// True when the user has changed it.
bool draw_field(const FieldRef& f) {
  const std::string name(f.doc.name);
  if (auto* const flag = std::get_if<bool*>(&f.target)) return ImGui::Checkbox(name.c_str(), *flag);
  if (auto* const choice = std::get_if<FieldRef::Choice>(&f.target)) {
    std::string all;
    for (const std::string_view n : choice->names) all += std::string(n) + '\0';
    return ImGui::Combo(name.c_str(), choice->index, all.c_str());
  }
  double& value = **std::get_if<double*>(&f.target);
  const auto speed = static_cast<float>(std::max(std::abs(value), 0.05) / 100);
  return ImGui::DragScalar(name.c_str(), ImGuiDataType_Double, &value, speed, &f.doc.lo, &f.doc.hi, "%.4g", ImGuiSliderFlags_AlwaysClamp);
}

}  // namespace

void draw_settings(Rehearsal& rehearsal) {
  if (!ImGui::CollapsingHeader("How it feels")) return;
  HapticsParams params = rehearsal.settings();
  const auto fields = fields_of<HapticsParams>(params);
  ImGui::PushItemWidth(4.5F * ImGui::GetFontSize());
  for (std::size_t n = 0; n < fields.size(); ++n) {
    if (draw_field(fields[n]))
      rehearsal.act(SceneAction::setting(static_cast<std::uint32_t>(n), setting_value(static_cast<int>(n), params)));
    if (ImGui::IsItemHovered())
      ImGui::SetTooltip("%s%s%s", std::string(fields[n].doc.help).c_str(), fields[n].doc.unit.empty() ? "" : ", ",
                        std::string(fields[n].doc.unit).c_str());
  }
  ImGui::PopItemWidth();
}

}  // namespace osteo
