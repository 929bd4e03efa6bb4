// OpenCV's dictionaries and board, as body.h means them. What its versions name differently is here and in aruco.cpp
// alone: from 4.7 on the markers are in objdetect and have classes of their own.
#pragma once
#include <cstdint>
#include <opencv2/core/version.hpp>
#include <vector>
#if CV_VERSION_MAJOR > 4 || CV_VERSION_MINOR >= 7
#include <opencv2/objdetect/aruco_detector.hpp>
#else
#include <opencv2/aruco.hpp>
#endif

#include "osteo/simulation/marker/body.h"
#include "osteo/simulation/marker/detail/picture.h"

namespace osteo::inline simulation::marker {

/// Bits of a marker from edge to edge, without its frame.
int bits_across(MarkerKind kind);
/// A marker with a frame of one cell, `pixels` wide.
cv::Mat drawn_marker(MarkerKind kind, int id, int pixels);

/// A marker on the plate: corners in mm, in OpenCV's order.
struct PlateMarker {
  int id;
  std::vector<cv::Point3f> corners_mm;
};
std::vector<PlateMarker> markers_of_plate();
/// Where the plate's squares meet, by their numbers.
std::vector<cv::Point3f> crossings_of_plate();

using Corners = std::vector<std::vector<cv::Point2f>>;
void find_markers(const cv::Mat& gray, MarkerKind kind, const cv::aruco::DetectorParameters& how, Corners& corners,
                  std::vector<int>& ids);
/// The plate's crossings between the markers that were found; none where none was.
void find_crossings(const cv::Mat& gray, const cv::aruco::DetectorParameters& how, const Corners& corners,
                    const std::vector<int>& ids, std::vector<cv::Point2f>& crossings, std::vector<int>& numbers);

/// Shares the pixels.
inline cv::Mat view_of(const GrayPicture& p) {
  return {p.height, p.width, CV_8UC1, const_cast<std::uint8_t*>(p.pixels.data())};
}

}  // namespace osteo::inline simulation::marker
