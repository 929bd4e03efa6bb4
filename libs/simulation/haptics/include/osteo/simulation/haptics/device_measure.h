// What a device's loop really does, before a hand is rendered to: the answer of its encoder to pulses of a tick.
#pragma once
#include <functional>
#include <string>

#include "osteo/simulation/haptics/device.h"

namespace osteo::inline simulation {

struct MeasuredDevice {
  /// What to go by: delay as measured; damping as told, or less where the pulses surely contradict; the larger of the
  /// encoder steps. Where no delay could be measured: all as told, and kUnmeasuredDelayS more of delay.
  DeviceTraits traits;
  bool delay_measured = false;
  double delay_error_s = 0;  ///< standard error of the delay
  std::string reported;      ///< one line for people: what was measured, what was told, or why nothing could be
};

/// Added to a told delay that could not be confirmed: a frame of USB each way is easily overlooked.
inline constexpr double kUnmeasuredDelayS = 1e-3;

/// Sends pulses of one tick along x, y and z, to and fro, each as strong as it takes to be seen (0.5 to 4 N, no more
/// than half of what the device can), and fits the motion of a mass with damping to the tip's way around each: when it
/// begins tells the delay, how far it goes the damping; the smallest step between positions is the encoder's. Takes at
/// most 1.4 s of ticks and moves a free arm by the pulse over its damping: 0.5 mm at 0.5 N for 1 ms and 1 N s/m. Not
/// measured: where the tip does not move or trembles (held by a firm hand), is silent, or where the pulses do not agree
/// to 0.15 ms. Delays of up to 12 ms. `tick` waits for the next tick of `dt_s`; before the servo has the device. May
/// allocate, 30 ms of computing.
[[nodiscard]] MeasuredDevice measure_device(Device& device, double dt_s, const std::function<void()>& tick);

}  // namespace osteo::inline simulation
