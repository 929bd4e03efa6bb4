// A bone as a solid: the exact distance to its mesh, made smooth.
#include <cmath>
#include <map>
#include <mutex>

#include "osteo/assessment/ground_truth/solid.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/portable_math.h"
#include "osteo/geometry/distance/distance_map.h"
#include "solids_inside.h"

namespace osteo::inline assessment::truth {
namespace {

constexpr double kHalf = 40, kStepS = 1e-3, kSpeed = 20, kLongestS = 120;

CubicField field_of(const TriangleSoup& soup, double spacing, const Context& context) {
  Frame f;
  const int n = static_cast<int>(std::floor(2 * kHalf / spacing)) + 1;
  f.dims = {n, n, n};
  f.spacing_mm = {spacing, spacing, spacing};
  const double lo = -spacing * (n - 1) / 2;
  f.origin_mm = {lo, lo, lo};
  const DistanceMap map = DistanceMapper(soup, f, context).map({}, context);
  std::vector<float> values(f.voxel_count());
  for (std::size_t b = 0; b < map.bricks.size(); ++b) {
    const Ijk o = map.bricks[b];
    for (int c = 0; c < DistanceMap::kVoxels; ++c) {
      const int i = o.i * 8 + (c & 7), j = o.j * 8 + (c >> 3 & 7), k = o.k * 8 + (c >> 6);
      if (i >= n || j >= n || k >= n) continue;
      values[(static_cast<std::size_t>(k) * static_cast<std::size_t>(n) + static_cast<std::size_t>(j)) *
                 static_cast<std::size_t>(n) +
             static_cast<std::size_t>(i)] =
          static_cast<float>(map.distance_mm[b * DistanceMap::kVoxels + static_cast<std::size_t>(c)]);
    }
  }
  return CubicField(f, std::move(values), FieldCurve::spline);
}

class Bone final : public Solid {
 public:
  Bone(TriangleSoup soup, double spacing, const Context& context)
      : Solid("bone", kHalf, 8), soup_(std::move(soup)), field_(field_of(soup_, spacing, context)) {}

  [[nodiscard]] double clearance_mm(Vec3 at) const override { return field_(at).value_mm; }
  [[nodiscard]] Vec3 gradient(Vec3 at) const override { return field_(at).gradient; }
  [[nodiscard]] Vec3 place(double s, const PathParams& path) const override {
    if (path.closed) throw Error(ExitCode::usage, "the way over the bone does not close");
    if (!(s >= -0.5 && s < kLongestS - 1))
      throw Error(ExitCode::usage, "the way over the bone takes 2 minutes at most");
    const std::vector<Vec3>& way = way_of(path.seed);
    const double at = (s + 1) / kStepS;
    const auto i = static_cast<std::size_t>(at);
    const double t = at - static_cast<double>(i), t2 = t * t, t3 = t2 * t;
    return foot(way[i - 1] * (-0.5 * t + t2 - 0.5 * t3) + way[i] * (1 - 2.5 * t2 + 1.5 * t3) +
                way[i + 1] * (0.5 * t + 2 * t2 - 1.5 * t3) + way[i + 2] * (-0.5 * t2 + 0.5 * t3));
  }
  [[nodiscard]] TriangleSoup mesh(int) const override { return soup_; }

 private:
  // Straight on along the surface, turning as two sines say: 20 mm/s, a place each millisecond from a second before the
  // beginning.
  [[nodiscard]] const std::vector<Vec3>& way_of(std::uint64_t seed) const {
    const std::lock_guard lock(mutex_);
    std::vector<Vec3>& way = ways_[seed];
    if (!way.empty()) return way;
    const Phases f(seed);
    // From outside to the first surface, from where the seed says; where there is none on the way, as through a ring,
    // from further round.
    Vec3 at;
    bool met = false;
    for (int attempt = 0; attempt < 64 && !met; ++attempt) {
      const auto a = portable::sin_cos(f[0] + 0.61 * attempt), b = portable::sin_cos(f[1] + 2.4 * attempt);
      const Vec3 from{a.sin * b.cos, a.sin * b.sin, a.cos};
      for (double out = kHalf - 2; out > 1 && !met; out -= 0.05) {
        at = from * out;
        met = clearance_mm(at) <= 0.05;
      }
      at = foot(at);
      met = met && std::abs(clearance_mm(at)) < 1e-4;
    }
    if (!met)
      throw Error(ExitCode::failed, "no way over the bone begins: from no side is there a surface towards its middle");
    Vec3 heading = any_perpendicular(normal(at));
    for (double s = -1; s < kLongestS; s += kStepS) {
      way.push_back(at);
      const Vec3 n = normal(at);
      const double turn =
          kStepS * (1.1 * portable::sin_cos(0.7 * s + f[2]).sin + 0.6 * portable::sin_cos(1.9 * s + f[3]).sin);
      heading += cross(n, heading) * turn;
      heading = normalized(heading - n * dot(heading, n));
      at = foot(at + heading * (kSpeed * kStepS));
    }
    return way;
  }

  TriangleSoup soup_;
  CubicField field_;
  mutable std::mutex mutex_;
  mutable std::map<std::uint64_t, std::vector<Vec3>> ways_;
};

class Scanned final : public Solid {
 public:
  Scanned(TriangleSoup soup, double half, const Context& context)
      : Solid("scan", half, 0.5), soup_(std::move(soup)), field_(soup_, false, context) {}
  // The field remembers the last triangle: one at a time.
  [[nodiscard]] double clearance_mm(Vec3 at) const override {
    const std::lock_guard lock(mutex_);
    return field_(at).value_mm;
  }
  [[nodiscard]] Vec3 gradient(Vec3 at) const override {
    const std::lock_guard lock(mutex_);
    return field_(at).gradient;
  }
  [[nodiscard]] Vec3 place(double, const PathParams&) const override {
    throw Error(ExitCode::usage, "there is no way over a scan but the recorded one");
  }
  [[nodiscard]] TriangleSoup mesh(int) const override { return soup_; }

 private:
  TriangleSoup soup_;
  MeshField field_;
  mutable std::mutex mutex_;
};

}  // namespace

std::shared_ptr<const Solid> make_mesh_solid(const TriangleSoup& mesh, const Context& context) {
  TriangleSoup soup = welded(mesh);
  require_sound(soup);
  if (soup.triangles.empty() || !is_closed(soup))
    throw Error(ExitCode::usage, "the surface is not closed: what is inside is not defined",
                "'osteo repair' may close it");
  const BoxMm box = bounds_of(soup);
  double half = 0;
  for (std::size_t a = 0; a < 3; ++a) half = std::max({half, std::abs(box.lo[a]), std::abs(box.hi[a])});
  if (half > 1000)
    throw Error(ExitCode::usage, "the surface lies farther than a metre from the origin",
                "are its coordinates millimetres?");
  return std::make_shared<Scanned>(std::move(soup), 1.15 * half, context);
}

std::shared_ptr<const Solid> make_bone(const TriangleSoup& mesh, double spacing_mm, const Context& context) {
  if (!(spacing_mm >= 0.2 && spacing_mm <= 5))
    throw Error(ExitCode::usage, "the bone's spacing lies between 0.2 and 5 mm");
  TriangleSoup soup = welded(mesh);
  require_sound(soup);
  if (soup.triangles.empty() || !is_closed(soup))
    throw Error(ExitCode::usage, "the mesh of the bone is not closed: what is inside is not defined",
                "'osteo repair' may close it");
  const BoxMm box = bounds_of(soup);
  const Vec3 middle = (box.lo + box.hi) * 0.5, size = box.hi - box.lo;
  const double shrink = 70 / std::max({size.x, size.y, size.z});
  for (Vec3& p : soup.points_mm) p = (p - middle) * shrink;
  return std::make_shared<Bone>(std::move(soup), spacing_mm, context);
}

}  // namespace osteo::inline assessment::truth
