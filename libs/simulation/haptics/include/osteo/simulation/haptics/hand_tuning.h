// How a device's hand works on its tool, as the person wants it now.
#pragma once
#include <cstdint>

namespace osteo::inline simulation {

/// For a device that moves by itself; what it says goes into the stream as the device's samples, so a replay knows
/// nothing of this.
struct HandTuning {
  double scale = 1;                   ///< mm of the tool for a mm of the hand; 0 < scale <= 1
  bool clutch = false;                ///< the hand moves without its tool
  std::uint8_t pedal = 0;             ///< what keys and buttons of the window press, 0 to 255
  std::uint8_t full = 255;            ///< what a switch of its own presses: the burr's speed
  std::uint32_t drill_buttons = 1;    ///< of the device: which of them press
  std::uint32_t drill_switches = 1;   ///< of the foot pedal beside it
  std::uint32_t clutch_switches = 2;  ///< and which of them are the clutch
};

}  // namespace osteo::inline simulation
