// Scripts of strokes as JSON files.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "osteo/haptics/device.h"

namespace osteo {

/// { "osteotome_strokes": 1, "burr": {"kind": "cutting", "diameter_mm": 4}, "axis": [1, 0, 0],
///   "waypoints": [ {"t_s": 0, "at_mm": [80, 24, -26], "drill": true}, ... ],
///   "actions": [ {"t_s": 3, "saw": {"at_mm": [0, 0, 0], "normal": [1, 0, 0]}}, {"t_s": 4, "split": {}}, ... ] }
/// Points are LPS mm, the axis points from the burr to the handle. Read strictly: keys, kinds, ranges and what belongs together. Errors:
/// usage, with file and line.
[[nodiscard]] Script load_script(const std::filesystem::path& path);
/// JSON schema of the format, made from the declarations that load_script goes by.
[[nodiscard]] std::string script_schema();
/// Without its actions.
[[nodiscard]] std::string script_json(const Script& script);
/// The actions of a script at their ticks, in order.
[[nodiscard]] std::vector<SceneAction> actions_of(const Script& script, double rate_hz);

}  // namespace osteo
