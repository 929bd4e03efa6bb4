// Sums along parallel lines through a square picture, and back: what a scanner measures, for one slice.
#pragma once
#include <opencv2/core.hpp>

namespace osteo::inline imaging::image {

inline constexpr int kAngles = 360;  // over half a turn

/// Row a: the picture (square, CV_32F) turned by a * 180/kAngles degrees and summed along its columns, in pixels. As
/// wide as the diagonal.
[[nodiscard]] cv::Mat project(const cv::Mat& picture);
/// Filtered back-projection (Ram-Lak) of such rows onto a square of `pixels`. Linear in the rows.
[[nodiscard]] cv::Mat project_back(const cv::Mat& rows, int pixels);

}  // namespace osteo::inline imaging::image
