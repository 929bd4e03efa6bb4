#include "osteo/simulation/marker/detail/tracker.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "aruco.h"
#include "edges.h"
#include "osteo/core/base/error.h"

namespace osteo::inline simulation {
namespace {

constexpr int kPicturesRemembered = 10;  // a pose is a guess for so many pictures
constexpr int kMirrorAfter = 8;          // pictures without a pen before a mirrored one is looked for
constexpr double kMinSidePx = 11;

using marker::Quad;

struct Detected {
  int id;
  Quad quad;
};

Vec3 middle_of(const Quad& q) {
  Vec3 m;
  for (const auto& p : q) m += Vec3{p[0], p[1], 0} * 0.25;
  return m;
}

std::vector<Detected> detect(const cv::Mat& gray) {
  cv::aruco::DetectorParameters p;
  const double size = std::max(gray.cols, gray.rows);
  p.minMarkerPerimeterRate = 4 * kMinSidePx / size;
  p.adaptiveThreshWinSizeMin = 5;
  p.adaptiveThreshWinSizeMax = 25;
  p.adaptiveThreshWinSizeStep = 10;
  p.polygonalApproxAccuracyRate = 0.05;
  p.minCornerDistanceRate = 0.03;
  p.minDistanceToBorder = 1;
  p.errorCorrectionRate = 0.4;  // a wrong marker is worse than none
  p.cornerRefinementMethod = cv::aruco::CORNER_REFINE_NONE;
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  marker::find_markers(gray, MarkerKind::pen, p, corners, ids);
  std::vector<Detected> all;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    Detected d{ids[i], {}};
    for (std::size_t c = 0; c < 4; ++c) d.quad[c] = {corners[i][c].x, corners[i][c].y};
    all.push_back(d);
  }
  return all;
}

bool is_dark(const cv::Mat& gray) {
  cv::Mat small;
  cv::resize(gray, small, {64, 48}, 0, 0, cv::INTER_AREA);
  std::vector<std::uint8_t> v(small.begin<std::uint8_t>(), small.end<std::uint8_t>());
  const auto at = v.begin() + static_cast<std::ptrdiff_t>(v.size() * 98 / 100);
  std::nth_element(v.begin(), at, v.end());
  return *at < 45;
}

}  // namespace

struct PenTracker::Inside {
  CameraModel camera;
  std::vector<MarkerPatch> patches;
  int cells = marker_cells_across(MarkerKind::pen);
  std::optional<RigidTransform> last;
  int since_seen = 0;
  bool mirrored;

  [[nodiscard]] const MarkerPatch* patch(int id) const {
    const auto it = std::find_if(patches.begin(), patches.end(), [&](const MarkerPatch& p) { return p.id == id; });
    return it != patches.end() ? &*it : nullptr;
  }
  [[nodiscard]] Quad quad_of(const MarkerPatch& p, const RigidTransform& pose) const {
    Quad q;
    for (std::size_t c = 0; c < 4; ++c) q[c] = project(camera, pose(p.corner_mm(c)));
    return q;
  }
  [[nodiscard]] bool towards(const MarkerPatch& p, const RigidTransform& pose, double least_cosine) const {
    const Vec3 at = pose(p.centre_mm);
    return at.z > 20 && dot(pose.rotation * p.out(), at) < -least_cosine * length(at);
  }

  // Where the whole body was, and room for it to move.
  [[nodiscard]] cv::Rect near(const RigidTransform& pose) const {
    double lo[2] = {1e9, 1e9}, hi[2] = {-1e9, -1e9};
    for (const MarkerPatch& p : patches) {
      if (pose(p.centre_mm).z < 60) return {};
      for (const auto& c : quad_of(p, pose)) {
        for (std::size_t a = 0; a < 2; ++a) {
          lo[a] = std::min(lo[a], c[a]);
          hi[a] = std::max(hi[a], c[a]);
        }
      }
    }
    const double room = 12 + 0.5 * std::max(hi[0] - lo[0], hi[1] - lo[1]);
    const int x = static_cast<int>(lo[0] - room), y = static_cast<int>(lo[1] - room);
    return cv::Rect(x, y, static_cast<int>(hi[0] + room) - x, static_cast<int>(hi[1] + room) - y) &
           cv::Rect(0, 0, camera.width, camera.height);
  }

  // Of this pen only; in the whole picture's pixels.
  std::vector<Detected> find(const cv::Mat& gray, const cv::Rect& where, PenSight& sight) const {
    if (where.width < 24 || where.height < 24) return {};
    std::vector<Detected> mine;
    for (Detected& d : detect(gray(where))) {
      for (auto& c : d.quad) {
        c[0] += where.x;
        c[1] += where.y;
      }
      if (patch(d.id) != nullptr) {
        mine.push_back(d);
      } else {
        sight.other_pen = true;
      }
    }
    return mine;
  }

  PenSight look_at(const cv::Mat& gray) {
    PenSight sight;
    const RigidTransform* const guess = last && since_seen <= kPicturesRemembered ? &*last : nullptr;
    std::vector<Detected> found;
    if (guess != nullptr) found = find(gray, near(*guess), sight);
    if (found.empty()) found = find(gray, cv::Rect(0, 0, gray.cols, gray.rows), sight);
    if (found.empty()) {
      sight.dark = is_dark(gray);
      return sight;
    }

    // A marker is there once. Of two, the one nearer to where it was.
    std::map<int, Detected> once;
    for (const Detected& d : found) {
      const auto [it, is_new] = once.emplace(d.id, d);
      if (is_new) continue;
      if (length(middle_of(d.quad) - middle_of(it->second.quad)) < 8)
        continue;  // the inner and outer outline of the same
      sight.doubled = true;
      if (guess == nullptr) continue;
      const Vec3 was = middle_of(quad_of(*patch(d.id), *guess));
      if (length(middle_of(d.quad) - was) < length(middle_of(it->second.quad) - was)) it->second = d;
    }
    if (sight.doubled && guess == nullptr) {
      sight.state = PenSight::State::doubled;
      sight.markers = static_cast<int>(once.size());
      return sight;
    }
    // One alone may be another that was misread, in a mirrored picture for one: only what was seen before makes it the
    // pen.
    if (once.size() < 2 && guess == nullptr) {
      sight.state = PenSight::State::ambiguous;
      sight.markers = 1;
      return sight;
    }
    std::vector<MarkerCorners> corners;
    std::vector<MarkerCorners>
        rough;  // a contour's corners lie inside of the true ones: with enough others they only mislead
    for (auto& [id, d] : once) {
      const bool fine = marker::refine_corners(gray, d.quad, cells);
      (fine ? corners : rough).push_back({*patch(id), d.quad});
    }
    if (corners.size() < 2) corners.insert(corners.end(), rough.begin(), rough.end());
    take(sight, pose_of(camera, corners, guess));
    if (sight.state == PenSight::State::seen) add_the_slanting(gray, corners, sight);
    return sight;
  }

  static void take(PenSight& sight, PenSight pose) {
    pose.doubled = sight.doubled;
    pose.other_pen = sight.other_pen;
    pose.dark = sight.dark;
    sight = pose;
  }

  // Markers too narrow to be read say most of the tilt: now that the pose is nearly known, their edges are found where
  // they must be.
  void add_the_slanting(const cv::Mat& gray, std::vector<MarkerCorners>& corners, PenSight& sight) {
    const std::size_t read = corners.size();
    for (const MarkerPatch& p : patches) {
      if (std::any_of(corners.begin(), corners.end(), [&](const MarkerCorners& c) { return c.patch.id == p.id; }))
        continue;
      if (!towards(p, sight.camera_from_body, 0.2)) continue;
      Quad q = quad_of(p, sight.camera_from_body);
      if (marker::refine_corners(gray, q, cells)) corners.push_back({p, q});
    }
    if (corners.size() == read) return;
    const RigidTransform guess = sight.camera_from_body;
    const PenSight more = pose_of(camera, corners, &guess);
    if (more.state == PenSight::State::seen && more.rms_px < std::max(0.5, 2.5 * sight.rms_px)) take(sight, more);
  }
};

PenTracker::PenTracker(const CameraModel& camera, int pen, double scale)
    : inside_(
          new Inside{.camera = camera, .patches = pen_markers(pen, scale), .last = {}, .mirrored = camera.mirrored}) {}
PenTracker::~PenTracker() = default;

void PenTracker::forget() {
  inside_->last.reset();
}

PenSight PenTracker::look(const GrayPicture& picture) {
  Inside& in = *inside_;
  if (picture.width != in.camera.width || picture.height != in.camera.height)
    throw Error(ExitCode::usage,
                "the camera gives pictures of " + std::to_string(picture.width) + " x " +
                    std::to_string(picture.height) + ", it was calibrated at " + std::to_string(in.camera.width) +
                    " x " + std::to_string(in.camera.height),
                "calibrate it at this size ('osteo calibrate-camera'), or set it to the other");
  const cv::Mat gray = marker::view_of(picture);
  const auto as_if = [&](bool mirrored) {
    if (!mirrored) return in.look_at(gray);
    cv::Mat turned;
    cv::flip(gray, turned, 1);
    return in.look_at(turned);
  };
  PenSight sight = as_if(in.mirrored);
  if (sight.state != PenSight::State::seen && in.since_seen >= kMirrorAfter && in.since_seen % 4 == 0) {
    in.last.reset();
    if (const PenSight other = as_if(!in.mirrored); other.state == PenSight::State::seen && other.markers >= 2) {
      in.mirrored = !in.mirrored;
      sight = other;
    }
  }
  sight.mirrored = in.mirrored;
  if (sight.state == PenSight::State::seen) {
    in.last = sight.camera_from_body;
    in.since_seen = 0;
  } else {
    ++in.since_seen;
  }
  return sight;
}

}  // namespace osteo::inline simulation
