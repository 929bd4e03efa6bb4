#include "gamepad.h"

// It draws nothing: what needs GLEW before GL may follow in the same unit.
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <cmath>

namespace osteo::inline app {

std::optional<PadMotion> read_gamepad() {
  GLFWgamepadstate pad;
  if (glfwGetGamepadState(GLFW_JOYSTICK_1, &pad) == GLFW_FALSE) return std::nullopt;
  constexpr double kMmPerS = 40, kDeadZone = 0.12;
  // Finer near the middle.
  const auto speed = [&](int axis) {
    const double v = static_cast<double>(pad.axes[axis]);
    return std::abs(v) < kDeadZone ? 0.0 : kMmPerS * v * std::abs(v);
  };
  return PadMotion{speed(GLFW_GAMEPAD_AXIS_LEFT_X), -speed(GLFW_GAMEPAD_AXIS_LEFT_Y),
                   -speed(GLFW_GAMEPAD_AXIS_RIGHT_Y)};
}

void read_stick_buttons(std::vector<ButtonLevel>& levels) {
  const auto share = [](float axis) { return (static_cast<double>(axis) + 1) / 2; };
  GLFWgamepadstate pad;
  if (glfwGetGamepadState(GLFW_JOYSTICK_1, &pad) != GLFW_FALSE) {
    for (int n = 0; n <= GLFW_GAMEPAD_BUTTON_LAST; ++n)
      levels.push_back({button::kPad + n, pad.buttons[n] == GLFW_PRESS ? 1.0 : 0.0});
    levels.push_back({button::kPadRightTrigger - 1, share(pad.axes[GLFW_GAMEPAD_AXIS_LEFT_TRIGGER])});
    levels.push_back({button::kPadRightTrigger, share(pad.axes[GLFW_GAMEPAD_AXIS_RIGHT_TRIGGER])});
  }
  for (int stick = GLFW_JOYSTICK_1; stick <= GLFW_JOYSTICK_LAST; ++stick) {
    if (glfwJoystickPresent(stick) == GLFW_FALSE || glfwJoystickIsGamepad(stick) != GLFW_FALSE) continue;
    int buttons = 0, axes = 0;
    const unsigned char* const down = glfwGetJoystickButtons(stick, &buttons);
    const float* const at = glfwGetJoystickAxes(stick, &axes);
    for (int n = 0; n < buttons && n < 32; ++n)
      levels.push_back({button::kStick + n, down[n] == GLFW_PRESS ? 1.0 : 0.0});
    for (int n = 0; n < axes && n < 16; ++n) levels.push_back({button::kAxis + n, share(at[n])});
    return;
  }
}

}  // namespace osteo::inline app
