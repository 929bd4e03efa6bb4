#include "osteo/simulation/bone/posture.h"

#include <numbers>

#include "osteo/core/base/portable_math.h"

namespace osteo::inline simulation {

Vec3 down_of(Posture posture, double head_turned_deg) {
  Vec3 down{0, 1, 0};
  if (posture == Posture::prone) down = {0, -1, 0};
  if (posture == Posture::sitting) down = {0, 0, -1};
  if (posture == Posture::left_side) down = {1, 0, 0};
  if (posture == Posture::right_side) down = {-1, 0, 0};
  // The face from -y towards +x: the head turns so, and what is down turns the other way in it.
  const auto [s, c] = portable::sin_cos(head_turned_deg * std::numbers::pi / 180);
  return normalized({c * down.x + s * down.y, c * down.y - s * down.x, down.z});
}

PostureNow posture_of(Vec3 down) {
  if (down.z * down.z > 0.5) return {Posture::sitting, 0};
  const double degrees = portable::atan2(down.x, down.y) * 180 / std::numbers::pi;
  if (degrees > 90.001) return {Posture::prone, degrees - 180};
  if (degrees < -90.001) return {Posture::prone, degrees + 180};
  return {Posture::supine, degrees};
}

}  // namespace osteo::inline simulation
