// A gamepad as a hand, and buttons of pads and other joysticks. GLFW must be running.
#pragma once
#include <optional>
#include <vector>

#include "button_watch.h"

namespace osteo::inline app {

struct PadMotion {
  double right_mm_s = 0, up_mm_s = 0, deeper_mm_s = 0;  ///< as the view shows it
};
/// Left stick across the view, right stick deeper and back. Nothing without a gamepad.
[[nodiscard]] std::optional<PadMotion> read_gamepad();
/// Buttons and triggers of the gamepad; buttons and axes of the first other joystick, such as a pedal that acts as one.
void read_stick_buttons(std::vector<ButtonLevel>& levels);

}  // namespace osteo::inline app
