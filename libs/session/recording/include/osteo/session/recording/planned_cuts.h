// Saw cuts that were planned before the session: planes with names, for a script, the window and cutting guides.
#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/simulation/bone/saw.h"

namespace osteo::inline session {

struct PlannedCut {
  std::string name;
  SawCut cut;            ///< normal and along as the file has them
  double within_mm = 2;  ///< as a cutting guide: a saw this near slips in
  /// Of a printed guide, where it lies: it may be off the plan. As the file has it; not on(): the guide is the plane.
  CuttingGuide slot{};

  /// Normal unit, the slot's height in its plane.
  [[nodiscard]] CuttingGuide guide() const;
};

/// The file in a case's folder.
inline constexpr std::string_view kPlannedCutsFile = "planned-cuts.json";

/// { "osteotome_planned_cuts": 1, "about": "...",
///   "cuts": [ {"name": "left body", "at_mm": [x, y, z], "normal": [1, 0, 0], "along": [0, 0, 1], "kerf_mm": 1,
///   "length_mm": 0,
///              "depth_mm": 0, "within_mm": 2,
///              "slot": {"play_mm": 0.1, "at_mm": [x, y, z], "normal": [1, 0, 0], "up_mm": [0, 0, 8],
///              "length_mm": 20}} ] }
/// LPS mm of the case at rest; a name, a place and a normal are needed, 0 of length and depth: through; a slot that is
/// left out is the plane without play. Errors: usage,
/// with file and line: unknown keys, ranges, directions without length, two of one name, none; no_input.
[[nodiscard]] std::vector<PlannedCut> load_planned_cuts(const std::filesystem::path& file);
/// Of a case; none where it has no such file.
[[nodiscard]] std::vector<PlannedCut> planned_cuts_of(const std::filesystem::path& case_folder);
/// What load_planned_cuts reads as the same, to the last bit.
[[nodiscard]] std::string planned_cuts_json(std::span<const PlannedCut> cuts);
/// The one of that name. Error(usage) with the names there are.
[[nodiscard]] const PlannedCut& planned_cut(std::span<const PlannedCut> cuts, std::string_view name);

}  // namespace osteo::inline session
