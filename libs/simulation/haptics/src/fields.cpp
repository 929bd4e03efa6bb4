#include "osteo/simulation/haptics/fields.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>

#include "osteo/core/base/error.h"
#include "osteo/core/base/portable_math.h"
#include "osteo/geometry/grid/brick_grid.h"
#include "osteo/geometry/grid/sampler.h"

namespace osteo::inline simulation {
namespace {

using F4 = float __attribute__((vector_size(16)));

// The same of the cubic B-spline.
void spline_weights(float t, float w[4], float d[4]) {
  const float s = 1 - t, t2 = t * t, s2 = s * s;
  w[0] = s2 * s / 6;
  w[1] = (4 - 6 * t2 + 3 * t2 * t) / 6;
  w[2] = (4 - 6 * s2 + 3 * s2 * s) / 6;
  w[3] = t2 * t / 6;
  d[0] = -0.5F * s2;
  d[1] = -2 * t + 1.5F * t2;
  d[2] = 2 * s - 1.5F * s2;
  d[3] = 0.5F * t2;
}

// Values of a line to the coefficients of the spline through them, the line mirrored at its ends.
void to_spline(std::vector<double>& line) {
  const double pole = std::sqrt(3.0) - 2;
  const std::size_t n = line.size();
  double first = line[0], power = pole;
  for (std::size_t i = 1; i < n && i < 40; ++i, power *= pole) first += power * line[i];
  line[0] = first;
  for (std::size_t i = 1; i < n; ++i) line[i] += pole * line[i - 1];
  line[n - 1] = pole / (pole * pole - 1) * (line[n - 1] + pole * line[n - 2]);
  for (std::size_t i = n - 1; i-- > 0;) line[i] = pole * (line[i + 1] - line[i]);
  for (double& v : line) v *= 6;
}

// Weights of Catmull-Rom's cubic at t in [0, 1] for the four neighbours, and their slopes.
void weights(float t, float w[4], float d[4]) {
  const float t2 = t * t, t3 = t2 * t;
  w[0] = -0.5F * t + t2 - 0.5F * t3;
  w[1] = 1 - 2.5F * t2 + 1.5F * t3;
  w[2] = 0.5F * t + 2 * t2 - 1.5F * t3;
  w[3] = -0.5F * t2 + 0.5F * t3;
  d[0] = -0.5F + 2 * t - 1.5F * t2;
  d[1] = -5 * t + 4.5F * t2;
  d[2] = 0.5F + 4 * t - 4.5F * t2;
  d[3] = -t + 1.5F * t2;
}

}  // namespace

CubicField::CubicField(const Frame& frame, std::vector<float> values, FieldCurve curve)
    : frame_(frame), values_(std::move(values)), curve_(curve) {
  prepare();
  if (curve_ == FieldCurve::catmull_rom) return;
  // Along one axis after the other.
  std::vector<double> line;
  std::size_t stride = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto n = static_cast<std::size_t>(frame_.dims[axis]);
    line.resize(n);
    for (std::size_t at = 0; at < values_.size(); ++at) {
      if (at / stride % n != 0) continue;
      for (std::size_t i = 0; i < n; ++i) line[i] = static_cast<double>(values_[at + i * stride]);
      to_spline(line);
      for (std::size_t i = 0; i < n; ++i) values_[at + i * stride] = static_cast<float>(line[i]);
    }
    stride *= n;
  }
}

CubicField::CubicField(const SparseGrid& distance_mm) : frame_(distance_mm.frame) {
  const BrickGrid bricks = to_bricks(distance_mm, true);
  values_.assign(frame_.voxel_count(), static_cast<float>(distance_mm.background));
  const auto& n = frame_.dims;
  for (std::uint32_t b = 0; b < bricks.brick_count(); ++b) {
    const float* const v = bricks.values_of_brick(b);
    const Ijk o = bricks.brick_coordinate(b);
    for (int c = 0; c < BrickGrid::kVoxels; ++c) {
      const int i = o.i * 8 + (c & 7), j = o.j * 8 + (c >> 3 & 7), k = o.k * 8 + (c >> 6);
      if (i >= n[0] || j >= n[1] || k >= n[2]) continue;
      values_[(static_cast<std::size_t>(k) * n[1] + j) * n[0] + i] = v[c];
    }
  }
  prepare();
}

void CubicField::prepare() {
  const auto& f = frame_;
  if (f.dims[0] < 4 || f.dims[1] < 4 || f.dims[2] < 4 || values_.size() != f.voxel_count())
    throw Error(ExitCode::usage, "a field needs a value for each voxel, and at least 4 voxels along each axis");
  if (std::abs(f.spacing_mm.x - f.spacing_mm.y) > 1e-6 * f.spacing_mm.x ||
      std::abs(f.spacing_mm.x - f.spacing_mm.z) > 1e-6 * f.spacing_mm.x)
    throw Error(ExitCode::usage, "a field needs voxels that are cubes", "resample the grid first");
  to_index_ = transposed(f.direction);
}

Clearance CubicField::operator()(Vec3 world_mm) const {
  const double h = frame_.spacing_mm.x;
  const Vec3 x = (to_index_ * (world_mm - frame_.origin_mm)) / h;
  int lo[3];
  float w[3][4], d[3][4];
  for (std::size_t a = 0; a < 3; ++a) {
    const double last = frame_.dims[a] - 3;
    if (!(x[a] >= 1 && x[a] <= last + 1)) {
      // Beyond the grid: free, and as far as it is from the box.
      Vec3 out;
      for (std::size_t c = 0; c < 3; ++c)
        out[c] = x[c] - std::clamp(x[c], 1.0, static_cast<double>(frame_.dims[c] - 2));
      const double n = std::max(length(out), 1e-9);
      Clearance c;
      c.normal = c.gradient = frame_.direction * (out / n);
      c.value_mm = std::max(n, 1.0) * h;
      return c;
    }
    lo[a] = std::min(static_cast<int>(x[a]), frame_.dims[a] - 3);
    const auto t = static_cast<float>(x[a] - lo[a]);
    if (curve_ == FieldCurve::spline)
      spline_weights(t, w[a], d[a]);
    else
      weights(t, w[a], d[a]);
  }
  const std::size_t row = static_cast<std::size_t>(frame_.dims[0]),
                    layer = row * static_cast<std::size_t>(frame_.dims[1]);
  const float* const base = values_.data() + static_cast<std::size_t>(lo[2] - 1) * layer +
                            static_cast<std::size_t>(lo[1] - 1) * row + static_cast<std::size_t>(lo[0] - 1);
  F4 plain{}, along_y{}, along_z{};
  for (std::size_t k = 0; k < 4; ++k) {
    F4 sum{}, slope{};
    for (std::size_t j = 0; j < 4; ++j) {
      F4 v;
      std::memcpy(&v, base + k * layer + j * row, sizeof v);
      sum += v * w[1][j];
      slope += v * d[1][j];
    }
    plain += sum * w[2][k];
    along_y += slope * w[2][k];
    along_z += sum * d[2][k];
  }
  const auto dot4 = [](F4 a, const float* b) {
    return static_cast<double>((a[0] * b[0] + a[1] * b[1]) + (a[2] * b[2] + a[3] * b[3]));
  };
  Clearance c;
  c.value_mm = dot4(plain, w[0]) - radius_mm_;
  c.gradient = frame_.direction * (Vec3{dot4(plain, d[0]), dot4(along_y, w[0]), dot4(along_z, w[0])} / h);
  c.normal = normalized(c.gradient);
  return c;
}

MeshField::MeshField(const TriangleSoup& soup, bool shading, const Context& context)
    : soup_(welded(soup)), tree_(soup_, context), shading_(shading) {
  const BoxMm box = bounds_of(soup_);
  size_mm_ = length(box.hi - box.lo);
  const std::size_t n = soup_.triangles.size();
  face_normal_.resize(n);
  corner_normal_.resize(soup_.points_mm.size());
  edge_normal_.resize(n);
  std::map<std::pair<std::uint32_t, std::uint32_t>, Vec3> edges;
  const auto key = [](std::uint32_t a, std::uint32_t b) { return std::pair{std::min(a, b), std::max(a, b)}; };
  for (std::size_t t = 0; t < n; ++t) {
    const auto& tri = soup_.triangles[t];
    Vec3 p[3];
    for (std::size_t c = 0; c < 3; ++c) p[c] = soup_.points_mm[tri[c]];
    face_normal_[t] = normalized(cross(p[1] - p[0], p[2] - p[0]));  // zero for a triangle without area: it has no say
    for (std::size_t c = 0; c < 3; ++c) {
      const Vec3 u = normalized(p[(c + 1) % 3] - p[c]), v = normalized(p[(c + 2) % 3] - p[c]);
      corner_normal_[tri[c]] += face_normal_[t] * portable::acos(std::clamp(dot(u, v), -1.0, 1.0));
      edges[key(tri[c], tri[(c + 1) % 3])] += face_normal_[t];
    }
  }
  for (Vec3& v : corner_normal_) v = normalized(v);
  for (std::size_t t = 0; t < n; ++t) {
    const auto& tri = soup_.triangles[t];
    for (std::size_t c = 0; c < 3; ++c) edge_normal_[t][c] = normalized(edges[key(tri[c], tri[(c + 1) % 3])]);
  }
}

Clearance MeshField::operator()(Vec3 x) const {
  const ClosestPoint near = tree_.closest(x, hint_);
  hint_ = near.triangle;
  const auto& tri = soup_.triangles[near.triangle];
  Vec3 outward;
  switch (near.feature) {
    case Feature::face:
      outward = face_normal_[near.triangle];
      break;
    case Feature::edge_ab:
    case Feature::edge_bc:
    case Feature::edge_ca:
      outward = edge_normal_[near.triangle]
                            [static_cast<std::size_t>(near.feature) - static_cast<std::size_t>(Feature::edge_ab)];
      break;
    default:
      outward =
          corner_normal_[tri[static_cast<std::size_t>(near.feature) - static_cast<std::size_t>(Feature::corner_a)]];
  }
  const Vec3 away = x - near.point_mm;
  const double sign = dot(away, outward) < 0 ? -1 : 1;
  Clearance c;
  c.value_mm = sign * near.distance_mm - radius_mm_;
  // On the surface itself, where the difference is rounding, the feature's own normal is the gradient.
  c.gradient = near.distance_mm > 1e-12 * size_mm_ ? away * (sign / near.distance_mm) : outward;
  c.normal = c.gradient;
  if (shading_) {
    // Barycentric weights of the nearest point.
    const Vec3 a = soup_.points_mm[tri[0]], b = soup_.points_mm[tri[1]], d = soup_.points_mm[tri[2]];
    const Vec3 whole = cross(b - a, d - a);
    const double area2 = dot(whole, whole);
    if (area2 > 0) {
      const double wb = dot(cross(near.point_mm - a, d - a), whole) / area2,
                   wd = dot(cross(b - a, near.point_mm - a), whole) / area2;
      const Vec3 n = normalized(corner_normal_[tri[0]] * (1 - wb - wd) + corner_normal_[tri[1]] * wb +
                                corner_normal_[tri[2]] * wd);
      // Where faces meet at an angle, as at the rim of a hole, an interpolated normal would point nowhere useful.
      if (dot(n, face_normal_[near.triangle]) > 0.7) c.normal = n;
    }
  }
  return c;
}

}  // namespace osteo::inline simulation
