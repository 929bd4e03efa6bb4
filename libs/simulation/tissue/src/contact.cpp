#include "osteo/simulation/tissue/contact.h"

#include <algorithm>
#include <cmath>

#include "osteo/core/base/error.h"
#include "osteo/geometry/distance/distance_map.h"

namespace osteo::inline simulation {

double BallShape::distance_mm(Vec3 at, Vec3& outwards) const {
  const Vec3 off = at - ball_.centre_mm;
  const double far = length(off);
  outwards = far > 0 ? off / far : Vec3{};
  return far - ball_.radius_mm;
}

SurfaceShape::SurfaceShape(const TriMesh& surface, Vec3 lo, Vec3 hi, double spacing, const Context& context)
    : lo_(lo), spacing_(spacing) {
  Frame frame;
  frame.spacing_mm = {spacing, spacing, spacing};
  frame.origin_mm = lo;
  double voxels = 1;
  for (std::size_t a = 0; a < 3; ++a) {
    const double n = std::ceil(std::max(0.0, hi[a] - lo[a]) / spacing) + 2;
    voxels *= n;
    if (!(voxels <= 2e8))
      throw Error(ExitCode::usage,
                  "a distance map of " + std::to_string(voxels) + " voxels for what tissue touches is too large",
                  "take larger voxels");
    dims_[a] = static_cast<std::size_t>(n);
    frame.dims[a] = static_cast<int>(n);
  }
  const DistanceMap map = DistanceMapper(soup_of(surface), frame, context).map({}, context);
  distance_.assign(dims_[0] * dims_[1] * dims_[2], 0);
  for (std::size_t b = 0; b < map.bricks.size(); ++b) {
    for (std::size_t v = 0; v < static_cast<std::size_t>(DistanceMap::kVoxels); ++v) {
      const std::size_t i = static_cast<std::size_t>(map.bricks[b].i) * 8 + (v & 7),
                        j = static_cast<std::size_t>(map.bricks[b].j) * 8 + (v >> 3 & 7),
                        k = static_cast<std::size_t>(map.bricks[b].k) * 8 + (v >> 6);
      if (i < dims_[0] && j < dims_[1] && k < dims_[2])
        distance_[(k * dims_[1] + j) * dims_[0] + i] =
            static_cast<float>(map.distance_mm[b * DistanceMap::kVoxels + v]);
    }
  }
}

RigidShape::Ball SurfaceShape::bounds() const {
  const Vec3 size =
      Vec3{static_cast<double>(dims_[0] - 1), static_cast<double>(dims_[1] - 1), static_cast<double>(dims_[2] - 1)} *
      spacing_;
  return {lo_ + size / 2, length(size) / 2};
}

double SurfaceShape::distance_mm(Vec3 at, Vec3& outwards) const {
  const Vec3 x = (at - lo_) / spacing_;
  std::size_t cell[3];
  double t[3];
  for (std::size_t a = 0; a < 3; ++a) {
    if (!(x[a] >= 0) || !(x[a] <= static_cast<double>(dims_[a] - 1))) {
      outwards = {};
      return spacing_;
    }
    cell[a] = std::min(static_cast<std::size_t>(x[a]), dims_[a] - 2);
    t[a] = x[a] - static_cast<double>(cell[a]);
  }
  double d[8];
  for (std::size_t c = 0; c < 8; ++c)
    d[c] = static_cast<double>(
        distance_[((cell[2] + (c >> 2)) * dims_[1] + cell[1] + (c >> 1 & 1)) * dims_[0] + cell[0] + (c & 1)]);
  const auto mix = [](double a, double b, double s) { return a + (b - a) * s; };
  const double y0 = mix(d[0], d[1], t[0]), y1 = mix(d[2], d[3], t[0]), y2 = mix(d[4], d[5], t[0]),
               y3 = mix(d[6], d[7], t[0]);
  const double z0 = mix(y0, y1, t[1]), z1 = mix(y2, y3, t[1]);
  const Vec3 slope{mix(mix(d[1] - d[0], d[3] - d[2], t[1]), mix(d[5] - d[4], d[7] - d[6], t[1]), t[2]),
                   mix(y1 - y0, y3 - y2, t[2]), z1 - z0};
  outwards = slope / spacing_;
  return mix(z0, z1, t[2]);
}

}  // namespace osteo::inline simulation
