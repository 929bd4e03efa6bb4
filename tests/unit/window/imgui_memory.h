// ImGui without a screen: a context of its own, in the window's look.
#pragma once
#include <imgui.h>

#include <functional>

#include "ui_style.h"

namespace osteo::test {

struct ImGuiMemory {
  ImGuiMemory(int width, int height, int em_pixels) {
    ImGui::CreateContext();
    ImGuiIO& io = ImGui::GetIO();
    io.IniFilename = nullptr;
    io.DisplaySize = {static_cast<float>(width), static_cast<float>(height)};
    io.DeltaTime = 1 / 60.0F;
    set_ui_style(em_pixels);
  }
  ~ImGuiMemory() { ImGui::DestroyContext(); }
  ImGuiMemory(const ImGuiMemory&) = delete;
  ImGuiMemory& operator=(const ImGuiMemory&) = delete;
};

// Of two frames: ImGui knows what a window holds from the one before.
inline void frames(const std::function<void()>& draw, int count = 2) {
  for (int n = 0; n < count; ++n) {
    ImGui::NewFrame();
    draw();
    ImGui::Render();
  }
}

}  // namespace osteo::test
