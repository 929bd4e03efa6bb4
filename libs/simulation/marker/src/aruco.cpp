#include "aruco.h"

#if CV_VERSION_MAJOR > 4 || CV_VERSION_MINOR >= 7
#define OSTEO_ARUCO_CLASSES 1
#include <opencv2/objdetect/charuco_detector.hpp>
#else
#define OSTEO_ARUCO_CLASSES 0
#include <opencv2/aruco/charuco.hpp>
#endif

namespace osteo::inline simulation::marker {
namespace {

auto dictionary_of(MarkerKind kind) {
  // Few bits: large cells. Of the first, three pens take 39.
  static const auto pen = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_50);
  static const auto plate = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_5X5_50);
  return kind == MarkerKind::pen ? pen : plate;
}

constexpr auto kSquare = static_cast<float>(PlateBody::kSquareMm), kMarker = static_cast<float>(PlateBody::kMarkerMm);

const auto& board() {
#if OSTEO_ARUCO_CLASSES
  static const cv::aruco::CharucoBoard made({PlateBody::kAcross, PlateBody::kDown}, kSquare, kMarker,
                                            dictionary_of(MarkerKind::plate));
#else
  static const cv::Ptr<cv::aruco::CharucoBoard> made = cv::aruco::CharucoBoard::create(
      PlateBody::kAcross, PlateBody::kDown, kSquare, kMarker, dictionary_of(MarkerKind::plate));
#endif
  return made;
}

}  // namespace

int bits_across(MarkerKind kind) {
#if OSTEO_ARUCO_CLASSES
  return dictionary_of(kind).markerSize;
#else
  return dictionary_of(kind)->markerSize;
#endif
}

cv::Mat drawn_marker(MarkerKind kind, int id, int pixels) {
  cv::Mat picture;
#if OSTEO_ARUCO_CLASSES
  dictionary_of(kind).generateImageMarker(id, pixels, picture, 1);
#else
  dictionary_of(kind)->drawMarker(id, pixels, picture, 1);
#endif
  return picture;
}

std::vector<PlateMarker> markers_of_plate() {
#if OSTEO_ARUCO_CLASSES
  const std::vector<int>& ids = board().getIds();
  const auto& corners = board().getObjPoints();
#else
  const std::vector<int>& ids = board()->ids;
  const auto& corners = board()->objPoints;
#endif
  std::vector<PlateMarker> all;
  for (std::size_t i = 0; i < ids.size(); ++i) all.push_back({ids[i], corners[i]});
  return all;
}

std::vector<cv::Point3f> crossings_of_plate() {
#if OSTEO_ARUCO_CLASSES
  return board().getChessboardCorners();
#else
  return board()->chessboardCorners;
#endif
}

void find_markers(const cv::Mat& gray, MarkerKind kind, const cv::aruco::DetectorParameters& how, Corners& corners,
                  std::vector<int>& ids) {
#if OSTEO_ARUCO_CLASSES
  cv::aruco::ArucoDetector(dictionary_of(kind), how).detectMarkers(gray, corners, ids);
#else
  cv::aruco::detectMarkers(gray, dictionary_of(kind), corners, ids, cv::makePtr<cv::aruco::DetectorParameters>(how));
#endif
}

void find_crossings(const cv::Mat& gray, const cv::aruco::DetectorParameters& how, const Corners& corners,
                    const std::vector<int>& ids, std::vector<cv::Point2f>& crossings, std::vector<int>& numbers) {
  crossings.clear();
  numbers.clear();
  if (ids.empty()) return;
#if OSTEO_ARUCO_CLASSES
  // It takes those that were found, and would write here.
  Corners found = corners;
  std::vector<int> found_ids = ids;
  cv::aruco::CharucoDetector(board(), {}, how).detectBoard(gray, crossings, numbers, found, found_ids);
#else
  static_cast<void>(how);
  cv::aruco::interpolateCornersCharuco(corners, ids, gray, board(), crossings, numbers);
#endif
}

}  // namespace osteo::inline simulation::marker
