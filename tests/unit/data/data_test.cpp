#include "osteo/core/data/data.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "osteo/core/base/error.h"

namespace osteo {
namespace {

Frame turned() {
  const double c = std::cos(0.3), s = std::sin(0.3);
  return {{4, 5, 6}, {0.5, 1.5, 2}, {10, -20, 30}, {{Vec3{c, s, 0}, {-s, c, 0}, {0, 0, 1}}}};
}

TEST(Frame, WorldAndIndexAreInverse) {
  const Frame f = turned();
  for (const Vec3 ijk : {Vec3{0, 0, 0}, {3, 4, 5}, {-2.5, 7, 0.25}})
    EXPECT_LT(length(f.index_from_world(f.world_from_index(ijk)) - ijk), 1e-12);
  EXPECT_EQ(f.voxel_count(), 120U);
  EXPECT_DOUBLE_EQ(f.voxel_volume_mm3(), 1.5);
  EXPECT_LT(length(f.centre_mm() - (f.world_from_index({0, 0, 0}) + f.world_from_index({3, 4, 5})) * 0.5), 1e-12);
}

TEST(Frame, WhatIsNoFrameIsRefused) {
  const auto code_of = [](const Frame& f) {
    try {
      require_valid(f);
    } catch (const Error& e) {
      return e.code();
    }
    return ExitCode::ok;
  };
  EXPECT_EQ(code_of(turned()), ExitCode::ok);
  const auto with = [&](auto&& change) {
    Frame f = turned();
    change(f);
    return code_of(f);
  };
  EXPECT_EQ(with([](Frame& f) { f.dims[1] = 0; }), ExitCode::corrupt);
  EXPECT_EQ(with([](Frame& f) { f.spacing_mm.x = -1; }), ExitCode::corrupt);
  EXPECT_EQ(with([](Frame& f) { f.spacing_mm.x = std::numeric_limits<double>::quiet_NaN(); }), ExitCode::corrupt);
  EXPECT_EQ(with([](Frame& f) { f.origin_mm.z = std::numeric_limits<double>::infinity(); }), ExitCode::corrupt);
  EXPECT_EQ(with([](Frame& f) { f.direction.column[0] = {1, 0.1, 0}; }), ExitCode::corrupt);
  EXPECT_EQ(with([](Frame& f) { f.direction.column[0] = f.direction.column[0] * -1; }),
            ExitCode::ok);  // left-handed may be
}

TEST(Frame, SamePlaceLooksAtCornersNotAtNumbers) {
  const Frame f = turned();
  Frame g = f;
  g.origin_mm.x += 5e-4;
  EXPECT_TRUE(same_place(f, g));
  g.origin_mm.x += 1e-3;
  EXPECT_FALSE(same_place(f, g));
  g = f;
  g.spacing_mm.z += 3e-4;  // five voxels on that is 1.5 micrometres
  EXPECT_FALSE(same_place(f, g));
  g = f;
  ++g.dims[0];
  EXPECT_FALSE(same_place(f, g));
}

TEST(Frame, OrientationCodeIsTheNearestDirection) {
  EXPECT_EQ(orientation_code(turned()), "LPS");
  Frame f;
  f.direction = {{Vec3{0, -1, 0}, {0, 0, -1}, {-1, 0, 0}}};
  EXPECT_EQ(orientation_code(f), "AIR");
}

TEST(Volume, SampleIsLinearAndHoldsTheBorder) {
  Frame f;
  f.dims = {2, 2, 2};
  auto v = make_voxels<std::int16_t>(8);
  for (int n = 0; n < 8; ++n)
    v[static_cast<std::size_t>(n)] = static_cast<std::int16_t>(100 * (n & 1) + 10 * ((n >> 1) & 1) + (n >> 2));
  const Image image{f, v};
  EXPECT_EQ(image.at(1, 1, 1), 111);
  EXPECT_NEAR(sample_linear(image, {0.25, 0.5, 0.75}), 25 + 5 + 0.75, 1e-9);
  EXPECT_NEAR(sample_linear(image, {-3, 9, 0}), 10, 1e-9);
}

TEST(Data, KindsFollowTheAlternatives) {
  EXPECT_EQ(kind_of(std::monostate{}), DataKind::none);
  EXPECT_EQ(kind_of(Source{"x"}), DataKind::source);
  EXPECT_EQ(kind_of(Image{}), DataKind::image);
  EXPECT_EQ(kind_of(Labels{}), DataKind::labels);
  EXPECT_EQ(kind_of(SparseGrid{}), DataKind::grid);
  EXPECT_EQ(kind_of(Surface{}), DataKind::surface);
  EXPECT_EQ(kind_of(Picture{}), DataKind::picture);
  EXPECT_EQ(kind_of(Document{}), DataKind::document);
  EXPECT_EQ(kind_of(Tets{}), DataKind::tets);
  EXPECT_EQ(kind_name(DataKind::tets), "tets");
}

TriMesh tetrahedron() {
  return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}

TEST(TriMesh, FlawsAreCounted) {
  TriMesh m = tetrahedron();
  EXPECT_TRUE(check(m).watertight());
  EXPECT_TRUE(check(m).manifold());
  EXPECT_NEAR(enclosed_volume_mm3(m), 1.0 / 6, 1e-12);
  EXPECT_NEAR(area_mm2(m), 1.5 + std::numbers::sqrt3 / 2, 1e-7);
  std::swap(m.triangles[0][0], m.triangles[0][1]);
  EXPECT_EQ(check(m).misoriented_edges, 3U);
  m = tetrahedron();
  m.triangles.pop_back();
  EXPECT_EQ(check(m).open_edges, 3U);
  m = tetrahedron();
  m.triangles.push_back({0, 0, 1});
  EXPECT_EQ(check(m).degenerate, 1U);
  m = tetrahedron();
  for (auto t : tetrahedron().triangles) {  // a second one that shares a corner
    for (auto& i : t) i = i == 0 ? 0 : i + 3;
    m.triangles.push_back(t);
  }
  for (const auto& p : {std::array<float, 3>{-1, 0, 0}, {0, -1, 0}, {0, 0, -1}}) m.points_mm.push_back(p);
  EXPECT_EQ(check(m).nonmanifold_points, 1U);
  EXPECT_TRUE(check(m).watertight());
}

TEST(TetMesh, BoundaryIsClosedFacesOutAndHoldsTheVolume) {
  TetMesh m;
  // Two tetrahedra over a common face, and a point that nothing uses.
  for (const auto& p : {std::array<float, 3>{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {9, 9, 9}, {0, 0, 1}, {0, 0, -1}})
    m.points_mm.push_back(p);
  m.tets.push_back({0, 1, 2, 4});
  m.tets.push_back({0, 2, 1, 5});
  EXPECT_NEAR(volume_mm3(m), 2.0 / 6, 1e-12);
  std::vector<std::uint32_t> from;
  const TriMesh skin = boundary_of(m, &from);
  EXPECT_EQ(skin.triangles.size(), 6U);
  EXPECT_EQ(skin.points_mm.size(), 5U);
  EXPECT_TRUE(check(skin).watertight());
  EXPECT_NEAR(enclosed_volume_mm3(skin), 2.0 / 6, 1e-7);
  for (std::size_t p = 0; p < from.size(); ++p) EXPECT_EQ(skin.points_mm[p], m.points_mm[from[p]]);
}

}  // namespace
}  // namespace osteo
