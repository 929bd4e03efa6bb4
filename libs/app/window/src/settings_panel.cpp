#include "settings_panel.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "osteo/core/base/translate.h"
#include "osteo/simulation/bone/posture.h"
#include "ui_kit.h"

namespace osteo::inline app {
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
  return ImGui::DragScalar(name.c_str(), ImGuiDataType_Double, &value, speed, &f.doc.lo, &f.doc.hi, "%.4g",
                           ImGuiSliderFlags_AlwaysClamp);
}

}  // namespace

void draw_language(std::string& chosen) {
  // Each in its own words, so that who cannot read the window finds theirs.
  static constexpr const char* kOwnNames[] = {"English", "Deutsch", "Español", "Français", "简体中文"};
  constexpr auto kNames = enum_names(Language{});
  const auto* const at = std::find(kNames.begin(), kNames.end(), chosen);
  const bool by_system = at == kNames.end();
  ImGui::TextDisabled("%s", tr("Language"));
  ImGui::SetNextItemWidth(-1);
  if (!ImGui::BeginCombo("##language", by_system ? tr("as the system has it") : kOwnNames[at - kNames.begin()])) return;
  if (ImGui::Selectable(tr("as the system has it"), by_system)) chosen = "auto";
  for (std::size_t n = 0; n < kNames.size(); ++n) {
    if (ImGui::Selectable(kOwnNames[n], chosen == kNames[n])) chosen = kNames[n];
  }
  ImGui::EndCombo();
  use_language(language_named(chosen));
}

void draw_posture(Rehearsal& rehearsal) {
  std::optional<Vec3> down;
  rehearsal.look([&](const World&, SceneReaders& readers) {
    if (readers.dust) down = readers.dust->dust().gravity();
  });
  if (!down || !fold(tr("How the patient lies"))) return;
  PostureNow now = posture_of(*down);
  bool changed = false;
  for (std::size_t n = 0; n < EnumNames<Posture>::values.size(); ++n) {
    if (n % 3 != 0) ImGui::SameLine();
    std::string name(EnumNames<Posture>::values[n]);
    std::replace(name.begin(), name.end(), '_', ' ');
    if (!ImGui::RadioButton(tr(name).c_str(), now.posture == static_cast<Posture>(n))) continue;
    now = {static_cast<Posture>(n), 0};
    changed = true;
  }
  auto turned = static_cast<float>(now.head_turned_deg);
  ImGui::PushItemWidth(5 * ImGui::GetFontSize());
  if (now.posture != Posture::sitting && ImGui::SliderFloat(tr("head turned"), &turned, -90, 90, "%.0f deg"))
    changed = true;
  ImGui::PopItemWidth();
  if (ImGui::IsItemHovered())
    ImGui::SetTooltip(tr("where dust and water fall to; positive: the face towards the patient's left"));
  if (changed) rehearsal.act(SceneAction::posture(down_of(now.posture, static_cast<double>(turned))));
}

void draw_tissue(const Rehearsal& rehearsal) {
  const std::vector<SoftTissue::Facts> bodies = rehearsal.tissue();
  if (bodies.empty() || !fold(tr("Soft tissue"))) return;
  for (const SoftTissue::Facts& body : bodies) {
    // A name is a folder's: nothing in it is a format.
    ImGui::TextUnformatted(body.name.c_str());
    ImGui::SameLine(6 * ImGui::GetFontSize());
    if (body.asleep) {
      ImGui::TextUnformatted(
          filled(tr("{mm3} mm³ cut off, at rest"), {{"mm3", shown_number(body.cut_off_mm3, 1)}}).c_str());
    } else {
      ImGui::TextUnformatted(
          filled(tr("{mm3} mm³ cut off, {share} % of real time"),
                 {{"mm3", shown_number(body.cut_off_mm3, 1)}, {"share", shown_number(100 * body.of_real_time, 0)}})
              .c_str());
    }
  }
}

void draw_settings(Rehearsal& rehearsal) {
  if (!fold(tr("How it feels"))) return;
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

}  // namespace osteo::inline app
