// OpenCV's dictionaries and board, as body.h means them.
#pragma once
#include <opencv2/aruco.hpp>
#include <opencv2/aruco/charuco.hpp>

#include "osteo/simulation/marker/body.h"
#include "osteo/simulation/marker/detail/picture.h"

namespace osteo::inline simulation::marker {

const cv::Ptr<cv::aruco::Dictionary>& dictionary_of(MarkerKind kind);
const cv::Ptr<cv::aruco::CharucoBoard>& plate_board();
/// Shares the pixels.
inline cv::Mat view_of(const GrayPicture& p) {
  return {p.height, p.width, CV_8UC1, const_cast<std::uint8_t*>(p.pixels.data())};
}

}  // namespace osteo::inline simulation::marker
