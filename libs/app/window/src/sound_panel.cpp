#include "sound_panel.h"

#include <imgui.h>

#include "osteo/core/base/translate.h"

namespace osteo::inline app {

void draw_sound(SoundOut& sound) {
  bool on = sound.on(), alarms = sound.alarms();
  if (ImGui::Checkbox(tr("sound (N)"), &on)) sound.turn(on);
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", sound.status().c_str());
  ImGui::SameLine();
  if (ImGui::Checkbox(tr("alarms"), &alarms)) sound.set_alarms(alarms);
  if (ImGui::IsItemHovered()) ImGui::SetTooltip(tr("a beep on contact with a critical structure"));
  auto volume = static_cast<float>(sound.volume());
  ImGui::PushItemWidth(-4.5F * ImGui::GetFontSize());
  if (ImGui::SliderFloat(tr("volume"), &volume, 0, 1, "%.2f")) sound.set_volume(static_cast<double>(volume));
  ImGui::PopItemWidth();
}

}  // namespace osteo::inline app
