// Bone from thick slices: the boundary between them by values and by outlines, against bodies that are known exactly.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <random>

#include "bench.h"
#include "osteo/core/base/error.h"
#include "osteo/geometry/grid/brick_grid.h"
#include "osteo/geometry/grid/resample.h"
#include "osteo/geometry/grid/sampler.h"
#include "osteo/geometry/mesh/bone_surface.h"
#include "osteo/imaging/image/phantom.h"
#include "osteo/imaging/image/threshold.h"

namespace osteo {
namespace {

// Depth below the surface in mm, exact near it.
using Depth = std::function<double(Vec3)>;

struct Body {
  const char* name;
  Depth depth;
  double wall_mm = 0;  // a wall of this thickness across `normal`
  Vec3 normal{};
};

// Like a scanner: pixels of 0.7 mm in slices as thick as they lie apart, 1000 HU in 0, point spread of 0.4 mm in the
// slice, noise of 20 HU.
Image scan(const Depth& depth, double slice_mm) {
  Frame f;
  f.spacing_mm = {0.7, 0.7, slice_mm};
  f.dims = {72, 72, static_cast<int>(50 / slice_mm)};
  f.origin_mm = {-24.7, -24.6, -0.5 * slice_mm * (f.dims[2] - 1) + 0.13};
  const auto v = make_voxels<std::int16_t>(f.voxel_count());
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 20), spread(0, 0.4);
  std::uniform_real_distribution<double> pixel(-0.35, 0.35);
  std::vector<Vec3> offsets;
  const int layers = std::max(4, static_cast<int>(std::lround(slice_mm / 0.1)));
  for (int n = 0; n < 12 * layers; ++n)
    offsets.push_back({spread(random) + pixel(random), spread(random) + pixel(random),
                       ((n % layers + 0.5) / layers - 0.5) * slice_mm});
  std::size_t at = 0;
  for (int k = 0; k < f.dims[2]; ++k)
    for (int j = 0; j < f.dims[1]; ++j)
      for (int i = 0; i < f.dims[0]; ++i) {
        const Vec3 p = f.world_from_index({double(i), double(j), double(k)});
        const double d = depth(p);
        double share = d > 0 ? 1 : 0;
        if (std::abs(d) < 2.2 + 0.5 * slice_mm) {
          share = 0;
          for (const Vec3& o : offsets) share += depth(p + o) > 0 ? 1.0 / static_cast<double>(offsets.size()) : 0;
        }
        v[at++] = static_cast<std::int16_t>(std::lround(1000 * share + noise(random)));
      }
  return {f, v};
}

double capsule(Vec3 p, Vec3 a, Vec3 b, double r) {
  const Vec3 d = b - a;
  const double t = std::clamp(dot(p - a, d) / dot(d, d), 0.0, 1.0);
  return r - length(p - a - d * t);
}

std::vector<Body> bodies() {
  std::vector<Body> all;
  all.push_back({"ellipsoid 14 x 17 x 12", [](Vec3 p) {
                   const Vec3 q{p.x / 14, p.y / 17, p.z / 12}, g{p.x / 196, p.y / 289, p.z / 144};
                   const double n = length(q);
                   return n > 0 ? n * (1 - n) / length(g) : 12.0;
                 }});
  for (const double degrees : {20.0, 45.0, 70.0}) {
    const double a = degrees * M_PI / 180;
    const Vec3 n = normalized({std::sin(a), 0.2 * std::sin(a), std::cos(a)});
    static char names[3][40];
    char* const name = names[degrees < 30 ? 0 : degrees < 60 ? 1 : 2];
    std::snprintf(name, 40, "plane, %.0f degrees off the slices", degrees);
    all.push_back({name, [n](Vec3 p) { return 0.4 - dot(p, n); }});
  }
  const Vec3 axis = normalized({0.6, 0.2, 0.8});
  all.push_back({"cylinder of 5, oblique", [axis](Vec3 p) { return 5 - length(p - axis * dot(p, axis)); }});
  all.push_back({"forked, branches of 3", [](Vec3 p) {
                   return std::max({capsule(p, {0, 0, -30}, {0, 0, 0}, 4), capsule(p, {0, 0, 0}, {14, 3, 22}, 3),
                                    capsule(p, {0, 0, 0}, {-12, -4, 22}, 3)});
                 }});
  for (const double wall : {1.0, 2.0})
    for (const double degrees : {30.0, 60.0, 90.0}) {
      const double a = degrees * M_PI / 180;
      const Vec3 n = normalized({std::sin(a), 0.15, std::cos(a)});
      static std::vector<std::string> names(6);
      std::string& name = names[(wall > 1 ? 3 : 0) + (degrees < 45 ? 0 : degrees < 75 ? 1 : 2)];
      name = "wall of " + std::to_string(static_cast<int>(wall)) + ", " + std::to_string(static_cast<int>(degrees)) +
             " degrees";
      all.push_back({name.c_str(), [n, wall](Vec3 p) { return 0.5 * wall - std::abs(dot(p, n) - 0.3); }, wall, n});
    }
  return all;
}

struct Result {
  double volume_percent = 0, mean = 0, p95 = 0, normals = 0, broken_percent = 0, ms = 0;
};

Result measure(const Body& body, double slice_mm, Between between, const Context& context) {
  const Image ct = scan(body.depth, slice_mm);
  ThresholdParams t;
  t.lower = body.wall_mm > 0 ? 200 : 500;
  const Labels mask = threshold(ct, t);
  ResampleParams r;
  r.lower = t.lower;
  r.between = between;
  Result out;
  const auto begin = std::chrono::steady_clock::now();
  const ResampledBone bone = resample_bone(ct, mask, r, context);
  out.ms = 1000 * std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const BrickGrid bricks = to_bricks(bone.density);
  const TriMesh mesh = surface_nets(bricks, 0.5F, context).mesh;
  const auto inner = [](Vec3 p) { return std::abs(p.x) < 20 && std::abs(p.y) < 20 && std::abs(p.z) < 19; };
  std::vector<double> off;
  double square = 0, area = 0;
  for (const auto& tri : mesh.triangles) {
    const Vec3 a = from_floats(mesh.points_mm[tri[0]]), b = from_floats(mesh.points_mm[tri[1]]),
               c = from_floats(mesh.points_mm[tri[2]]), m = (a + b + c) / 3;
    if (!inner(m)) continue;
    off.push_back(std::abs(body.depth(m)));
    const Vec3 n = cross(b - a, c - a);
    constexpr double e = 1e-4;
    const Vec3 g{body.depth(m - Vec3{e, 0, 0}) - body.depth(m + Vec3{e, 0, 0}),
                 body.depth(m - Vec3{0, e, 0}) - body.depth(m + Vec3{0, e, 0}),
                 body.depth(m - Vec3{0, 0, e}) - body.depth(m + Vec3{0, 0, e})};
    const double angle = std::acos(std::clamp(dot(normalized(n), normalized(g)), -1.0, 1.0)) * 180 / M_PI;
    square += length(n) * angle * angle;
    area += length(n);
  }
  std::sort(off.begin(), off.end());
  for (const double o : off) out.mean += o / static_cast<double>(off.size());
  out.p95 = off.empty() ? 0 : off[off.size() * 95 / 100];
  out.normals = area > 0 ? std::sqrt(square / area) : 0;
  // Volume within the box, against the truth on a fine lattice.
  double volume = 0, truth = 0;
  const Frame& f = bricks.frame();
  for (VoxelKey v = 0; v < bricks.brick_count() * BrickGrid::kVoxels; ++v) {
    const Ijk x = bricks.coordinate(v);
    if (inner(f.world_from_index({double(x.i), double(x.j), double(x.k)})))
      volume += static_cast<double>(bricks.value(v)) * f.voxel_volume_mm3();
  }
  for (double z = -18.9; z < 19; z += 0.2)
    for (double y = -19.9; y < 20; y += 0.2)
      for (double x = -19.9; x < 20; x += 0.2) truth += body.depth({x, y, z}) > 0 ? 0.008 : 0;
  out.volume_percent = 100 * (volume / truth - 1);
  if (body.wall_mm > 0) {
    const GridSampler density(bone.density);
    const Vec3 u = any_perpendicular(body.normal), w = cross(body.normal, u);
    int lines = 0, broken = 0;
    for (double a = -16; a <= 16; a += 0.31)
      for (double b = -16; b <= 16; b += 0.31) {
        const Vec3 q = u * a + w * b;
        if (!inner(q)) continue;
        float best = 0;
        for (double c = -1.5; c <= 2.1; c += 0.1) best = std::max(best, density.nearest(q + body.normal * c));
        ++lines;
        broken += best < 0.5F;
      }
    out.broken_percent = 100.0 * broken / lines;
  }
  return out;
}

// The phantom's left ear: how far the surface lies from where bone's tissue begins, along its normal.
void measure_phantom(double slice_mm, const Context& context) {
  PhantomParams p;
  p.region = PhantomRegion::temporal;
  p.spacing_mm = 0.6;
  p.slice_mm = slice_mm;
  const Phantom phantom = make_phantom(p, context);
  const HeadAnatomy head(0);
  ThresholdParams t;
  t.lower = 350;
  const Labels mask = threshold(phantom.ct, t, context);
  for (const Between between : {Between::values, Between::outlines}) {
    ResampleParams r;
    r.lower = t.lower;
    r.between = between;
    const auto begin = std::chrono::steady_clock::now();
    const ResampledBone bone = resample_bone(phantom.ct, mask, r, context);
    const double ms = 1000 * std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    const TriMesh mesh = surface_nets(to_bricks(bone.density), 0.5F, context).mesh;
    std::vector<double> off;
    for (std::size_t i = 0; i < mesh.points_mm.size(); i += 7) {
      const Vec3 at = from_floats(mesh.points_mm[i]), n = from_floats(mesh.normals[i]);
      const Vec3 x = phantom.ct.frame.index_from_world(at);
      bool inner = true;
      for (std::size_t a = 0; a < 3; ++a) {
        const double margin = 3 / phantom.ct.frame.spacing_mm[a];
        inner = inner && x[a] > margin && x[a] < phantom.ct.frame.dims[a] - 1 - margin;
      }
      if (!inner) continue;
      // The nearest place on the line where bone and what is none meet.
      double best = 4;
      bool last = is_bone(head.tissue(at - n * 4));
      for (double d = -4; d < 4; d += 0.05) {
        const bool now = is_bone(head.tissue(at + n * (d + 0.05)));
        if (now != last) best = std::min(best, std::abs(d + 0.025));
        last = now;
      }
      off.push_back(best);
    }
    std::sort(off.begin(), off.end());
    double mean = 0;
    for (const double o : off) mean += o / static_cast<double>(off.size());
    std::printf("| phantom's ear | %g | %s | %+.2f | %.3f | %.3f | | | %.0f |\n", slice_mm,
                std::string(EnumNames<Between>::values[static_cast<std::size_t>(between)]).c_str(),
                100 * (bone.volume_after_mm3 / phantom.bone_mm3 - 1), mean, off[off.size() * 95 / 100], ms);
  }
}

}  // namespace

void bench_slices(const Context& context) {
  std::printf(
      "## Bone from thick slices\n\n| body | slices mm | between | volume %% | off, mean mm | p95 mm | normals off, "
      "RMS degrees | wall "
      "broken %% "
      "| ms |\n|---|---|---|---|---|---|---|---|---|\n");
  for (const Body& body : bodies())
    for (const double slice : {1.0, 2.0, 3.0, 5.0})
      for (const Between between : {Between::values, Between::outlines}) {
        Result r;
        try {
          r = measure(body, slice, between, context);
        } catch (const Error&) {
          std::printf("| %s | %g | none is left at this threshold | | | | | | |\n", body.name, slice);
          continue;
        }
        std::printf("| %s | %g | %s | %+.2f | %.3f | %.3f | %.1f | ", body.name, slice,
                    std::string(EnumNames<Between>::values[static_cast<std::size_t>(between)]).c_str(),
                    r.volume_percent, r.mean, r.p95, r.normals);
        if (body.wall_mm > 0) std::printf("%.1f", r.broken_percent);
        std::printf(" | %.0f |\n", r.ms);
      }
  for (const double slice : {1.0, 2.0, 3.0, 5.0}) measure_phantom(slice, context);
}

}  // namespace osteo
