// A gamepad as a hand.
#pragma once
#include <optional>

namespace osteo {

struct PadMotion {
  double right_mm_s = 0, up_mm_s = 0, deeper_mm_s = 0;  ///< as the view shows it
  bool drill = false;
};
/// Left stick across the view, right stick deeper and back, right trigger drills. Nothing without a gamepad; GLFW must be running.
[[nodiscard]] std::optional<PadMotion> read_gamepad();

}  // namespace osteo
