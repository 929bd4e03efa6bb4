#include "osteo/simulation/marker/detail/camera.h"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "aruco.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json.h"
#include "osteo/core/base/json_document.h"

namespace osteo::inline simulation {
namespace {

// As the file has it.
struct CameraFields {
  using Params = CameraFields;
  int version = 1;
  CameraModel camera;
  std::array<double, 3> radial{};
  double p1 = 0, p2 = 0;

  static void describe(CameraFields& f, auto& visit) {
    CameraModel& c = f.camera;
    visit({"osteotome_camera", "version of the format", "", 1, 1, true}, f.version);
    visit({"width", "width of the camera's pictures", "pixels", 64, 16384, true}, c.width);
    visit({"height", "height of the camera's pictures", "pixels", 64, 16384, true}, c.height);
    visit({"fx", "focal length, across", "pixels", 10, 1e6, true}, c.fx);
    visit({"fy", "focal length, down", "pixels", 10, 1e6, true}, c.fy);
    visit({"cx", "where the axis of the lens is seen, from the left", "pixels", -16384, 32768, true}, c.cx);
    visit({"cy", "the same, from the top", "pixels", -16384, 32768, true}, c.cy);
    visit({"radial", "distortion k1, k2, k3", "", -100, 100, true}, f.radial);
    visit({"p1", "distortion by a lens that is not centred", "", -1, 1}, f.p1);
    visit({"p2", "the same, across", "", -1, 1}, f.p2);
    visit({"mirrored", "the camera delivers mirrored pictures"}, c.mirrored);
    visit({"fps", "pictures a second that it is asked for", "Hz", 1, 1000}, c.fps);
    visit({"latency_ms",
           "camera latency, from the middle of an exposure until the picture is here (below 0: not known, one period "
           "is taken)",
           "ms", -1, 1000},
          c.latency_ms);
    visit({"rms_px", "root mean square error of the calibration", "pixels", 0, 1000}, c.rms_px);
    visit({"views", "views of the calibration", "", 0, 100000}, c.views);
  }
};

using Look = CameraCalibration::Look;

}  // namespace

CameraModel load_camera(const fs::path& path) {
  CameraFields f;
  const JsonFile file(read_text(path), path.string());
  file.read(file.root(), "", fields_of<CameraFields>(f));
  CameraModel& c = f.camera;
  c.distortion = {f.radial[0], f.radial[1], f.p1, f.p2, f.radial[2]};
  if (std::abs(c.cx - 0.5 * c.width) > 0.5 * c.width || std::abs(c.cy - 0.5 * c.height) > 0.5 * c.height ||
      c.fx > 2 * c.fy || c.fy > 2 * c.fx)
    throw Error(
        ExitCode::usage,
        "'" + path.string() + "' describes a lens that looks past its own picture, or one far from square pixels",
        "calibrate the camera again: osteo calibrate-camera");
  return c;
}

std::string camera_json(const CameraModel& c) {
  return Json{{"osteotome_camera", 1},
              {"width", c.width},
              {"height", c.height},
              {"fx", c.fx},
              {"fy", c.fy},
              {"cx", c.cx},
              {"cy", c.cy},
              {"radial", std::vector<double>{c.distortion[0], c.distortion[1], c.distortion[4]}},
              {"p1", c.distortion[2]},
              {"p2", c.distortion[3]},
              {"mirrored", c.mirrored},
              {"fps", c.fps},
              {"latency_ms", c.latency_ms},
              {"rms_px", c.rms_px},
              {"views", c.views}}
             .dump(2) +
         "\n";
}

Look CameraCalibration::add(const GrayPicture& picture) {
  if (width_ == 0) {
    width_ = picture.width;
    height_ = picture.height;
  }
  if (picture.width != width_ || picture.height != height_)
    throw Error(ExitCode::usage,
                "pictures of different sizes: " + std::to_string(width_) + " x " + std::to_string(height_) + " and " +
                    std::to_string(picture.width) + " x " + std::to_string(picture.height),
                "a camera is calibrated at one size");
  ++pictures_;
  cv::Mat gray = marker::view_of(picture).clone();
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  std::vector<cv::Point2f> crossings;
  std::vector<int> numbers;
  const auto find = [&] {
    cv::aruco::DetectorParameters p;
    p.cornerRefinementMethod = cv::aruco::CORNER_REFINE_NONE;
    p.errorCorrectionRate = 0.4;
    p.minMarkerDistanceRate = 0.02;  // the white squares around markers are no rivals of theirs
    corners.clear();
    ids.clear();
    marker::find_markers(gray, MarkerKind::plate, p, corners, ids);
    marker::find_crossings(gray, p, corners, ids, crossings, numbers);
    return crossings.size() >= 8;
  };
  bool turned = mirrored_ > 0;
  if (turned) cv::flip(gray, gray, 1);
  if (!find()) {
    // The first that is seen says which way round they are.
    if (with_plate_ > 0) return Look::no_plate;
    cv::flip(gray, gray, 1);
    turned = !turned;
    if (!find()) return Look::no_plate;
  }
  ++with_plate_;
  mirrored_ += turned ? 1 : 0;

  View view;
  const std::vector<cv::Point3f> board = marker::crossings_of_plate();
  std::vector<cv::Point2f> flat, seen;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const cv::Point3f& p = board[static_cast<std::size_t>(numbers[i])];
    view.plate_mm.push_back({p.x, p.y, p.z});
    view.pixel.push_back({crossings[i].x, crossings[i].y});
    flat.emplace_back(p.x, p.y);
    seen.push_back(crossings[i]);
  }
  const cv::Mat plane = cv::findHomography(flat, seen, cv::RANSAC, 3);
  if (plane.empty()) return Look::no_plate;
  const float w = static_cast<float>(PlateBody::kAcross * PlateBody::kSquareMm),
              h = static_cast<float>(PlateBody::kDown * PlateBody::kSquareMm);
  std::vector<cv::Point2f> outline;
  cv::perspectiveTransform(std::vector<cv::Point2f>{{0, 0}, {w, 0}, {w, h}, {0, h}}, outline, plane);
  for (std::size_t c = 0; c < 4; ++c) {
    view.hull[2 * c] = outline[c].x / static_cast<double>(width_);
    view.hull[2 * c + 1] = outline[c].y / static_cast<double>(height_);
  }
  for (const View& v : views_) {
    double most = 0;
    for (std::size_t i = 0; i < 8; ++i) most = std::max(most, std::abs(v.hull[i] - view.hull[i]));
    if (most < 0.05) return Look::like_another;
  }
  if (views() >= kMaxViews) return Look::like_another;
  // Corners that the plane of the others does not explain were moved by blur. A lens bends the plane by a few pixels
  // only.
  std::vector<cv::Point2f> expected;
  cv::perspectiveTransform(flat, expected, plane);
  double sum = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) sum += std::pow(cv::norm(expected[i] - seen[i]), 2);
  if (std::sqrt(sum / static_cast<double>(seen.size())) > 0.01 * width_) return Look::blurred;
  views_.push_back(std::move(view));
  return Look::taken;
}

CameraCalibration::Result CameraCalibration::solve() const {
  if (views() < kMinViews)
    throw Error(ExitCode::failed,
                "only " + std::to_string(views()) + " of " + std::to_string(pictures_) +
                    " pictures show the plate from another side; " + std::to_string(kMinViews) + " are needed",
                with_plate_ == 0 ? "is it the plate of 'osteo markers', flat, well lit, whole in the picture?"
                                 : "turn and tilt the plate, near and far, into all corners of the picture");
  std::vector<std::vector<cv::Point3f>> object;
  std::vector<std::vector<cv::Point2f>> image;
  double lo[2] = {1e9, 1e9}, hi[2] = {-1e9, -1e9};
  for (const View& v : views_) {
    auto& o = object.emplace_back();
    auto& i = image.emplace_back();
    for (const auto& p : v.plate_mm) o.emplace_back(p[0], p[1], p[2]);
    for (const auto& p : v.pixel) {
      i.emplace_back(p[0], p[1]);
      for (std::size_t a = 0; a < 2; ++a) {
        lo[a] = std::min(lo[a], static_cast<double>(p[a]));
        hi[a] = std::max(hi[a], static_cast<double>(p[a]));
      }
    }
  }
  cv::Mat k, d, spread, ignored, view_errors;
  std::vector<cv::Mat> turns, shifts;
  double rms = 0;
  // Without k3: a webcam's lens needs none, and few views bend it as they like where no corner was seen.
  try {
    rms = cv::calibrateCamera(object, image, {width_, height_}, k, d, turns, shifts, spread, ignored, view_errors,
                              cv::CALIB_FIX_K3,
                              cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 100, 1e-10));
  } catch (const cv::Exception&) {
    throw Error(ExitCode::failed, "no lens explains these views",
                "take them again: a flat plate, in focus, held still, tilted every way");
  }
  Result r;
  CameraModel& c = r.camera;
  c.width = width_;
  c.height = height_;
  c.fx = k.at<double>(0, 0);
  c.fy = k.at<double>(1, 1);
  c.cx = k.at<double>(0, 2);
  c.cy = k.at<double>(1, 2);
  for (int i = 0; i < 5; ++i) c.distortion[static_cast<std::size_t>(i)] = d.at<double>(i);
  c.mirrored = mirrored_ > 0;
  c.rms_px = rms;
  c.views = views();
  for (int i = 0; i < static_cast<int>(view_errors.total()); ++i)
    r.worst_view_px = std::max(r.worst_view_px, view_errors.at<double>(i));
  r.focal_spread = spread.at<double>(0) / c.fx;
  r.seen_width = (hi[0] - lo[0]) / width_;
  r.seen_height = (hi[1] - lo[1]) / height_;
  const auto percent = [](double share) {
    char text[32];
    std::snprintf(text, sizeof text, "%.1f %%", 100 * share);
    return std::string(text);
  };
  if (!(rms <= kMaxRmsPx)) {
    char text[64];
    std::snprintf(text, sizeof text, "%.2f", rms);
    throw Error(
        ExitCode::failed,
        std::string("corners lie ") + text + " pixels (RMS) from where the lens would show them; at most 1 is taken",
        "the plate has to be flat (glue it to a board), in focus and still; turn autofocus and picture stabilisation "
        "off");
  }
  // A plate that is never tilted leaves the focal length open, and the spread does not tell: it is that of the lens
  // that was found. What tells is that far edges look shorter.
  int tilted = 0;
  for (const View& v : views_) {
    const auto edge = [&](std::size_t a, std::size_t b) {
      return std::hypot((v.hull[2 * a] - v.hull[2 * b]) * width_, (v.hull[2 * a + 1] - v.hull[2 * b + 1]) * height_);
    };
    const double ratio[2] = {edge(0, 1) / edge(3, 2), edge(0, 3) / edge(1, 2)};
    if (std::max(std::abs(std::log(ratio[0])), std::abs(std::log(ratio[1]))) > 0.1) ++tilted;
  }
  if (3 * tilted < views() || !(r.focal_spread <= kMaxFocalSpread) || !(c.fx > 0))
    throw Error(ExitCode::failed,
                "the views are too much alike to tell the focal length: the plate is tilted in " +
                    std::to_string(tilted) + " of " + std::to_string(views()) + "; it is open by " +
                    percent(r.focal_spread),
                "tilt the plate by 30 degrees and more to all sides, near and far");
  if (std::min(r.seen_width, r.seen_height) < 0.7)
    r.doubts.push_back("the plate was seen on " + percent(r.seen_width) + " of the width and " +
                       percent(r.seen_height) +
                       " of the height only: nearer to the border the pen's place will be less true");
  return r;
}

}  // namespace osteo::inline simulation
