#include "osteo/simulation/marker/detail/filter.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace osteo::inline simulation {
namespace {

using StateMatrix = Eigen::Matrix<double, 6, 6, Eigen::RowMajor>;
constexpr double kGapS = 0.3;

Eigen::Vector3d eigen_of(Vec3 v) {
  return {v.x, v.y, v.z};
}
Vec3 vec_of(const Eigen::Vector3d& v) {
  return {v[0], v[1], v[2]};
}
Mat3 small_turn(Vec3 w) {
  const double angle = length(w);
  return angle > 0 ? rotation_about({}, w / angle, angle).rotation : Mat3{};
}
Mat3 product(const Mat3& a, const Mat3& b) {
  return {{a * b.column[0], a * b.column[1], a * b.column[2]}};
}
// The vector that turns by `r`.
Vec3 vector_of(const Mat3& r) {
  Eigen::Matrix3d m;
  for (int c = 0; c < 3; ++c) m.col(c) = eigen_of(r.column[static_cast<std::size_t>(c)]);
  const Eigen::AngleAxisd a(m);
  return vec_of(a.axis() * a.angle());
}
Mat3 orthonormal(const Mat3& m) {
  const Vec3 x = normalized(m.column[0]), y = normalized(m.column[1] - x * dot(x, m.column[1]));
  return {{x, y, cross(x, y)}};
}

StateMatrix start_covariance(const Eigen::Matrix3d& measured, double speed) {
  StateMatrix p = StateMatrix::Zero();
  p.topLeftCorner<3, 3>() = measured;
  p.bottomRightCorner<3, 3>().diagonal().setConstant(speed * speed);
  return p;
}
void carry_on(StateMatrix& p, double dt, double density) {
  StateMatrix f = StateMatrix::Identity();
  f.topRightCorner<3, 3>().diagonal().setConstant(dt);
  p = f * p * f.transpose();
  const double q[3] = {density * dt * dt * dt / 3, density * dt * dt / 2, density * dt};
  for (int i = 0; i < 3; ++i) {
    p(i, i) += q[0];
    p(i, i + 3) += q[1];
    p(i + 3, i) += q[1];
    p(i + 3, i + 3) += q[2];
  }
}
// What to add to position and velocity; `off`: measured less predicted.
Eigen::Matrix<double, 6, 1> correct(StateMatrix& p, const Eigen::Matrix3d& measured, const Eigen::Vector3d& off) {
  const Eigen::Matrix3d s = p.topLeftCorner<3, 3>() + measured;
  const Eigen::Matrix<double, 6, 3> gain = p.leftCols<3>() * s.inverse();
  p -= gain * p.topRows<3>();
  p = (0.5 * (p + p.transpose())).eval();
  return gain * off;
}

}  // namespace

Vec3 PenMotion::tip_at(double t) const {
  return tip_mm + velocity_mm_s * std::clamp(t - time_s, 0.0, kMaxAheadS);
}
Mat3 PenMotion::rotation_at(double t) const {
  return product(small_turn(turning_rad_s * std::clamp(t - time_s, 0.0, kMaxAheadS)), rotation);
}

PenFilter::PenFilter(Vec3 tip_mm, const PenFilterParams& params) : tip_mm_(tip_mm), params_(params) {}

void PenFilter::add(double time_s, const PenSight& sight) {
  const Vec3 measured_mm = sight.camera_from_body(tip_mm_);
  const Vec3 arm = sight.camera_from_body.rotation * tip_mm_;
  // A corner's error is what the corners of this picture show, and at least what is known of corners.
  const double px = std::max(params_.corner_px, sight.rms_px);
  const Eigen::Matrix<double, 6, 6> all = Eigen::Map<const StateMatrix>(sight.covariance_a_px2.data()) * (px * px);
  Eigen::Matrix<double, 3, 6> j;  // of the tip by turn and shift
  j.leftCols<3>() << 0, arm.z, -arm.y, -arm.z, 0, arm.x, arm.y, -arm.x, 0;
  j.rightCols<3>().setIdentity();
  const Eigen::Matrix3d tip_r = j * all * j.transpose(), turn_r = all.topLeftCorner<3, 3>();
  Eigen::Map<StateMatrix> tip_map(tip_p_.data()), turn_map(turn_p_.data());
  const double dt = time_s - motion_.time_s;
  if (!started_ || !(dt > 0) || dt > kGapS) {
    motion_ = {time_s, measured_mm, {}, sight.camera_from_body.rotation, {}};
    tip_map = start_covariance(tip_r, 300);
    turn_map = start_covariance(turn_r, 3);
    started_ = true;
    return;
  }
  StateMatrix p = tip_map;
  // Of a speed only what is more than it may be wrong by counts: noise is no motion.
  const auto lively = [&](Vec3 speed, const StateMatrix& known, double all_from) {
    const double sure = std::max(0.0, dot(speed, speed) - 2 * known.bottomRightCorner<3, 3>().trace());
    return params_.rest_share + (1 - params_.rest_share) * std::min(1.0, sure / (all_from * all_from));
  };
  carry_on(p, dt, params_.acceleration_mm2_s3 * lively(motion_.velocity_mm_s, p, params_.moving_mm_s));
  const Vec3 expected = motion_.tip_mm + motion_.velocity_mm_s * dt;
  const auto by = correct(p, tip_r, eigen_of(measured_mm - expected));
  motion_.tip_mm = expected + vec_of(by.head<3>());
  motion_.velocity_mm_s += vec_of(by.tail<3>());
  tip_map = p;

  p = turn_map;
  carry_on(p, dt, params_.turning_rad2_s3 * lively(motion_.turning_rad_s, p, params_.turning_rad_s));
  const Mat3 turned = product(small_turn(motion_.turning_rad_s * dt), motion_.rotation);
  const auto turn =
      correct(p, turn_r, eigen_of(vector_of(product(sight.camera_from_body.rotation, transposed(turned)))));
  motion_.rotation = orthonormal(product(small_turn(vec_of(turn.head<3>())), turned));
  motion_.turning_rad_s += vec_of(turn.tail<3>());
  turn_map = p;
  motion_.time_s = time_s;
}

}  // namespace osteo::inline simulation
