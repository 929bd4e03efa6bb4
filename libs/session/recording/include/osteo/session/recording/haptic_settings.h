// How a rehearsal feels, as a JSON file.
#pragma once
#include <filesystem>
#include <string>

#include "osteo/simulation/haptics/renderer.h"

namespace osteo::inline session {

/// { "osteotome_haptics": 1, "method": "proxy", "stiffness_n_per_mm": 2, ..., "hardness": "auto",
///   "curve_file": "incision.csv", "curve_stiffness_n_per_mm": 0.5, "vibration_file": "measured.json", "texture_file":
///   "surface.json" }
/// "tools": { "diamond": "proxy", "cutting taper": "volume" } chooses the method of contact by tool: of the instruments
/// whose names hold all words. "hardness": true, false or "auto"; "hardness_file": constants of the law
/// (parse_hardness). Any field of HapticsParams under its name; what is not named keeps its value in `setup`. Files are
/// found beside this one. Errors: usage, with file, line and key; no_input.
void load_haptic_settings(const std::filesystem::path& path, HapticSetup& setup);

/// All fields at their values, with what they mean, as `osteo rehearse --show-settings` prints it.
[[nodiscard]] std::string haptic_settings_json(const HapticSetup& setup);

}  // namespace osteo::inline session
