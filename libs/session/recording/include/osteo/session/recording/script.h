// A script: what hands do, and what is done besides, by the servo's clock.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "osteo/session/recording/planned_cuts.h"
#include "osteo/simulation/bone/action.h"
#include "osteo/simulation/haptics/device.h"

namespace osteo::inline session {

/// The strokes of hand 0, and what else a session needs.
struct Script : Strokes {
  std::vector<Strokes> more_hands;  ///< hands 1, 2, ...: at most kMaxHands - 1
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

// -- Scripts of strokes as JSON files.

/// { "osteotome_strokes": 1, "burr": {"kind": "cutting", "diameter_mm": 4}, "axis": [1, 0, 0],
///   "waypoints": [ {"t_s": 0, "at_mm": [80, 24, -26], "drill": true, "pedal": 0.5}, ... ],
///   "hands": [ {"instrument": "suction tube 8 Fr", "axis": [0, 1, 0], "waypoints": [...]}, ... ],
///   "actions": [ {"t_s": 3, "saw": {"at_mm": [0, 0, 0], "normal": [1, 0, 0]}}, {"t_s": 4, "split": {}}, ... ] }
/// Points are LPS mm, the axis points from the tip to the handle. "hands" are those besides the one with the burr. Read
/// strictly: keys, kinds, ranges and what belongs together. "saw" and "cutting_guide" may name one of `planned` (those
/// of the case): {"planned": "left body"}. Errors: usage, with file and line.
[[nodiscard]] Script load_script(const std::filesystem::path& path, std::span<const PlannedCut> planned = {});
/// JSON schema of the format, made from the declarations that load_script goes by.
[[nodiscard]] std::string script_schema();
/// Of hand 0, without its actions.
[[nodiscard]] std::string script_json(const Script& script);

}  // namespace osteo::inline session
