#include "help_panel.h"

#include <imgui.h>

#include "keys.h"

namespace osteo {

void draw_help(bool& open, int width) {
  ImGui::SetNextWindowPos({static_cast<float>(width) / 2 - 240, 60}, ImGuiCond_Appearing);
  ImGui::SetNextWindowSize({500, 0});
  ImGui::Begin("Mouse and keys", &open, ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse);
  for (const HelpLine& line : help_lines()) {
    ImGui::Text("%s", line.keys);
    ImGui::SameLine(215);
    ImGui::TextWrapped("%s", line.text);
  }
  ImGui::End();
}

}  // namespace osteo
