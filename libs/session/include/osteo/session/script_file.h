// Scripts of strokes as JSON files.
#pragma once
#include <filesystem>
#include <string>

#include "osteo/haptics/device.h"

namespace osteo {

/// { "osteotome_strokes": 1, "burr": {"kind": "cutting", "diameter_mm": 4}, "axis": [1, 0, 0],
///   "waypoints": [ {"t_s": 0, "at_mm": [80, 24, -26], "drill": true}, ... ] }
/// Points are LPS mm, the axis points from the burr to the handle. Errors: usage, with the place in the file.
[[nodiscard]] Script load_script(const std::filesystem::path& path);
[[nodiscard]] std::string script_json(const Script& script);

}  // namespace osteo
