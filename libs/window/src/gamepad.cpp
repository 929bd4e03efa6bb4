#include "gamepad.h"

#include <GLFW/glfw3.h>

#include <cmath>

namespace osteo {

std::optional<PadMotion> read_gamepad() {
  GLFWgamepadstate pad;
  if (glfwGetGamepadState(GLFW_JOYSTICK_1, &pad) == GLFW_FALSE) return std::nullopt;
  constexpr double kMmPerS = 40, kDeadZone = 0.12;
  // Finer near the middle.
  const auto speed = [&](int axis) {
    const double v = static_cast<double>(pad.axes[axis]);
    return std::abs(v) < kDeadZone ? 0.0 : kMmPerS * v * std::abs(v);
  };
  return PadMotion{speed(GLFW_GAMEPAD_AXIS_LEFT_X), -speed(GLFW_GAMEPAD_AXIS_LEFT_Y), -speed(GLFW_GAMEPAD_AXIS_RIGHT_Y),
                   pad.axes[GLFW_GAMEPAD_AXIS_RIGHT_TRIGGER] > 0};
}

}  // namespace osteo
