// Lines of points. Private to libs/imaging/segment.
#pragma once
#include <vector>

#include "osteo/core/data/vec.h"

namespace osteo::inline imaging::segment {

/// Points every `step_mm` along the line, and its end.
[[nodiscard]] std::vector<Vec3> evenly(const std::vector<Vec3>& line, double step_mm);

/// The line that minimises the weighted squares of distances to `p` (points every `step_mm`) plus the bending: where
/// weights are 0, a spline bridges. Detail shorter than `along_mm` is smoothed away. Weights are 0 to 1, not all 0.
/// Symmetric, five diagonals, by LDL'.
[[nodiscard]] std::vector<Vec3> smoothed_line(const std::vector<Vec3>& p, const std::vector<double>& weight,
                                              double step_mm, double along_mm);

}  // namespace osteo::inline imaging::segment
