#include "help_panel.h"

#include <imgui.h>

namespace osteo {

void draw_help(bool& open, int width) {
  ImGui::SetNextWindowPos({static_cast<float>(width) / 2 - 240, 60}, ImGuiCond_Appearing);
  ImGui::SetNextWindowSize({500, 0});
  ImGui::Begin("Mouse and keys", &open, ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse);
  static constexpr const char* kRows[][2] = {{"move", "moves the drill across the view"},
                                             {"F", "brings the drill to the bone under the mouse"},
                                             {"wheel, Up, Down, Shift-drag", "moves it deeper or back"},
                                             {"left button, Space", "drills while held; Space: on and off"},
                                             {"right drag", "turns the view"},
                                             {"middle drag", "shifts the view"},
                                             {"Ctrl-wheel", "nearer and farther"},
                                             {"1 to 7, C, D", "burr: diameter, cutting, diamond"},
                                             {"B, Y, T", "ball, cylinder, taper"},
                                             {"V, I", "sucks dust off at the burr; washes it away"},
                                             {"X", "saw: drag moves the plane, Shift-drag turns it, wheel: deeper"},
                                             {"P", "pieces: drag moves one, Shift-drag turns it, wheel: deeper"},
                                             {"L", "plate in the hand, moved like the drill"},
                                             {"A, E", "turn the saw, the piece or the plate"},
                                             {"Enter", "cut; take apart; fix the plate"},
                                             {"Z", "takes back the last cut, move, plate"},
                                             {"Esc", "back to the drill"},
                                             {"S", "screenshot into the session's folder"},
                                             {"F5", "save the session and go on"},
                                             {"R", "save the session, the bone is whole again"},
                                             {"Home", "view from the left"},
                                             {"Q", "save and close"}};
  for (const auto& row : kRows) {
    ImGui::Text("%s", row[0]);
    ImGui::SameLine(215);
    ImGui::TextWrapped("%s", row[1]);
  }
  ImGui::End();
}

}  // namespace osteo
