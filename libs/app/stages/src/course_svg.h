// The course of a calibration as a drawing.
#pragma once
#include <string>

#include "osteo/simulation/tissue/calibrate.h"

namespace osteo::inline app::tissue {

/// SVG: on the left the cost after each accepted step (logarithmic), on the right the factors; a map's points grey, the
/// classes in colours with their uncertainty at the end.
std::string course_svg(const Calibration& calibration, const std::string& title);

}  // namespace osteo::inline app::tissue
