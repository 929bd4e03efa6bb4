// Normals to light by, against the true ones of bodies whose CT is noisy and sliced, of cuts and edges; and local
// updates against a rebuild.
#include "osteo/simulation/bone/detail/shading.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <random>

#include "osteo/simulation/bone/live_surface.h"

namespace osteo {
namespace {

// A body by its signed distance (negative inside) in mm about the origin, and the way out of it.
struct Solid {
  std::function<double(Vec3)> distance_mm;
  [[nodiscard]] Vec3 out(Vec3 p) const {
    constexpr double h = 1e-4;
    return normalized(Vec3{distance_mm(p + Vec3{h, 0, 0}) - distance_mm(p - Vec3{h, 0, 0}),
                           distance_mm(p + Vec3{0, h, 0}) - distance_mm(p - Vec3{0, h, 0}),
                           distance_mm(p + Vec3{0, 0, h}) - distance_mm(p - Vec3{0, 0, h})});
  }
};

BrickGrid grid_of(double h, double half_mm) {
  Frame f;
  const int n = static_cast<int>(2 * half_mm / h / 8 + 1) * 8;
  f.dims = {n, n, n};
  f.spacing_mm = {h, h, h};
  f.origin_mm = Vec3{1, 1, 1} * (-0.5 * (n - 1) * h);
  return BrickGrid::dense(f);
}

template <class F>
void fill(BrickGrid& bone, F&& density) {
  for (std::uint32_t v = 0; v < bone.brick_count() * 512; ++v) {
    const Ijk c = bone.coordinate(v);
    bone.set(v, static_cast<float>(std::clamp(
                    density(bone.frame().world_from_index({double(c.i), double(c.j), double(c.k)})), 0.0, 1.0)));
  }
}

// As it comes out of a scanner: 0.6 mm pixels, slices, a point spread of 0.4 mm, noise of 20 HU, 1000 HU of bone; bone
// from 450 to 550 HU.
void scan(BrickGrid& bone, const Solid& body, double slice_mm) {
  const double pixel = 0.6, half = bone.frame().dims[0] * bone.frame().spacing_mm.x / 2 + 2;
  const int n = static_cast<int>(2 * half / pixel), slices = static_cast<int>(2 * half / slice_mm);
  std::vector<double> ct(static_cast<std::size_t>(n) * n * slices);
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, 20);
  const auto blurred = [](double d) { return 0.5 * std::erfc(d / 0.4 / std::sqrt(2.0)); };
  for (int k = 0; k < slices; ++k)
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        double sum = 0;
        for (int s = 0; s < 5; ++s)
          sum += blurred(
                     body.distance_mm({-half + i * pixel, -half + j * pixel, -half + (k + (s - 2) * 0.2) * slice_mm})) /
                 5;
        ct[(static_cast<std::size_t>(k) * n + j) * n + i] = 1000 * sum + noise(random);
      }
  fill(bone, [&](Vec3 p) {
    const double x = (p.x + half) / pixel, y = (p.y + half) / pixel, z = (p.z + half) / slice_mm;
    const int i = static_cast<int>(x), j = static_cast<int>(y), k = static_cast<int>(z);
    double hu = 0;
    for (int c = 0; c < 8; ++c) {
      const int di = c & 1, dj = c >> 1 & 1, dk = c >> 2;
      const double w = (di != 0 ? x - i : 1 - x + i) * (dj != 0 ? y - j : 1 - y + j) * (dk != 0 ? z - k : 1 - z + k);
      hu += w * ct[(static_cast<std::size_t>(std::min(k + dk, slices - 1)) * n + j + dj) * n + i + di];
    }
    return (hu - 450) / 100;
  });
}

struct Angles {
  double rms = 0, p95 = 0;
  std::size_t points = 0;
};
// Of the surface's normals to the true ones, in degrees, where `counts`.
Angles errors(
    const LiveSurface& surface, const Solid& body,
    const std::function<bool(Vec3)>& counts = [](Vec3) { return true; }) {
  std::vector<double> all;
  double sum = 0;
  for (std::uint32_t b = 0; b < surface.bone().brick_count(); ++b) {
    for (const auto& v : surface.patch(b).vertices) {
      const Vec3 p = surface.bone().frame().world_from_index({v.index[0], v.index[1], v.index[2]});
      if (!counts(p)) continue;
      const Vec3 n{v.normal[0], v.normal[1], v.normal[2]};
      const double a = std::acos(std::clamp(dot(n, body.out(p)), -1.0, 1.0)) * 57.29578;
      sum += a * a;
      all.push_back(a);
    }
  }
  std::sort(all.begin(), all.end());
  if (all.empty()) return {};
  return {std::sqrt(sum / static_cast<double>(all.size())), all[all.size() * 95 / 100], all.size()};
}

const Solid kBall{[](Vec3 p) { return length(p) - 12; }};
// Its distance only to first order, which its normals do not notice.
const Solid kEllipsoid{[](Vec3 p) {
  const Vec3 q{p.x / 14, p.y / 17, p.z / 12};
  const double f = length(q);
  return (f - 1) * f / length(Vec3{q.x / 14, q.y / 17, q.z / 12});
}};
const Solid kPlane{[](Vec3 p) { return dot(p, normalized(Vec3{0.3, 0.5, 0.9})); }};
const Solid kCylinder{[](Vec3 p) {
  const Vec3 axis = normalized(Vec3{1, 0.4, 0.3});
  return length(p - axis * dot(p, axis)) - 8;
}};

LiveSurface shaded(const BrickGrid& bone) {
  LiveSurface s(bone, {});
  s.shade({});
  return s;
}

bool inner(Vec3 p) {
  return std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) < 14;
}

TEST(ShadingField, NoTerracesOnWhatAScannerSees) {
  for (const auto& [name, body] : {std::pair<const char*, const Solid*>{"ball", &kBall},
                                   {"ellipsoid", &kEllipsoid},
                                   {"plane", &kPlane},
                                   {"cylinder", &kCylinder}}) {
    for (const double slice : {1.0, 2.0}) {
      BrickGrid bone = grid_of(0.5, 18);
      scan(bone, *body, slice);
      const bool clipped = body == &kPlane || body == &kCylinder;
      const auto counts = [&](Vec3 p) { return !clipped || inner(p); };
      const Angles before = errors(LiveSurface(bone, {}), *body, counts), after = errors(shaded(bone), *body, counts);
      std::printf("  %-10s %.0f mm slices: %5.2f degrees RMS, p95 %5.2f; shaded %5.2f, %5.2f  (%zu points)\n", name,
                  slice, before.rms, before.p95, after.rms, after.p95, after.points);
      // At 2 mm what is left is the slices themselves: the wide kernel alone has 2.0 on the cylinder.
      EXPECT_LT(after.rms, slice == 1 ? 1 : 2.4) << name;
      EXPECT_LT(after.rms, before.rms / 6) << name;
    }
  }
}

// A mesh as it comes from a file, and every third of its points by themselves, get the normals of the surface in the
// window. A mesh of something else keeps its own.
TEST(ShadingField, AMeshIsLitAsTheSurfaceInTheWindow) {
  BrickGrid bone = grid_of(0.5, 18);
  scan(bone, kEllipsoid, 2);
  const TriMesh wanted = shaded(bone).joined().mesh, plain = LiveSurface(bone, {}).joined().mesh;
  for (const std::size_t each : {1U, 3U}) {
    TriMesh mesh;
    for (std::size_t p = 0; p < plain.points_mm.size(); p += each) {
      mesh.points_mm.push_back(plain.points_mm[p]);
      mesh.normals.push_back(plain.normals[p]);
    }
    shade_mesh(mesh, bone, {});
    double worst = 0, changed = 0;
    for (std::size_t p = 0; p < mesh.normals.size(); ++p) {
      worst = std::max(worst, length(from_floats(mesh.normals[p]) - from_floats(wanted.normals[p * each])));
      changed = std::max(changed, length(from_floats(mesh.normals[p]) - from_floats(plain.normals[p * each])));
    }
    EXPECT_LT(worst, 1e-3) << each;
    EXPECT_GT(changed, 0.1) << each;
  }
  TriMesh far_off;
  far_off.points_mm = {{100, 100, 100}, {0, 0, 0}};
  far_off.normals = {{1, 0, 0}, {0, 1, 0}};
  const auto before = far_off.normals;
  shade_mesh(far_off, bone, {});
  EXPECT_EQ(far_off.normals, before) << "outside of the bone's grid, and deep inside of it";
}

TEST(ShadingField, CutsEdgesAndThinWallsStayWhatTheyAre) {
  // A burr of 4 mm through a plane: inside the cut, a voxel and more from its rim.
  for (const double h : {0.3, 0.5}) {
    const Solid cut{[](Vec3 p) { return std::max(p.z - 0.13, 2 - length(p - Vec3{0.2, 0.1, 0.6})); }};
    BrickGrid bone = grid_of(h, 8);
    fill(bone, [&](Vec3 p) { return 0.5 - cut.distance_mm(p) / h; });
    const auto in_cut = [&](Vec3 p) {
      return p.z < 0.13 - 0.75 && length(p - Vec3{0.2, 0.1, 0.6}) < 2 + h && std::abs(p.z) < 4;
    };
    const auto on_top = [&](Vec3 p) {
      return std::abs(p.z - 0.13) < h && std::hypot(p.x, p.y) > 4 && std::hypot(p.x, p.y) < 6;
    };
    const LiveSurface surface = shaded(bone);
    const Angles cavity = errors(surface, cut, in_cut), top = errors(surface, cut, on_top);
    const auto rim = [&](Vec3 p) {
      return std::abs(p.z - 0.13) < h && std::hypot(p.x - 0.2, p.y - 0.1) > 1.96 + 2 * h &&
             std::hypot(p.x - 0.2, p.y - 0.1) < 1.96 + 2 * h + 1;
    };
    const Angles at_rim = errors(surface, cut, rim);
    std::printf(
        "  burr 4 mm, %.1f mm voxels: cavity %.2f degrees RMS (%zu points), from 2 voxels off its rim on %.2f, face "
        "%.2f\n",
        h, cavity.rms, cavity.points, at_rim.rms, top.rms);
    EXPECT_GT(cavity.points, 50U);
    EXPECT_LT(cavity.rms, 3);
    EXPECT_LT(top.rms, 1);
    EXPECT_LT(at_rim.rms, 5);
  }
  // Edges of 90 and 60 degrees: a millimetre from the edge the faces are flat again, and at the edge the light turns
  // within it.
  for (const double angle : {90.0, 60.0}) {
    const double half = angle / 2 / 57.29578;
    // A wedge whose edge is the z axis turned a little; its faces look to +y and -y.
    const Solid wedge{[=](Vec3 p) {
      const Vec3 q{p.x + 3 + 0.1 * p.z, p.y + 0.07, p.z};
      return std::max(dot(q, Vec3{-std::sin(half), std::cos(half), 0}),
                      dot(q, Vec3{-std::sin(half), -std::cos(half), 0}));
    }};
    BrickGrid bone = grid_of(0.5, 8);
    fill(bone, [&](Vec3 p) { return 0.5 - wedge.distance_mm(p) / 0.5; });
    const auto off = [&](double from, double to) {
      return [=](Vec3 p) {
        const double along = p.x + 3 + 0.1 * p.z;
        return std::abs(p.z) < 5 && along > from && along < to && along < 7;
      };
    };
    const LiveSurface surface = shaded(bone);
    const Angles near = errors(surface, wedge, off(1.0, 2.0)), far = errors(surface, wedge, off(2.5, 6));
    std::printf("  edge of %.0f degrees: %.2f degrees RMS 1 to 2 mm off, %.2f farther\n", angle, near.rms, far.rms);
    EXPECT_LT(near.rms, 8);
    EXPECT_LT(far.rms, 1);
  }
  // Walls, both sides of which are seen: each lights to its own side.
  for (const double wall : {0.6, 1.0, 1.5, 2.5}) {
    const Vec3 n = normalized(Vec3{0.2, 0.3, 0.9});
    const Solid plate{[&](Vec3 p) { return std::abs(dot(p, n)) - wall / 2; }};
    BrickGrid bone = grid_of(0.5, 8);
    fill(bone, [&](Vec3 p) { return 0.5 - plate.distance_mm(p) / 0.5; });
    const Angles e = errors(shaded(bone), plate, [](Vec3 p) { return length(p) < 5; });
    std::printf("  wall of %.1f mm: %.2f degrees RMS (%zu points)\n", wall, e.rms, e.points);
    EXPECT_GT(e.points, 100U);
    EXPECT_LT(e.rms, 3);
  }
}

TEST(ShadingField, LocalUpdatesEqualARebuildToTheBit) {
  for (const double h : {0.2, 0.5, 1.0}) {
    BrickGrid bone = grid_of(h, 20 * h);
    fill(bone, [&](Vec3 p) { return 0.5 - (length(p) - 14 * h) / h; });
    LiveSurface live = shaded(bone);
    std::mt19937 random(3);
    for (int round = 0; round < 6; ++round) {
      const Vec3 centre = Vec3{double(random() % 20) - 10, double(random() % 20) - 10, double(random() % 20) - 10} * h;
      for (std::uint32_t v = 0; v < bone.brick_count() * 512; ++v) {
        const Ijk c = bone.coordinate(v);
        if (bone.value(v) == 0 ||
            length(bone.frame().world_from_index({double(c.i), double(c.j), double(c.k)}) - centre) > 3 * h)
          continue;
        bone.set(v, bone.value(v) * 0.3F);
        live.mark(v);
      }
      live.update();
      if (round % 2 == 0) continue;  // settled now and then only
      live.settle();
      EXPECT_TRUE(live.settled());
      const LiveSurface again = shaded(bone);
      for (std::uint32_t b = 0; b < bone.brick_count(); ++b) {
        const auto &x = live.patch(b).vertices, &y = again.patch(b).vertices;
        ASSERT_EQ(x.size(), y.size());
        for (std::size_t i = 0; i < x.size(); ++i)
          ASSERT_TRUE(x[i].index == y[i].index && x[i].normal == y[i].normal) << "brick " << b << ", " << h << " mm";
      }
    }
  }
}

TEST(ShadingField, FollowsToAnotherGridOfTheSameBricks) {
  auto bone = std::make_unique<BrickGrid>(grid_of(0.5, 10));
  fill(*bone, [&](Vec3 p) { return 0.5 - (length(p) - 7) / 0.5; });
  LiveSurface live = shaded(*bone);
  auto next = std::make_unique<BrickGrid>(*bone);
  for (VoxelKey v = 0; v < next->brick_count() * 512; ++v) {
    const Ijk c = next->coordinate(v);
    if (length(next->frame().world_from_index({double(c.i), double(c.j), double(c.k)}) - Vec3{7, 0, 0}) > 2) continue;
    next->set(v, 0);
    live.mark(v);
  }
  live.rebind(*next);
  // What it was made from is gone, and where it was holds something else.
  for (VoxelKey v = 0; v < bone->brick_count() * 512; ++v) bone->set(v, 0.7F);
  bone.reset();
  live.update();
  live.settle();
  const LiveSurface again = shaded(*next);
  for (std::uint32_t b = 0; b < next->brick_count(); ++b) {
    const auto &x = live.patch(b).vertices, &y = again.patch(b).vertices;
    ASSERT_EQ(x.size(), y.size());
    for (std::size_t i = 0; i < x.size(); ++i) ASSERT_TRUE(x[i].normal == y[i].normal) << "brick " << b;
  }
}

TEST(ShadingField, EqualVerticesOfNeighboursAreLitAlike) {
  BrickGrid bone = grid_of(0.5, 18);
  scan(bone, kBall, 2);
  const LiveSurface surface = shaded(bone);
  std::map<std::uint64_t, std::array<float, 3>> seen;
  double worst = 0;
  std::size_t shared = 0;
  for (std::uint32_t b = 0; b < bone.brick_count(); ++b) {
    for (const auto& v : surface.patch(b).vertices) {
      const auto [it, fresh] = seen.try_emplace(v.key, v.normal);
      if (fresh) continue;
      ++shared;
      for (std::size_t x = 0; x < 3; ++x)
        worst = std::max(worst, std::abs(double(it->second[x]) - double(v.normal[x])));
    }
  }
  EXPECT_GT(shared, 1000U);
  EXPECT_LT(worst, 1e-5);
}

}  // namespace
}  // namespace osteo
