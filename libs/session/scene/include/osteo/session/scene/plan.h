// What was planned, for other programs: pieces and plates where they are.
#pragma once
#include <filesystem>
#include <string>

#include "osteo/core/base/context.h"
#include "osteo/simulation/bone/world.h"

namespace osteo::inline session {

/// Writes into an empty or new folder: plan.json (each piece's volume, centre, inertia and transform as a 4 x 4 matrix
/// in rows; each plate's pieces, transform, opening, screw places and gaps to bone), piece-N.stl and plate-N.stl where
/// they are now, plate-N-gap.csv (points of the underside and how far below them bone begins). LPS mm. Returns the text
/// of plan.json. Error(cannot_write).
std::string write_plan(const World& world, const std::filesystem::path& folder, const Context& context);

}  // namespace osteo::inline session
