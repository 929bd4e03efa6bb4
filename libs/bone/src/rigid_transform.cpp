#include "osteo/bone/rigid_transform.h"

#include <cmath>

namespace osteo {

RigidTransform rotation_about(Vec3 point, Vec3 axis, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  RigidTransform r;
  const Vec3 unit[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (std::size_t k = 0; k < 3; ++k) r.rotation.column[k] = unit[k] * c + cross(axis, unit[k]) * s + axis * (dot(axis, unit[k]) * (1 - c));
  r.shift_mm = point - r.rotation * point;
  return r;
}

}  // namespace osteo
