// What the editor shows, for programs that test it. Private to libs/app/window.
#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>

#include "edit_control.h"

namespace osteo::inline app {

struct EditViewBox {
  int x = 0, y = 0, width = 0, height = 0;  ///< in the window, from its upper left corner; no width: not shown
  [[nodiscard]] bool holds(double px, double py) const {
    return px >= x && py >= y && px < x + width && py < y + height;
  }
};

struct EditWindowState {
  std::uint64_t pictures = 0;
  int width = 0, height = 0;
  std::array<EditViewBox, 4> boxes;
  bool saving = false, asking = false;
  double worst_ms =
      0;  ///< longest that the window took over one picture since it opened, waiting for the screen left out
  std::size_t triangles = 0;
  std::array<float, 4> threshold_slider{}, first_place{}, find_button{};  ///< x, y, width, height
};

/// As JSON, in place of what was there; a reader sees the one or the other. What cannot be written is left out.
void write_edit_state(const EditWindowState& state, const EditControl& control, const std::filesystem::path& file);

}  // namespace osteo::inline app
