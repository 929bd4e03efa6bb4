#include "osteo/core/data/rigid_transform.h"

#include "osteo/core/base/portable_math.h"

namespace osteo {

RigidTransform rotation_about(Vec3 point, Vec3 axis, double angle) {
  const auto [s, c] = portable::sin_cos(angle);
  RigidTransform r;
  const Vec3 unit[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (std::size_t k = 0; k < 3; ++k)
    r.rotation.column[k] = unit[k] * c + cross(axis, unit[k]) * s + axis * (dot(axis, unit[k]) * (1 - c));
  r.shift_mm = point - r.rotation * point;
  return r;
}

Mat3 frame_of_axis(Vec3 axis) {
  // R. Rodrigues: c = cosine, v = z x axis, R = 1 + [v] + [v]^2 / (1 + c).
  const double c = axis.z;
  if (c < -1 + 1e-12) return {{Vec3{1, 0, 0}, Vec3{0, -1, 0}, Vec3{0, 0, -1}}};
  const Vec3 v{-axis.y, axis.x, 0};
  const double k = 1 / (1 + c);
  return {
      {Vec3{1 - v.y * v.y * k, v.x * v.y * k, -v.y}, Vec3{v.x * v.y * k, 1 - v.x * v.x * k, v.x}, Vec3{v.y, -v.x, c}}};
}

}  // namespace osteo
