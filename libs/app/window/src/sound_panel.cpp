#include "sound_panel.h"

#include <imgui.h>

namespace osteo::inline app {

void draw_sound(SoundOut& sound) {
  bool on = sound.on(), alarms = sound.alarms();
  if (ImGui::Checkbox("sound (N)", &on)) sound.turn(on);
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", sound.status().c_str());
  ImGui::SameLine();
  if (ImGui::Checkbox("alarms", &alarms)) sound.set_alarms(alarms);
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("a beep on contact with a critical structure");
  auto volume = static_cast<float>(sound.volume());
  ImGui::PushItemWidth(-4.5F * ImGui::GetFontSize());
  if (ImGui::SliderFloat("volume", &volume, 0, 1, "%.2f")) sound.set_volume(static_cast<double>(volume));
  ImGui::PopItemWidth();
}

}  // namespace osteo::inline app
