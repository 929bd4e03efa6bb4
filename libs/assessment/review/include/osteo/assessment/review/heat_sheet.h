// What a session's heat did, on paper: sections through the bone that is left, and structures over time.
#pragma once
#include <string>

#include "osteo/core/report/sheet.h"
#include "osteo/session/scene/heat_reader.h"

namespace osteo::inline assessment::review {

/// A section through the bone as it is at the end, coloured by the highest temperature that each place has had: from 42
/// C on amber, from 57 C on red, with lines at 42, 47 and 57 C; outlines of structures. `right` and `down` are unit
/// vectors of the picture's axes. Cost: 8 look-ups of warm cells and one of all structures a pixel.
[[nodiscard]] Picture heat_section(const HeatReader& heat, const StructureMap* structures, Vec3 centre_mm, Vec3 right,
                                   Vec3 down, double side_mm, int pixels);

/// Of a reader that kept its history (HeatReader::keep_history); `structures` null: none. `code` names the session.
[[nodiscard]] Sheet heat_sheet(const HeatReader& heat, const StructureMap* structures, const HeatOfCutting& by,
                               const std::string& code);

}  // namespace osteo::inline assessment::review
