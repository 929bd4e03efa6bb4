// Tetrahedral meshes: conformity, volumes, angles, distance to the surface; skinning.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "folders.h"
#include "meshes.h"
#include "osteo/core/base/error.h"
#include "osteo/core/data/tet_mesh.h"
#include "osteo/geometry/distance/compare.h"
#include "osteo/geometry/tets/lattice_tets.h"
#include "osteo/geometry/tets/quality.h"
#include "osteo/geometry/tets/skin.h"
#include "osteo/imaging/io/tet_io.h"

namespace osteo {
namespace {

using test::box, test::joined, test::moved, test::sphere, test::turned;

bool same(const TetMesh& a, const TetMesh& b) {
  return a.points_mm.size() == b.points_mm.size() && a.tets.size() == b.tets.size() &&
         std::memcmp(a.points_mm.data(), b.points_mm.data(), a.points_mm.size() * 12) == 0 &&
         std::memcmp(a.tets.data(), b.tets.data(), a.tets.size() * 16) == 0;
}

TEST(Quality, OfARegularAndOfAFlatTetrahedron) {
  TetMesh m;
  m.points_mm = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
  m.tets = {{0, 2, 1, 3}};
  if (volume_mm3(m) < 0) std::swap(m.tets[0][0], m.tets[0][1]);
  TetQuality q = tet_quality(m);
  EXPECT_NEAR(q.min_dihedral_deg, std::acos(1.0 / 3) * 180 / std::numbers::pi, 1e-5);
  EXPECT_NEAR(q.max_dihedral_deg, q.min_dihedral_deg, 1e-5);
  EXPECT_NEAR(q.min_aspect, 1, 1e-6);
  EXPECT_NEAR(q.volume_mm3, 8.0 / 3, 1e-6);
  EXPECT_EQ(q.inverted, 0U);
  EXPECT_TRUE(q.conforming() && q.boundary_closed && q.boundary_manifold);
  EXPECT_EQ(q.boundary_triangles, 4U);
  std::swap(m.tets[0][0], m.tets[0][1]);
  EXPECT_EQ(tet_quality(m).inverted, 1U);
  m.points_mm[3] = {-1, -1, -1};
  m.points_mm[0] = {3, 1, -1};  // all at z = -1
  m.points_mm[1] = {1, -1, -1};
  q = tet_quality(m);
  EXPECT_EQ(q.inverted, 1U);
  EXPECT_EQ(q.min_aspect, 0);
}

TEST(Quality, SeesCrossedDiagonals) {
  // Two cubes side by side, both split the same way: their shared face has both diagonals. That is the thesis' mesh.
  TetMesh m;
  for (int k = 0; k < 2; ++k)
    for (int j = 0; j < 2; ++j)
      for (int i = 0; i < 3; ++i) m.points_mm.push_back({float(i), float(j), float(k)});
  for (int c = 0; c < 2; ++c) {
    std::array<std::uint32_t, 8> v{};
    for (std::uint32_t n = 0; n < 8; ++n) v[n] = c + (n & 1) + 3 * (n >> 1 & 1) + 6 * (n >> 2);
    for (const auto& t : {std::array{0, 3, 5, 6}, std::array{1, 3, 5, 0}, std::array{2, 0, 6, 3},
                          std::array{4, 6, 0, 5}, std::array{7, 5, 3, 6}}) {
      std::array<std::uint32_t, 4> tet{v[t[0]], v[t[1]], v[t[2]], v[t[3]]};
      m.tets.push_back(tet);
      TetMesh one;
      one.points_mm = m.points_mm;
      one.tets = {tet};
      if (volume_mm3(one) < 0) std::swap(m.tets.back()[2], m.tets.back()[3]);
    }
  }
  const TetQuality q = tet_quality(m);
  EXPECT_EQ(q.inverted, 0U);
  EXPECT_GT(q.buried_triangles, 0U);
  EXPECT_FALSE(q.conforming());
}

TEST(GridTets, FillTheirVoxelsAndConform) {
  const TriangleSoup s = joined(sphere(10, 3), turned(sphere(4, 2)));
  const VoxelBits voxels = voxels_inside(s, frame_around(s, 31, 2));
  const TetMesh m = grid_tets(voxels);
  EXPECT_EQ(m.tets.size(), voxels.count() * 5);
  const TetQuality q = tet_quality(m);
  EXPECT_EQ(q.inverted, 0U);
  EXPECT_TRUE(q.conforming());
  EXPECT_EQ(q.unused_points, 0U);
  EXPECT_NEAR(q.volume_mm3, static_cast<double>(voxels.count()) * voxels.frame.voxel_volume_mm3(), 1e-4 * q.volume_mm3);
  EXPECT_NEAR(q.min_dihedral_deg, 54.7356, 1e-3);
  EXPECT_NEAR(q.max_dihedral_deg, 90, 1e-3);
}

TEST(GridTets, RowsLongerThanAWordAndLeftHandedFrames) {
  VoxelBits voxels;
  Frame f;
  f.dims = {200, 3, 2};
  f.direction.column[2] = {0, 0, -1};
  voxels = VoxelBits(f);
  for (int i = 0; i < 200; ++i) voxels.words[voxels.row(1, 0) + i / 64] |= 1ULL << (i % 64);
  voxels.words[voxels.row(2, 1) + 1] |= 0xf0f0f0f0f0f0f0f0ULL;
  const TetMesh m = grid_tets(voxels);
  const TetQuality q = tet_quality(m);
  EXPECT_EQ(m.tets.size(), 5 * (200 + 32U));
  EXPECT_EQ(q.inverted, 0U);
  EXPECT_EQ(q.unused_points, 0U);
  EXPECT_EQ(q.faces_of_three_or_more, 0U);
  Context one, two;
  one.threads = 1;
  two.threads = 2;
  EXPECT_TRUE(same(grid_tets(voxels, one), grid_tets(voxels, two)));
}

TEST(Stuffing, GoodAnglesOnTheSurfaceWhateverTheSurface) {
  TriangleSoup open = sphere(10, 3);
  open.triangles.resize(open.triangles.size() * 9 / 10);
  const std::pair<const char*, TriangleSoup> cases[] = {
      {"sphere", sphere(10, 4)},
      {"box", box({0, 0, 0}, {20, 13, 7})},
      {"cavity", joined(sphere(10, 3), turned(sphere(6, 3)))},
      {"intersecting", joined(sphere(10, 3), sphere(8, 3, {9, 1, 0}))},
      {"open", open},
      {"inside out", turned(sphere(10, 3))},
      {"far away", moved(sphere(10, 3), 1, {1000, -1000, 500})},
      {"touching boxes", joined(box({0, 0, 0}, {5, 10, 10}), box({5, 0, 0}, {10, 10, 10}))}};
  for (const auto& [name, s] : cases) {
    SCOPED_TRACE(name);
    const double h = frame_around(s, 24, 0).spacing_mm.x;
    for (const double target : {0.0, 15.0}) {
      const TetMesh m = stuffed_tets(s, {h, target});
      const TetQuality q = tet_quality(m);
      EXPECT_EQ(q.inverted, 0U);
      EXPECT_TRUE(q.conforming()) << q.faces_of_three_or_more << ' ' << q.buried_triangles;
      EXPECT_GT(q.min_dihedral_deg, target == 0 ? 10.7 : 14.99);
      EXPECT_LT(q.max_dihedral_deg, 165);
    }
  }
}

TEST(Stuffing, ConvergesToTheSphere) {
  const TriangleSoup s = sphere(10, 5);
  double before = 1e9;
  for (const double h : {2.0, 1.0, 0.5}) {
    const TetMesh m = stuffed_tets(s, {h, 0});
    const SurfaceComparison c = compare_surfaces(soup_of(boundary_of(m)), s);
    EXPECT_LT(c.hausdorff_mm(), before / 2.5);  // second order would be 4
    EXPECT_NEAR(volume_mm3(m), 4 / 3.0 * std::numbers::pi * 1000, 60 * h * h);
    before = c.hausdorff_mm();
  }
  EXPECT_LT(before, 0.05);
  EXPECT_THROW((void)stuffed_tets(box({0, 0, 0}, {1, 1, 0.001}), {0.5, 15}), Error);
}

TEST(Graded, ConformsHasThreeShapesAndFewerTetrahedra) {
  const TriangleSoup s = sphere(10, 4);
  const TetMesh m = graded_tets(s, {0.5, 3});
  const TetQuality q = tet_quality(m);
  EXPECT_EQ(q.inverted, 0U);
  EXPECT_TRUE(q.conforming());
  EXPECT_NEAR(q.min_dihedral_deg, 45, 0.01);
  EXPECT_NEAR(q.volume_mm3, 4188, 60);
  EXPECT_LT(m.tets.size(), 6 * 4188 / 0.125 / 2);  // less than half of the same cubes everywhere
  EXPECT_GT(q.max_edge_mm, 3 * q.min_edge_mm);
}

TEST(Meshes, SameBytesForAnyThreads) {
  const TriangleSoup s = joined(sphere(10, 3), sphere(8, 3, {9, 1, 0}));
  Context one, two;
  one.threads = 1;
  two.threads = 2;
  EXPECT_TRUE(same(stuffed_tets(s, {1, 20}, one), stuffed_tets(s, {1, 20}, two)));
  EXPECT_TRUE(same(graded_tets(s, {1, 2}, one), graded_tets(s, {1, 2}, two)));
}

TEST(Meshes, RealOnes) {
  const auto paths = test::real_meshes();
  if (paths.empty()) GTEST_SKIP() << "no real meshes in " << shared_data();
  for (const auto& path : paths) {
    const std::string name = path.filename().string();
    // Flat drawings enclose nothing, and this aircraft's skin is a ten-thousandth of its length.
    if (name.find("alligator") != std::string::npos || name.find("spiral") != std::string::npos ||
        name.find("Generic_Twin") != std::string::npos)
      continue;
    SCOPED_TRACE(name);
    const TriangleSoup s = soup_of(*load_surface(path));
    const TetMesh m = stuffed_tets(s, {frame_around(s, 30, 0).spacing_mm.x, 13});
    const TetQuality q = tet_quality(m);
    EXPECT_EQ(q.inverted, 0U);
    EXPECT_TRUE(q.conforming()) << q.faces_of_three_or_more << ' ' << q.buried_triangles;
    EXPECT_GE(q.min_dihedral_deg, 12.99);
  }
}

TEST(TetFiles, ComeBackEqual) {
  const TriangleSoup s = sphere(10, 2);
  const TetMesh m = stuffed_tets(s, {4, 0});
  const auto folder = std::filesystem::temp_directory_path() / ("osteo-tets-" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  for (const char* name : {"m.vtu", "m.ele", "m.node"}) {
    save_tets(m, folder / name);
    EXPECT_TRUE(same(*load_tets(folder / name), m)) << name;
  }
  std::ofstream(folder / "bad.node") << "2 3 0 0\n0 0 0 0\n1 1 x 0\n";
  std::ofstream(folder / "bad.ele") << "1 4 0\n0 0 1 2 3\n";
  const auto message = [&](const char* name) {
    try {
      (void)load_tets(folder / name);
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string("accepted");
  };
  EXPECT_NE(message("bad.ele").find("line 3: 'x 0' is no number"), std::string::npos) << message("bad.ele");
  std::ofstream(folder / "bad.node") << "# made by hand\n4 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n";
  std::ofstream(folder / "bad.ele") << "1 4 0\n1 1 2 3 5\n";
  EXPECT_NE(message("bad.node").find("there is no point 5"), std::string::npos) << message("bad.node");
  std::ofstream(folder / "bad.ele") << "1 4 0\n1 1 2 4 3\n";  // numbered from 1, negative volume
  EXPECT_GT(volume_mm3(*load_tets(folder / "bad.ele")), 0.16);
  std::ofstream(folder / "bad.ele") << "99999999999 4 0\n";
  EXPECT_NE(message("bad.ele").find("cannot be the number"), std::string::npos);
  std::filesystem::remove_all(folder);
}

TEST(Skin, PointsBesideFlatTetrahedraAreThemselves) {
  // On top of a good tetrahedron lies a flat one; half a millimetre above it is a point of the surface.
  TetMesh rest;
  for (const Vec3 p : {Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0.2, 0.2, -1e-4}, Vec3{0.2, 0.2, -1}})
    rest.points_mm.push_back(to_floats(p + Vec3{100, -50, 0}));
  rest.tets = {{0, 2, 1, 3}, {0, 3, 1, 4}, {1, 3, 2, 4}, {2, 3, 0, 4}};
  for (auto& t : rest.tets) {
    const auto at = [&](std::size_t k) {
      const auto& p = rest.points_mm[t[k]];
      return Vec3{p[0], p[1], p[2]};
    };
    if (dot(cross(at(1) - at(0), at(2) - at(0)), at(3) - at(0)) < 0) std::swap(t[2], t[3]);
  }
  TriMesh surface;
  for (const Vec3 p : {Vec3{100.3, -49.7, 0.5}, Vec3{100.6, -49.9, 0.5}, Vec3{100.1, -49.5, 0.5}})
    surface.points_mm.push_back(to_floats(p));
  surface.triangles = {{0, 1, 2}};
  const Skin skin(surface, rest);
  EXPECT_EQ(skin.outside(), 3u);
  for (const double angle : {0.0, 0.7}) {
    const double c = std::cos(angle), n = std::sin(angle);
    const Mat3 turn{{Vec3{c, 0, n}, Vec3{0, 1, 0}, Vec3{-n, 0, c}}};
    std::vector<std::array<float, 3>> points, out(3);
    for (const auto& p : rest.points_mm) points.push_back(to_floats(turn * Vec3{p[0], p[1], p[2]}));
    skin.apply(points, out);
    for (std::size_t i = 0; i < 3; ++i) {
      const auto& p = surface.points_mm[i];
      const Vec3 off = turn * Vec3{p[0], p[1], p[2]} - Vec3{out[i][0], out[i][1], out[i][2]};
      EXPECT_LT(length(off), angle == 0 ? 1e-5 : 2e-4) << angle;  // 8e-6 mm is what a coordinate of 100 is rounded to
    }
  }
}

TEST(Skin, FramesWhereBodiesMeetInAPointMoveRigidly) {
  // Two cubes with one corner in common: what their six faces there face cancels.
  Frame frame;
  frame.dims = {4, 4, 4};
  frame.spacing_mm = {1, 1, 1};
  VoxelBits two(frame);
  two.words[two.row(1, 1)] |= 1U << 1;
  two.words[two.row(2, 2)] |= 1U << 2;
  const TetMesh rest = grid_tets(two);
  TriMesh surface;
  surface.points_mm = {{1.7F, 1.4F, 1.55F}, {1.4F, 1.6F, 1.5F}, {1.5F, 1.45F, 1.7F}};
  surface.triangles = {{0, 1, 2}};
  const Skin skin(surface, rest, {SkinMethod::frames, 5});
  const double c = std::cos(0.7), n = std::sin(0.7);
  const Mat3 about_z{{Vec3{c, n, 0}, Vec3{-n, c, 0}, Vec3{0, 0, 1}}},
      about_x{{Vec3{1, 0, 0}, Vec3{0, c, n}, Vec3{0, -n, c}}};
  const auto turned_round = [&](const std::array<float, 3>& p) { return about_z * (about_x * Vec3{p[0], p[1], p[2]}); };
  std::vector<std::array<float, 3>> points, out(3);
  for (const auto& p : rest.points_mm) points.push_back(to_floats(turned_round(p)));
  skin.apply(points, out);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto& p = surface.points_mm[i];
    EXPECT_LT(length(turned_round(p) - Vec3{out[i][0], out[i][1], out[i][2]}), 1e-5);
  }
}

TEST(Skin, RestAndAffineMotionAreExact) {
  const TriangleSoup s = sphere(10, 4);
  const TriMesh skin_mesh = mesh_of(s);
  const VoxelBits in = voxels_inside(s, frame_around(s, 12, 2));
  for (const bool dilate : {true, false}) {  // without, some points lie outside the mesh
    const TetMesh rest = grid_tets(dilate ? in.dilated() : in);
    for (const SkinMethod method : {SkinMethod::embedded, SkinMethod::frames}) {
      const Skin skin(skin_mesh, rest, {method, 5});
      EXPECT_TRUE(method == SkinMethod::frames || (skin.outside() == 0) == dilate);
      const auto worst = [&](const Mat3& a, Vec3 b) {
        std::vector<std::array<float, 3>> points(rest.points_mm.begin(), rest.points_mm.end()), out(skin.point_count());
        for (auto& p : points) {
          const Vec3 q = a * Vec3{p[0], p[1], p[2]} + b;
          p = {float(q.x), float(q.y), float(q.z)};
        }
        skin.apply(points, out);
        double d = 0;
        for (std::size_t i = 0; i < out.size(); ++i) {
          const auto& p = skin_mesh.points_mm[i];
          d = std::max(d, length(a * Vec3{p[0], p[1], p[2]} + b - Vec3{out[i][0], out[i][1], out[i][2]}));
        }
        return d;
      };
      EXPECT_LT(worst({}, {}), 1e-5);  // rest
      const double c = std::cos(0.7), n = std::sin(0.7);
      EXPECT_LT(worst({{Vec3{c, n, 0}, Vec3{-n, c, 0}, Vec3{0, 0, 1}}}, {3, -2, 1}), 2e-5);       // rigid
      const double stretched = worst({{Vec3{1.3, 0, 0}, Vec3{0.2, 1, 0}, Vec3{0, 0, 0.8}}}, {});  // affine
      if (method == SkinMethod::embedded) {
        EXPECT_LT(stretched, 3e-5);
      } else {
        EXPECT_GT(stretched, 0.05);  // frames cannot stretch
      }
    }
  }
  const TetMesh rest = grid_tets(in);
  const Skin skin(skin_mesh, rest);
  std::vector<std::array<float, 3>> few(3), out(skin.point_count());
  EXPECT_THROW(skin.apply(few, out), Error);
}

TEST(Stuffing, KeepsThinWallsAndOpensHinges) {
  // A box of 40 mm with walls of 1 mm, at a spacing of 2: most of it was lost.
  const TriangleSoup thin = joined(box({0, 0, 0}, {40, 40, 40}), turned(box({1, 1, 1}, {39, 39, 39})));
  const double volume = 64000 - 38.0 * 38 * 38;
  const double lost = volume_mm3(stuffed_tets(thin, {2, 15}));
  EXPECT_LT(lost, 0.8 * volume);
  const KeptThin kept = stuffed_tets_keeping(thin, {2, 15}, volume, 0.05, 3);
  EXPECT_LT(kept.spacing_mm, 2);
  EXPECT_NEAR(volume_mm3(kept.mesh), volume, 0.05 * volume);
  const TetQuality q = tet_quality(kept.mesh);
  EXPECT_EQ(q.inverted, 0U);
  EXPECT_TRUE(q.boundary_closed && q.boundary_manifold);
  // What is thick enough stays as it is.
  EXPECT_EQ(stuffed_tets_keeping(sphere(10, 3), {2, 15}, volume_mm3(stuffed_tets(sphere(10, 4), {1, 15})), 0.05, 3)
                .spacing_mm,
            2);
}

TEST(Stuffing, HingesComeApart) {
  // Two tetrahedra that share a point, two that share an edge, two that share a face.
  TetMesh m;
  m.points_mm = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
  m.tets = {{0, 1, 2, 3}, {0, 4, 6, 5}};
  EXPECT_EQ(open_hinges(m), 1U);
  EXPECT_EQ(m.points_mm.size(), 8U);
  EXPECT_TRUE(check(boundary_of(m)).manifold());
  EXPECT_EQ(open_hinges(m), 0U);
  m.points_mm.resize(7);
  m.tets = {{0, 1, 2, 3}, {0, 3, 4, 5}};
  EXPECT_EQ(open_hinges(m), 2U);
  EXPECT_TRUE(check(boundary_of(m)).manifold());
  m.points_mm.resize(7);
  m.tets = {{0, 1, 2, 3}, {0, 2, 4, 3}};
  EXPECT_EQ(open_hinges(m), 0U);
}

TEST(TetMeshes, AreRefusedWhereTheyAreNone) {
  TetMesh m;
  m.points_mm = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  m.tets = {{0, 1, 2, 3}};
  EXPECT_NO_THROW(require_sound(m));
  const auto path = std::filesystem::temp_directory_path() / ("osteo-unsound-" + std::to_string(::getpid()) + ".vtu");
  const auto refused = [&](const std::string& what) {
    try {
      save_tets(m, path);
      ADD_FAILURE() << what;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::failed);
      EXPECT_NE(std::string(e.what()).find(what), std::string::npos) << e.what();
    }
    EXPECT_FALSE(std::filesystem::exists(path));
  };
  m.points_mm[3][1] = std::numeric_limits<float>::infinity();
  refused("no finite number");
  m.points_mm[3] = {0, 0, -1};
  refused("1 of 1 tetrahedra are inside out");
  m.points_mm[3] = {0, 0, 0};
  refused("inside out or have no volume");
  for (auto& p : m.points_mm) p = {1e8F, 1e8F, 1e8F};
  refused("kept to 8 mm");
}

TEST(TetMeshes, OfQuadraticElementsAreTheirCorners) {
  const auto path = std::filesystem::temp_directory_path() / ("osteo-quadratic-" + std::to_string(::getpid()) + ".vtu");
  std::ofstream(path) << R"(<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian"><UnstructuredGrid><Piece NumberOfPoints="10" NumberOfCells="1">
<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">0 0 0 .5 0 0 1 0 0 .5 .5 0 0 1 0 0 .5 0 0 0 .5 .5 0 .5 0 .5 .5 0 0 1</DataArray></Points>
<Cells><DataArray type="Int64" Name="connectivity" format="ascii">0 2 4 9 1 3 5 6 7 8</DataArray><DataArray type="Int64" Name="offsets" format="ascii">10</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">24</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>)";
  const Tets back = load_tets(path);
  std::filesystem::remove(path);
  ASSERT_EQ(back->points_mm.size(), 4U);
  EXPECT_EQ(back->tets[0], (std::array<std::uint32_t, 4>{0, 1, 2, 3}));
  EXPECT_EQ(back->points_mm[3], (std::array<float, 3>{0, 0, 1}));
}

}  // namespace
}  // namespace osteo
