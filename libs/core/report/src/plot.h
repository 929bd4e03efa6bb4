// A plot as the drawing it is, the same on a page and on paper. Private to libs/core/report.
#pragma once
#include "layout.h"

namespace osteo::report {

/// As wide as there is room and as high as the plot says, in points; a mark's points are never empty.
[[nodiscard]] sheet::Drawing drawing_of(const sheet::Plot& plot, double width_pt);

}  // namespace osteo::report
