#include "osteo/simulation/devices/detail/woodenhaptics.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/core/base/json.h"

namespace osteo::inline simulation {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

}  // namespace

WoodenHapticsGeometry load_woodenhaptics(const fs::path& path) {
  WoodenHapticsGeometry g;
  const std::string name = "'" + path.string() + "'";
  const JsonFile file(read_text(path), path.string());
  auto fields = fields_of<WoodenHapticsGeometry>(g);
  int version = 0;
  fields.push_back({{"osteotome_woodenhaptics", "version of the format", "", 1, 1, true}, &version});
  file.read(file.root(), "", fields);
  for (std::size_t a = 0; a < 3; ++a) {
    if (!(g.capstan_diameter_mm[a] > 0) || !(g.body_diameter_mm[a] > 0) || !(g.link_mm[a] > 0) ||
        !(g.counts_a_turn[a] > 0) || !(g.torque_constant_nm_per_a[a] > 0) || !(g.gimbal_counts_a_turn[a] > 0))
      throw Error(ExitCode::usage, name + ": diameters, links, counts and torque constants must be above 0");
  }
  return g;
}

Vec3 WoodenHapticsKinematics::angles_rad(const std::array<int, 6>& encoder) const {
  Vec3 q;
  for (std::size_t a = 0; a < 3; ++a) q[a] = g_.zero_angle_rad[a] + kTurn * encoder[a] / g_.counts_a_turn[a] / gear(a);
  return q;
}

Vec3 WoodenHapticsKinematics::position_mm(Vec3 q) const {
  const double reach = g_.link_mm[1] * std::sin(q.y) + g_.link_mm[2] * std::sin(q.z);
  return {std::cos(q.x) * reach - g_.origin_mm[0], std::sin(q.x) * reach - g_.origin_mm[1],
          g_.link_mm[0] + g_.link_mm[1] * std::cos(q.y) - g_.link_mm[2] * std::cos(q.z) - g_.origin_mm[2]};
}

Mat3 WoodenHapticsKinematics::jacobian_mm(Vec3 q) const {
  const double lb = g_.link_mm[1], lc = g_.link_mm[2], c = std::cos(q.x), s = std::sin(q.x);
  const double reach = lb * std::sin(q.y) + lc * std::sin(q.z);
  return {{Vec3{-s * reach, c * reach, 0}, Vec3{c * lb * std::cos(q.y), s * lb * std::cos(q.y), -lb * std::sin(q.y)},
           Vec3{c * lc * std::cos(q.z), s * lc * std::cos(q.z), lc * std::sin(q.z)}}};
}

Vec3 WoodenHapticsKinematics::axis(Vec3 q, const std::array<int, 6>& encoder) const {
  // Yaw and pitch of the stylus against the forearm's plane; roll does not move a burr's axis.
  const double yaw = q.x + kTurn * encoder[3] / g_.gimbal_counts_a_turn[0],
               pitch = kTurn * encoder[4] / g_.gimbal_counts_a_turn[1];
  return {-std::cos(yaw) * std::cos(pitch), -std::sin(yaw) * std::cos(pitch), std::sin(pitch)};
}

std::array<double, 3> WoodenHapticsKinematics::currents_ma(Vec3 q, Vec3 force_n) const {
  std::array<double, 3> ma{};
  const Mat3 j = jacobian_mm(q);
  double most = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    const double torque_nm = dot(j.column[a], force_n) / 1000;
    ma[a] = 1000 * torque_nm / gear(a) / g_.torque_constant_nm_per_a[a];
    if (!std::isfinite(ma[a])) return {};
    most = std::max(most, std::abs(ma[a]));
  }
  // All motors together, so that the force keeps its direction.
  if (const double limit = 1000 * g_.max_current_a; most > limit)
    for (double& c : ma) c *= limit / most;
  return ma;
}

Vec3 WoodenHapticsKinematics::force_n(Vec3 q, const std::array<double, 3>& current_ma) const {
  Vec3 torque_nmm;
  for (std::size_t a = 0; a < 3; ++a)
    torque_nmm[a] = current_ma[a] / 1000 * g_.torque_constant_nm_per_a[a] * gear(a) * 1000;
  return inverse(transposed(jacobian_mm(q))) * torque_nmm;
}

std::optional<std::array<int, 6>> WoodenHapticsKinematics::encoders(Vec3 p) const {
  const double x = p.x + g_.origin_mm[0], y = p.y + g_.origin_mm[1], z = p.z + g_.origin_mm[2] - g_.link_mm[0];
  const double lb = g_.link_mm[1], lc = g_.link_mm[2], r = std::hypot(x, y), d2 = r * r + z * z, d = std::sqrt(d2);
  if (d >= lb + lc || d <= std::abs(lb - lc)) return std::nullopt;
  // In the arm's plane: lb at B from the vertical, then lc; its direction from the vertical is pi - C.
  const double towards = std::atan2(r, z),
               bend = std::acos(std::clamp((lb * lb + d2 - lc * lc) / (2 * lb * d), -1.0, 1.0));
  const double b = towards - bend, c = std::numbers::pi - std::atan2(r - lb * std::sin(b), z - lb * std::cos(b));
  const double angle[3] = {std::atan2(y, x), b, c};
  std::array<int, 6> counts{};
  for (std::size_t a = 0; a < 3; ++a)
    counts[a] =
        static_cast<int>(std::lround((angle[a] - g_.zero_angle_rad[a]) / kTurn * g_.counts_a_turn[a] * gear(a)));
  return counts;
}

double WoodenHapticsKinematics::resolution_mm() const {
  const Vec3 q{g_.zero_angle_rad[0], g_.zero_angle_rad[1], g_.zero_angle_rad[2]};
  const Mat3 j = jacobian_mm(q);
  double most = 0;
  for (std::size_t a = 0; a < 3; ++a)
    most = std::max(most, length(j.column[a]) * kTurn / g_.counts_a_turn[a] / gear(a));
  return most;
}

}  // namespace osteo::inline simulation
