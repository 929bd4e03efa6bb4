#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "bar.h"
#include "osteo/core/data/rigid_transform.h"
#include "osteo/geometry/mesh/bone_surface.h"
#include "osteo/geometry/mesh/mesh_info.h"
#include "osteo/simulation/bone/pieces.h"
#include "osteo/simulation/bone/saw.h"

namespace osteo {
namespace {

using test::bar;

TEST(Saw, RemovesTheKerfAndPartsTheBone) {
  for (const double turn : {0.0, 0.7}) {
    for (const double h : {0.5, 1.0}) {
      const BrickGrid whole = bar(h, turn);
      BrickGrid bone = whole;
      std::vector<VoxelKey> changed;
      const double removed = apply_saw(bone, {{2, 0, 0}, {1, 0, 0}, {0, 0, 1}, 2.2}, changed);
      EXPECT_NEAR(removed, 2.2 * 10 * 8, 0.03 * 176) << h;
      EXPECT_NEAR((whole.sum() - bone.sum()) * h * h * h, removed, 1e-3 * removed);
      const Split split = split_bone(bone, 1);
      ASSERT_EQ(split.pieces.size(), 2u);
      // 15.9 and 11.9 mm long.
      EXPECT_NEAR(split.pieces[0].volume_mm3(), 15.9 * 80, 0.03 * 1272);
      EXPECT_NEAR(split.pieces[1].volume_mm3(), 11.9 * 80, 0.03 * 952);
      EXPECT_NEAR(split.pieces[0].solid.centre_mm.x, -15 + 15.9 / 2, 0.15);
      EXPECT_NEAR(split.pieces[1].solid.centre_mm.x, 15 - 11.9 / 2, 0.15);
      // Nothing is lost.
      EXPECT_NEAR(split.pieces[0].volume_mm3() + split.pieces[1].volume_mm3() + split.crumbs_mm3,
                  bone.sum() * h * h * h, 1e-3);
      // Two closed surfaces.
      for (const Piece& p : split.pieces) EXPECT_TRUE(is_closed(soup_of(surface_nets(p.bone).mesh)));
    }
  }
}

TEST(Saw, ABladeOfItsSizeCutsOnlyThere) {
  BrickGrid bone = bar(0.5, 0.3);
  std::vector<VoxelKey> changed;
  // 4 mm deep into a bar of 10 mm, from the side: it does not part.
  const double removed = apply_saw(bone, {{0, 5, 0}, {1, 0, 0}, {0, 0, 1}, 1, 40, 8}, changed);
  EXPECT_NEAR(removed, 1 * 4 * 8, 2);
  EXPECT_EQ(split_bone(bone, 1).pieces.size(), 1u);
  changed.clear();
  EXPECT_EQ(apply_saw(bone, {{100, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1}, changed), 0);
  EXPECT_TRUE(changed.empty());
}

TEST(Pieces, TenAtOnceAndCrumbsApart) {
  BrickGrid bone = bar(0.5, 0);
  std::vector<VoxelKey> changed;
  for (int c = 0; c < 9; ++c) apply_saw(bone, {{-12.0 + 3 * c, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1}, changed);
  EXPECT_EQ(split_bone(bone, 10).pieces.size(), 10u);
  const Split split = split_bone(bone, 165);  // the two at the ends are 2.5 mm long, the others 2
  EXPECT_EQ(split.pieces.size(), 2u);
  EXPECT_EQ(split.crumbs, 8u);
  EXPECT_NEAR(split.crumbs_mm3, 8 * 160, 40);
}

TEST(RigidTransform, ComposesAndInverts) {
  const RigidTransform a = rotation_about({1, 2, 3}, {0, 0, 1}, std::numbers::pi / 2);
  EXPECT_LT(length(a({1, 2, 3}) - Vec3{1, 2, 3}), 1e-12);
  EXPECT_LT(length(a({2, 2, 3}) - Vec3{1, 3, 3}), 1e-12);
  const RigidTransform b{rotation_about({}, normalized({1, 1, 0}), 0.4).rotation, {5, 6, 7}};
  const Vec3 p{0.3, -2, 9};
  EXPECT_LT(length((a * b)(p)-a(b(p))), 1e-12);
  EXPECT_LT(length((a * b).inverse()((a * b)(p)) - p), 1e-12);
}

}  // namespace
}  // namespace osteo
