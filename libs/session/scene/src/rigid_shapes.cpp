#include "rigid_shapes.h"

#include <algorithm>
#include <cmath>

#include "osteo/geometry/grid/sampler.h"

namespace osteo::inline session {

RigidShape::Ball ToolShape::bounds() const {
  return {at_ + axis_ * (cone_.start_mm + cone_.length_mm / 2), cone_.length_mm / 2 + cone_.largest_radius_mm()};
}

std::vector<RigidShape::Ball> ToolShape::balls() const {
  const int n =
      static_cast<int>(std::ceil(cone_.length_mm / (0.25 * std::min(cone_.start_radius_mm, cone_.end_radius_mm)))) + 1;
  std::vector<Ball> balls;
  for (int i = 0; i < n; ++i) {
    const double along = n > 1 ? cone_.length_mm * i / (n - 1) : 0;
    balls.push_back(
        {at_ + axis_ * (cone_.start_mm + along),
         cone_.start_radius_mm + (n > 1 ? (cone_.end_radius_mm - cone_.start_radius_mm) * i / (n - 1) : 0)});
  }
  return balls;
}

double ToolShape::distance_mm(Vec3 at, Vec3& outwards) const {
  const Vec3 p = at - at_;
  const double z = dot(p, axis_), axial = z - cone_.start_mm;
  const Vec3 off = p - axis_ * z;
  const double radial = length(off), foot = cone_.foot_mm(radial, axial);
  const Vec3 from_foot = off + axis_ * (axial - foot);
  const double far = length(from_foot);
  outwards = far > 0 ? from_foot / far : Vec3{};
  return far - cone_.radius_at_mm(foot);
}

double LiveBone::density(Vec3 at) const {
  double most = 0;
  for (const PlacedBody& placed : world_.bodies()) {
    const BrickGrid& bone = placed.body->bone;
    const Vec3 x = bone.frame().index_from_world(placed.world_from_body.inverse()(at));
    if (!(std::abs(x.x) < 1e6 && std::abs(x.y) < 1e6 && std::abs(x.z) < 1e6)) continue;
    most = std::max(most, static_cast<double>(linear_at(bone, x)));
  }
  return most;
}

double LiveBone::distance_mm(Vec3 at, Vec3& outwards) const {
  outwards = {};
  const double here = density(at);
  const double voxel = world_.bodies().front().body->bone.frame().spacing_mm.x;
  if (!(here > 0.02)) return voxel;
  // Where the density falls: from a stencil as wide as it takes to see the surface from here.
  Vec3 fall{};
  for (double reach = voxel; reach <= kReachMm && length(fall) < 0.05; reach *= 2) {
    for (std::size_t a = 0; a < 3; ++a) {
      Vec3 e{};
      e[a] = reach;
      fall[a] = density(at - e) - density(at + e);
    }
  }
  if (length(fall) < 0.05) return -kReachMm;  // so deep that no way out is seen: no direction, no push
  outwards = normalized(fall);
  if (here < 0.5) return (0.5 - here) * voxel;
  double last = here;
  for (double t = voxel / 2; t <= kReachMm; t += voxel / 2) {
    const double now = density(at + outwards * t);
    if (now < 0.5) return -(t - voxel / 2 * (0.5 - now) / (last - now));
    last = now;
  }
  return -kReachMm;
}

}  // namespace osteo::inline session
