// Scripts of strokes as JSON files.
#pragma once
#include <filesystem>
#include <span>
#include <string>

#include "osteo/session/recording/planned_cuts.h"
#include "osteo/session/recording/script.h"

namespace osteo::inline session {

/// { "osteotome_strokes": 1, "burr": {"kind": "cutting", "diameter_mm": 4}, "axis": [1, 0, 0],
///   "waypoints": [ {"t_s": 0, "at_mm": [80, 24, -26], "drill": true, "pedal": 0.5}, ... ],
///   "hands": [ {"instrument": "sucker 8 Fr", "axis": [0, 1, 0], "waypoints": [...]}, ... ],
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
