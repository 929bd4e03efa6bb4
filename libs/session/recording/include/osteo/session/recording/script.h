// A script: what hands do, and what is done besides, by the clock of the servo.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "osteo/simulation/bone/action.h"
#include "osteo/simulation/haptics/device.h"

namespace osteo::inline session {

/// The strokes of hand 0, and what else a session needs.
struct Script : Strokes {
  std::vector<Strokes> more_hands;  ///< hands 1, 2, ...: at most kMostHands - 1
  struct TimedAction {
    double t_s = 0;
    SceneAction action;
    [[nodiscard]] std::uint64_t tick(double rate_hz) const {
      return static_cast<std::uint64_t>(std::llround(std::max(0.0, t_s) * rate_hz));
    }
  };
  std::vector<TimedAction> actions;  ///< what else is done, times rising
  struct Camera {
    Vec3 centre_mm;
    double radius_mm = 32;
    Vec3 eye{1, 0, 0};  ///< from the centre towards who looks
  };
  std::optional<Camera> camera;  ///< for its pictures; absent: from where the drill comes, around its strokes
  /// Until the last waypoint of any hand, or the last action where that is later.
  [[nodiscard]] double seconds() const;
};

/// The actions of a script at their ticks, in order.
[[nodiscard]] std::vector<SceneAction> actions_of(const Script& script, double rate_hz);
/// A device for each hand, in their order; the first is active until the tick of the last action has been.
[[nodiscard]] std::vector<std::unique_ptr<Device>> devices_of(const Script& script, double rate_hz);

}  // namespace osteo::inline session
