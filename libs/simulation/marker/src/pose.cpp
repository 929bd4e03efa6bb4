#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <optional>
#include <set>

#include "osteo/core/base/order.h"
#include "osteo/simulation/marker/detail/tracker.h"

namespace osteo::inline simulation {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;
constexpr double kHuberPx = 1;
constexpr double kDegree = std::numbers::pi / 180;

Mat3 turn_by(Vec3 w) {
  const double angle = length(w);
  return angle > 0 ? rotation_about({}, w / angle, angle).rotation : Mat3{};
}
double angle_between(const Mat3& a, const Mat3& b) {
  double trace = 0;
  for (std::size_t c = 0; c < 3; ++c) trace += dot(a.column[c], b.column[c]);
  return std::acos(std::clamp((trace - 1) / 2, -1.0, 1.0));
}

// One corner: where it is on the body, and the ray on which it is seen, undistorted.
struct Ray {
  Vec3 body_mm;
  double x = 0, y = 0;
};
struct Fit {
  RigidTransform pose;
  double cost = std::numeric_limits<double>::infinity();  // mean Huber loss a corner, px^2
  Matrix6 normal = Matrix6::Zero();
};

// Gauss and Newton with M. Levenberg's damping, on the pixels that the camera would have without distortion.
class PoseFit {
 public:
  PoseFit(const CameraModel& camera, const std::vector<MarkerCorners>& seen) : camera_(camera), seen_(seen) {
    std::vector<cv::Point2d> pixels, rays;
    for (const MarkerCorners& m : seen) {
      for (const auto& p : m.pixel) pixels.emplace_back(p[0], p[1]);
    }
    const cv::Matx33d k(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
    cv::undistortPoints(pixels, rays, k, camera.distortion, cv::noArray(), cv::noArray(),
                        cv::TermCriteria(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 40, 1e-10));
    for (std::size_t i = 0; i < rays.size(); ++i)
      rays_.push_back({seen[i / 4].patch.corner_mm(i % 4), rays[i].x, rays[i].y});
  }

  // Squared length of a corner's error, px^2; infinite behind the camera.
  [[nodiscard]] double error2(const RigidTransform& pose, std::size_t i) const {
    const Vec3 p = pose(rays_[i].body_mm);
    if (!(p.z > 1)) return std::numeric_limits<double>::infinity();
    const double u = camera_.fx * (p.x / p.z - rays_[i].x), v = camera_.fy * (p.y / p.z - rays_[i].y);
    return u * u + v * v;
  }
  [[nodiscard]] double cost(const RigidTransform& pose) const {
    double sum = 0;
    for (std::size_t i = 0; i < rays_.size(); ++i) {
      const double e = std::sqrt(error2(pose, i));
      sum += e <= kHuberPx ? e * e : kHuberPx * (2 * e - kHuberPx);
    }
    return sum / static_cast<double>(rays_.size());
  }

  [[nodiscard]] Fit refine(const RigidTransform& start) const {
    Fit fit{start, cost(start), Matrix6::Zero()};
    double damping = 1e-4;
    for (int round = 0; round < 60 && std::isfinite(fit.cost); ++round) {
      Matrix6 h = Matrix6::Zero();
      Vector6 g = Vector6::Zero();
      for (std::size_t i = 0; i < rays_.size(); ++i) {
        const Vec3 arm = fit.pose.rotation * rays_[i].body_mm, p = arm + fit.pose.shift_mm;
        const double x = p.x / p.z, y = p.y / p.z;
        const Vec3 du{camera_.fx / p.z, 0, -camera_.fx * x / p.z}, dv{0, camera_.fy / p.z, -camera_.fy * y / p.z};
        const double u = camera_.fx * (x - rays_[i].x), v = camera_.fy * (y - rays_[i].y);
        const double e = std::sqrt(u * u + v * v), weight = e <= kHuberPx ? 1 : kHuberPx / e;
        // d(w x arm) = w . (arm x d)
        const Vec3 wu = cross(arm, du), wv = cross(arm, dv);
        const Vector6 ju = (Vector6() << wu.x, wu.y, wu.z, du.x, du.y, du.z).finished();
        const Vector6 jv = (Vector6() << wv.x, wv.y, wv.z, dv.x, dv.y, dv.z).finished();
        h += weight * (ju * ju.transpose() + jv * jv.transpose());
        g += weight * (ju * u + jv * v);
      }
      fit.normal = h;
      bool better = false;
      Vector6 step = Vector6::Zero();
      for (int tries = 0; tries < 8 && !better; ++tries) {
        Matrix6 damped = h;
        damped.diagonal() *= 1 + damping;
        step = damped.ldlt().solve(-g);
        if (!step.allFinite()) return fit;
        RigidTransform next;
        const Mat3 by = turn_by({step[0], step[1], step[2]});
        for (std::size_t c = 0; c < 3; ++c) next.rotation.column[c] = by * fit.pose.rotation.column[c];
        next.shift_mm = fit.pose.shift_mm + Vec3{step[3], step[4], step[5]};
        const double there = cost(next);
        better = there <= fit.cost;
        if (better) {
          fit.pose = next;
          fit.cost = there;
          damping = std::max(1e-12, damping * 0.1);
        } else {
          damping = std::max(1e-6, damping * 10);
        }
      }
      if (!better || step.norm() < 1e-11) break;
    }
    return fit;
  }

  // Every marker is seen from outside.
  [[nodiscard]] bool faces_camera(const RigidTransform& pose) const {
    return std::all_of(seen_.begin(), seen_.end(), [&](const MarkerCorners& m) {
      return dot(pose.rotation * m.patch.out(), pose(m.patch.centre_mm)) < 0;
    });
  }

  // Both poses that one flat marker may have (T. Collins, A. Bartoli, IJCV 109(3), 2014).
  void poses_of_marker(std::size_t m, std::vector<RigidTransform>& poses) const {
    const MarkerPatch& patch = seen_[m].patch;
    const double h = patch.size_mm / 2;
    const std::vector<cv::Point3d> square{{-h, h, 0}, {h, h, 0}, {h, -h, 0}, {-h, -h, 0}};
    std::vector<cv::Point2d> rays;
    for (std::size_t i = 4 * m; i < 4 * m + 4; ++i) rays.emplace_back(rays_[i].x, rays_[i].y);
    std::vector<cv::Mat> turns, shifts;
    try {
      cv::solvePnPGeneric(square, rays, cv::Matx33d::eye(), cv::noArray(), turns, shifts, false,
                          cv::SOLVEPNP_IPPE_SQUARE);
    } catch (const cv::Exception&) {
      return;  // corners on a line
    }
    const RigidTransform marker_from_body =
        RigidTransform{Mat3{{patch.right, patch.up, patch.out()}}, patch.centre_mm}.inverse();
    for (std::size_t i = 0; i < turns.size(); ++i) {
      const cv::Vec3d w(turns[i].reshape(1, 3)), t(shifts[i].reshape(1, 3));
      poses.push_back(RigidTransform{turn_by({w[0], w[1], w[2]}), {t[0], t[1], t[2]}} * marker_from_body);
    }
  }
  [[nodiscard]] double rms_of_marker(const RigidTransform& pose, std::size_t m) const {
    double sum = 0;
    for (std::size_t i = 4 * m; i < 4 * m + 4; ++i) sum += error2(pose, i);
    return std::sqrt(sum / 4);
  }

 private:
  const CameraModel& camera_;
  const std::vector<MarkerCorners>& seen_;
  std::vector<Ray> rays_;
};

double area_px2(const MarkerCorners& m) {
  double twice = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto &a = m.pixel[i], &b = m.pixel[(i + 1) % 4];
    twice += a[0] * b[1] - a[1] * b[0];
  }
  return std::abs(twice) / 2;
}

bool on_one_plane(const std::vector<MarkerCorners>& seen) {
  return std::all_of(seen.begin(), seen.end(), [&](const MarkerCorners& m) {
    const Vec3 out = seen.front().patch.out();
    return dot(m.patch.out(), out) > 0.99 && std::abs(dot(m.patch.centre_mm - seen.front().patch.centre_mm, out)) < 0.1;
  });
}

}  // namespace

std::array<double, 2> project(const CameraModel& camera, Vec3 p) {
  const double x = p.x / p.z, y = p.y / p.z, r2 = x * x + y * y;
  const auto& k = camera.distortion;
  const double radial = 1 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  const double xd = x * radial + 2 * k[2] * x * y + k[3] * (r2 + 2 * x * x),
               yd = y * radial + k[2] * (r2 + 2 * y * y) + 2 * k[3] * x * y;
  return {camera.fx * xd + camera.cx, camera.fy * yd + camera.cy};
}

PenSight pose_of(const CameraModel& camera, const std::vector<MarkerCorners>& all, const RigidTransform* guess) {
  PenSight sight;
  if (all.empty()) return sight;
  std::vector<MarkerCorners> seen = all;
  // The largest first: they know most.
  std::sort(seen.begin(), seen.end(), [](const auto& a, const auto& b) { return area_px2(a) > area_px2(b); });
  std::optional<Fit> best;
  while (true) {
    const PoseFit problem(camera, seen);
    std::vector<RigidTransform> starts;
    if (guess != nullptr) starts.push_back(*guess);
    for (std::size_t m = 0; m < std::min<std::size_t>(seen.size(), 3); ++m) problem.poses_of_marker(m, starts);
    std::vector<Fit> fits;
    for (const RigidTransform& start : starts) {
      Fit f = problem.refine(start);
      if (std::isfinite(f.cost) && problem.faces_camera(f.pose)) fits.push_back(f);
    }
    sight.markers = static_cast<int>(seen.size());
    if (fits.empty()) {
      sight.state = PenSight::State::unlike;
      return sight;
    }
    std::sort(fits.begin(), fits.end(), [](const Fit& a, const Fit& b) { return a.cost < b.cost; });
    best = fits.front();
    // Of one flat side, from afar: another pose that explains it nearly as well.
    if (on_one_plane(seen)) {
      for (const Fit& other : fits) {
        if (angle_between(other.pose.rotation, fits.front().pose.rotation) < 5 * kDegree ||
            other.cost > 4 * fits.front().cost + 0.1)
          continue;
        if (guess == nullptr) {
          sight.state = PenSight::State::ambiguous;
          return sight;
        }
        if (angle_between(other.pose.rotation, guess->rotation) < angle_between(best->pose.rotation, guess->rotation))
          best = other;
      }
    }
    // The marker that fits worst goes, when it is worse than the corners of the others allow.
    std::vector<double> rms;
    for (std::size_t m = 0; m < seen.size(); ++m) rms.push_back(problem.rms_of_marker(best->pose, m));
    const double median = upper_median(rms);
    const auto worst = std::max_element(rms.begin(), rms.end());
    if (seen.size() >= 3 && *worst > std::max(0.8, 4 * median)) {
      seen.erase(seen.begin() + (worst - rms.begin()));
      ++sight.markers_left_out;
      continue;
    }
    double sum = 0;
    for (const double r : rms) sum += r * r;
    sight.rms_px = std::sqrt(sum / static_cast<double>(rms.size()));
    break;
  }
  sight.camera_from_body = best->pose;
  // Corners are found to a few tenths of a pixel; where they are not, this is not the body, or not the camera.
  sight.state = sight.rms_px > 3 ? PenSight::State::unlike : PenSight::State::seen;
  const Matrix6 covariance = best->normal.ldlt().solve(Matrix6::Identity());
  for (int i = 0; i < 36; ++i) sight.covariance_a_px2[static_cast<std::size_t>(i)] = covariance(i / 6, i % 6);
  return sight;
}

}  // namespace osteo::inline simulation
