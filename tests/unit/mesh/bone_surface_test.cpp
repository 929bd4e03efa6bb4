#include "osteo/geometry/mesh/bone_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <random>

namespace osteo {
namespace {

// A grid of n^3 bricks from f(i, j, k), stored at brick (1,1,1) on so that the surface never leaves positive indices.
template <class F>
BrickGrid make_grid(int n, F&& f) {
  Frame frame;
  frame.dims = {8 * n, 8 * n, 8 * n};
  BrickGrid grid = BrickGrid::dense(frame);
  for (int k = 0; k < 8 * n; ++k) {
    for (int j = 0; j < 8 * n; ++j) {
      for (int i = 0; i < 8 * n; ++i) grid.set(grid.find(i, j, k), static_cast<float>(f(i, j, k)));
    }
  }
  return grid;
}

void expect_closed_manifold(const TriMesh& mesh) {
  const MeshCheck c = check(mesh);
  EXPECT_EQ(c.open_edges, 0u);
  EXPECT_EQ(c.nonmanifold_edges, 0u);
  EXPECT_EQ(c.misoriented_edges, 0u);
  EXPECT_EQ(c.nonmanifold_points, 0u);
  EXPECT_EQ(c.degenerate, 0u);
}

TEST(SurfaceNets, SphereLiesOnTheExactBoundary) {
  const double r = 13.3;
  const auto grid = make_grid(4, [&](int i, int j, int k) {
    return std::clamp(0.5 + r - std::sqrt((i - 15.6) * (i - 15.6) + (j - 16.1) * (j - 16.1) + (k - 15.9) * (k - 15.9)),
                      0.0, 1.0);
  });
  const auto surface = surface_nets(grid);
  expect_closed_manifold(surface.mesh);
  double worst = 0, mean = 0, mean_cosine = 0;
  for (std::size_t v = 0; v < surface.mesh.points_mm.size(); ++v) {
    const auto& p = surface.mesh.points_mm[v];
    const Vec3 d{p[0] - 15.6, p[1] - 16.1, p[2] - 15.9};
    worst = std::max(worst, std::abs(length(d) - r));
    const auto& n = surface.mesh.normals[v];
    EXPECT_GT(dot(normalized(d), {n[0], n[1], n[2]}), 0.93);
    mean_cosine += dot(normalized(d), {n[0], n[1], n[2]}) / static_cast<double>(surface.mesh.points_mm.size());
    mean += std::abs(length(d) - r) / static_cast<double>(surface.mesh.points_mm.size());
  }
  EXPECT_GT(mean_cosine, 0.995);  // 6 degrees
  EXPECT_LT(mean, 0.04);          // voxels
  EXPECT_LT(worst, 0.12);
  EXPECT_NEAR(enclosed_volume_mm3(surface.mesh), 4.0 / 3 * M_PI * r * r * r, 0.01 * 4.0 / 3 * M_PI * r * r * r);
}

// Every way to fill a 3x3x3 block would be 2^27; random fillings at many densities meet all local configurations.
TEST(SurfaceNets, ClosedManifoldForRandomVoxels) {
  std::mt19937 random(7);
  for (int trial = 0; trial < 60; ++trial) {
    const double share = 0.05 + 0.9 * trial / 59;
    std::bernoulli_distribution bone(share);
    std::uniform_real_distribution<float> value(0.0F, 0.49F);
    const auto grid = make_grid(2, [&](int, int, int) { return bone(random) ? 0.51F + value(random) : value(random); });
    const auto surface = surface_nets(grid);
    SCOPED_TRACE(share);
    expect_closed_manifold(surface.mesh);
    if (HasFailure()) return;
  }
}

// What a reader of STL makes of it: points that are equal to the bit become one.
TriMesh merged(const TriMesh& mesh) {
  std::map<std::array<float, 3>, std::uint32_t> number;
  TriMesh m;
  std::vector<std::uint32_t> of;
  for (const auto& p : mesh.points_mm) {
    const auto [it, fresh] = number.try_emplace(p, static_cast<std::uint32_t>(m.points_mm.size()));
    if (fresh) m.points_mm.push_back(p);
    of.push_back(it->second);
  }
  for (const auto& t : mesh.triangles) m.triangles.push_back({of[t[0]], of[t[1]], of[t[2]]});
  return m;
}

void expect_no_equal_points(const TriMesh& mesh) {
  const TriMesh m = merged(mesh);
  EXPECT_EQ(m.points_mm.size(), mesh.points_mm.size());
  expect_closed_manifold(m);
  std::size_t flat = 0;
  for (const auto& t : m.triangles) {
    const Vec3 a = from_floats(m.points_mm[t[0]]), b = from_floats(m.points_mm[t[1]]),
               c = from_floats(m.points_mm[t[2]]);
    flat += length(cross(b - a, c - a)) == 0 ? 1 : 0;
  }
  EXPECT_EQ(flat, 0u);
}

// Voxels of just the surface's density, or next to it, drew the vertices of the cells around them to one place.
TEST(SurfaceNets, NoPointsAreEqualWhereverTheDensityIsJustTheSurfaces) {
  std::mt19937 random(17);
  const float half = 0.5F,
              values[] = {0, 0.3F, std::nextafter(half, 0.0F), half, half, std::nextafter(half, 1.0F), 0.8F, 1};
  for (int trial = 0; trial < 40; ++trial) {
    std::discrete_distribution<int> pick({1.0 + trial % 7, 1, 1, 1.0 + trial % 3, 1, 1, 1, 1.0 + trial % 5});
    auto grid = make_grid(2, [&](int, int, int) { return values[pick(random)]; });
    // As far away as a scan lies, at an angle, in fine voxels: where single precision is coarse for them.
    Frame f = grid.frame();
    f.spacing_mm = {0.15, 0.15, 0.15};
    f.origin_mm = {-173.21, 412.7, -655.3};
    f.direction = {{normalized(Vec3{0.96, 0.28, 0}), normalized(Vec3{-0.28, 0.96, 0}), {0, 0, 1}}};
    BrickGrid placed(f, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}});
    for (int k = 0; k < 16; ++k)
      for (int j = 0; j < 16; ++j)
        for (int i = 0; i < 16; ++i) placed.set(placed.find(i, j, k), grid.at(i, j, k));
    SCOPED_TRACE(trial);
    expect_no_equal_points(surface_nets(placed).mesh);
    if (HasFailure()) return;
  }
}

double worst_distance(const TriMesh& mesh, const std::function<double(Vec3)>& signed_distance) {
  double worst = 0;
  for (const auto& p : mesh.points_mm) worst = std::max(worst, std::abs(signed_distance(from_floats(p))));
  return worst;
}

TEST(VolumeSurface, EnclosesWhatTheGridHoldsAndStaysWhereItIs) {
  const double h = 0.4;
  const auto measured = [&](const std::function<double(Vec3)>& distance, double true_mm3) {
    auto plain = make_grid(5, [](int, int, int) { return 0; });
    Frame f = plain.frame();
    f.spacing_mm = {h, h, h};
    std::vector<Ijk> bricks;
    for (std::uint32_t b = 0; b < plain.brick_count(); ++b) bricks.push_back(plain.brick_coordinate(b));
    BrickGrid bone(f, bricks);
    for (VoxelKey v = 0; v < bone.brick_count() * BrickGrid::kVoxels; ++v) {
      const Ijk c = bone.coordinate(v);
      bone.set(v, static_cast<float>(std::clamp(0.5 - distance(Vec3{c.i * h, c.j * h, c.k * h}) / h, 0.0, 1.0)));
    }
    const TriMesh at_half = surface_nets(bone).mesh;
    const VolumeSurface s = surface_of_volume(bone);
    expect_no_equal_points(s.mesh);
    EXPECT_NEAR(s.bone_mm3, bone.sum() * h * h * h, 1e-9);
    EXPECT_NEAR(s.surface_mm3, enclosed_volume_mm3(s.mesh), 1e-9 * s.bone_mm3);
    EXPECT_NEAR(s.surface_mm3 / s.bone_mm3, 1, 1e-3);
    EXPECT_NEAR(s.bone_mm3 / true_mm3, 1, 1e-2);
    EXPECT_GT(std::abs(enclosed_volume_mm3(at_half) / s.bone_mm3 - 1), 2e-3) << "nothing to correct";
    EXPECT_EQ(s.scale, 1);
    EXPECT_NEAR(s.moved_mm, (s.surface_mm3 - enclosed_volume_mm3(at_half)) / area_mm2(at_half),
                0.1 * std::abs(s.moved_mm));
    EXPECT_LT(std::abs(s.moved_mm), 0.1 * h);
    // The surface is no farther from the truth than it was, but for what it was moved.
    EXPECT_LT(worst_distance(s.mesh, distance), worst_distance(at_half, distance) + 1.5 * std::abs(s.moved_mm));
  };
  const Vec3 middle{7.9, 8.1, 7.7};
  measured([&](Vec3 p) { return length(p - middle) - 3; }, 4.0 / 3 * M_PI * 27);
  // A ring: convex and hollow sides.
  measured([&](Vec3 p) { return std::hypot(std::hypot(p.x - middle.x, p.y - middle.y) - 4.5, p.z - middle.z) - 1.2; },
           2 * M_PI * M_PI * 4.5 * 1.2 * 1.2);
}

// From one voxel on, also where nothing is half full: the volume is right, or the difference is what is said.
TEST(VolumeSurface, CrumbsToo) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> value(0.0F, 1.0F);
  std::uniform_int_distribution<int> count(1, 30), step(0, 5);
  int right = 0, scaled = 0;
  for (int trial = 0; trial < 200; ++trial) {
    auto grid = make_grid(3, [](int, int, int) { return 0; });
    Ijk at{12, 12, 12};
    for (int n = count(random); n > 0; --n) {
      const float most = trial % 4 == 0 ? 0.45F : 1.0F;
      grid.set(grid.find(at.i, at.j, at.k), std::max(0.02F, most * value(random)));
      const int s = step(random);
      int* const axis = s / 2 == 0 ? &at.i : s / 2 == 1 ? &at.j : &at.k;
      *axis = std::clamp(*axis + (s % 2 == 0 ? 1 : -1), 2, 21);
    }
    const VolumeSurface s = surface_of_volume(grid);
    SCOPED_TRACE(trial);
    ASSERT_FALSE(s.mesh.triangles.empty());
    expect_no_equal_points(s.mesh);
    EXPECT_NEAR(s.surface_mm3, enclosed_volume_mm3(s.mesh), 1e-6 * s.surface_mm3);
    const double off = std::abs(s.surface_mm3 / s.bone_mm3 - 1);
    right += off <= 1e-3 ? 1 : 0;
    scaled += s.scale != 1 ? 1 : 0;
    if (HasFailure()) return;
  }
  EXPECT_GT(right, 190);
  EXPECT_GT(scaled, 10);
  const VolumeSurface nothing = surface_of_volume(make_grid(1, [](int, int, int) { return 0; }));
  EXPECT_TRUE(nothing.mesh.triangles.empty());
  EXPECT_EQ(nothing.bone_mm3, 0);
}

TEST(SurfaceNets, PatchesAfterEditsEqualRebuild) {
  std::mt19937 random(11);
  auto grid = make_grid(3, [&](int, int, int) { return 1.0F; });
  std::vector<SurfacePatch> patches(grid.brick_count());
  for (std::uint32_t b = 0; b < patches.size(); ++b) patches[b] = extract_patch(grid, b);
  std::uniform_int_distribution<int> at(0, 23);
  std::uniform_real_distribution<float> value(0.0F, 1.0F);
  for (int edit = 0; edit < 3000; ++edit) {
    const int i = at(random), j = at(random), k = at(random);
    grid.set(grid.find(i, j, k), value(random));
    for (int n = 0; n < 27; ++n) {
      const auto b =
          grid.find_brick((i + (n % 3 - 1) * 2) >> 3, (j + (n / 3 % 3 - 1) * 2) >> 3, (k + (n / 9 - 1) * 2) >> 3);
      if (b != BrickGrid::kNone) patches[b] = extract_patch(grid, b);
    }
  }
  const auto local = join_patches(grid, patches), rebuilt = surface_nets(grid);
  EXPECT_EQ(local.mesh.points_mm, rebuilt.mesh.points_mm);
  EXPECT_EQ(local.mesh.normals, rebuilt.mesh.normals);
  EXPECT_EQ(local.mesh.triangles, rebuilt.mesh.triangles);
  EXPECT_EQ(local.voxels, rebuilt.voxels);
  expect_closed_manifold(local.mesh);
}

TEST(SurfaceNets, SameForAnyThreadCount) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> value(0.0F, 1.0F);
  const auto grid = make_grid(5, [&](int, int, int) { return value(random); });
  Context one, two;
  one.threads = 1;
  two.threads = 2;
  EXPECT_EQ(surface_nets(grid, 0.5F, one).mesh.triangles, surface_nets(grid, 0.5F, two).mesh.triangles);
}

TEST(SurfaceNets, MapsTieVoxelsToTheirTriangles) {
  const auto grid = make_grid(
      2, [](int i, int j, int k) { return i > 3 && i < 12 && j > 3 && j < 12 && k > 3 && k < 12 ? 1.0F : 0.0F; });
  const auto s = surface_nets(grid);
  EXPECT_EQ(s.voxels.size(), 8u * 8 * 8 - 6 * 6 * 6);  // the cube's outer layer
  EXPECT_EQ(s.triangles_of_vertex.items.size(), s.mesh.triangles.size() * 3);
  for (std::size_t r = 0; r < s.voxels.size(); ++r) {
    const Ijk c = grid.coordinate(s.voxels[r]);
    for (const auto v : s.vertices_of_voxel.row(r)) {
      const auto& p = s.mesh.points_mm[v];
      EXPECT_LE(std::max({std::abs(p[0] - c.i), std::abs(p[1] - c.j), std::abs(p[2] - c.k)}), 1.0F);
    }
  }
}

TEST(VoxelSurface, CubeHasOneTriangleForEachHalfSquare) {
  const auto grid = make_grid(
      2, [](int i, int j, int k) { return i > 3 && i < 12 && j > 3 && j < 12 && k > 3 && k < 12 ? 1.0F : 0.0F; });
  const auto s = voxel_surface(grid);
  EXPECT_EQ(s.voxels.size(), 8u * 8 * 8 - 6 * 6 * 6);
  EXPECT_EQ(s.mesh.triangles.size(), 6u * 7 * 7 * 2);
  expect_closed_manifold(s.mesh);
  EXPECT_NEAR(enclosed_volume_mm3(s.mesh), 7.0 * 7 * 7, 1e-3);
}

TEST(VoxelSurface, BallIsClosedAndEachVertexIsAVoxel) {
  const auto grid = make_grid(4, [](int i, int j, int k) {
    return (i - 16) * (i - 16) + (j - 16) * (j - 16) + (k - 15) * (k - 15) < 130 ? 1.0F : 0.0F;
  });
  const auto s = voxel_surface(grid);
  const MeshCheck c = check(s.mesh);
  EXPECT_EQ(c.open_edges, 0u);
  EXPECT_EQ(c.degenerate, 0u);
  ASSERT_EQ(s.voxels.size(), s.mesh.points_mm.size());
  for (std::size_t v = 0; v < s.voxels.size(); ++v) {
    const Ijk at = grid.coordinate(s.voxels[v]);
    EXPECT_EQ(s.mesh.points_mm[v], (std::array<float, 3>{float(at.i), float(at.j), float(at.k)}));
  }
  EXPECT_GT(enclosed_volume_mm3(s.mesh), 0);
}

}  // namespace
}  // namespace osteo
