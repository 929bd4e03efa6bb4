// A marker's corners from the lines of its edges. Private to libs/simulation/marker.
#pragma once
#include <array>
#include <opencv2/core.hpp>

namespace osteo::inline simulation::marker {

using Quad = std::array<std::array<double, 2>, 4>;

/// Moves the corners of a black square (clockwise from the top left) to where the straight lines through its edges
/// meet: along each edge, profiles across it from dark to light, the middle of the gradient in each, a line through
/// those. False where too little of an edge is seen, or it lies farther away than half a cell: then `quad` is as it
/// was. `cells`: across the square.
bool refine_corners(const cv::Mat& gray, Quad& quad, int cells);

}  // namespace osteo::inline simulation::marker
