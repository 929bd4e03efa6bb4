// Bone goes only where the burr has been: against the volume that it swept.
#include <gtest/gtest.h>

#include <numbers>

#include "osteo/simulation/haptics/detail/grains.h"
#include "overlap_kernel.h"
#include "sweep.h"

namespace osteo {
namespace {

using test::block;
using test::dwell;
using test::Face;
using test::groove;
using test::Path;
using test::removed_mm3;
using test::swept_mm3;

constexpr double kMax = 1.01, kMin = 0.97;

// The counting of sweep.h itself: a cap, and a capsule's part below a plane.
TEST(Sweep, IsThatOfClosedForms) {
  const double d = 0.46, r = 2, cap = std::numbers::pi * d * d * (r - d / 3);
  EXPECT_NEAR(swept_mm3(dwell(3, d, 0), {}) / cap, 1, 2e-3);
  const double a = std::acos((r - d) / r), segment = r * r * (a - std::sin(a) * std::cos(a));
  EXPECT_NEAR(swept_mm3(groove(3, d, 1, 1, 0), {}) / (cap + 4.06 * segment), 1, 2e-3);
}

TEST(Removal, ARestingBurrTakesItsCapAndNoMore) {
  for (const ContactMethod method :
       {ContactMethod::overlap, ContactMethod::proxy, ContactMethod::volume, ContactMethod::rays}) {
    SCOPED_TRACE(EnumNames<ContactMethod>::values[static_cast<std::size_t>(method)]);
    for (const auto& [h, high] : {std::pair{0.25, 0.07}, {0.35, 0.1}, {0.5, 0.0}, {0.6, 0.23}, {0.9, 0.31}}) {
      const Face face{{0, 0, 1}, high};
      Path path = dwell(3, 0.46, 2);
      path.from_mm.z += high;
      path.legs[0].to_mm.z += high;
      auto bone = block(h, face);
      const double ratio = removed_mm3(path, bone, method, 500) / (std::numbers::pi * 0.46 * 0.46 * (2 - 0.46 / 3));
      EXPECT_LT(ratio, kMax) << h;
      EXPECT_GT(ratio, kMin) << h;
    }
  }
}

TEST(Removal, EveryBurrTakesWhatItSweptAndNoMore) {
  const Face face{normalized({0.03, -0.02, 1}), 0.13};
  for (const BurrShape shape : {BurrShape::ball, BurrShape::cylinder, BurrShape::taper}) {
    for (const BurrKind kind : {BurrKind::cutting, BurrKind::diamond}) {
      for (const double diameter : {2.0, 4.0, 7.0}) {
        const int tool = burr_index(kind, diameter, shape);
        // Tapers lie on their side, cylinders stand on their dome.
        const Vec3 axis = shape == BurrShape::taper      ? Vec3{0.2, 0.95, 0.2}
                          : shape == BurrShape::cylinder ? Vec3{0.2, 0.1, 1}
                                                         : Vec3{0.6, 0, 0.8};
        Path path = groove(tool, 0.35, 1, 1, 0, axis);
        const double swept = swept_mm3(path, face, 50000);
        // So slow that time suffices: the burr takes rate * force, and what is left presses less and less.
        path.legs[1].mm_per_s =
            4.06 * 0.015 * burr_library()[static_cast<std::size_t>(tool)].rate_mm3_per_s_per_n / swept;
        auto bone = block(0.5, face);
        const double ratio = removed_mm3(path, bone, ContactMethod::overlap, 250) / swept;
        EXPECT_LT(ratio, kMax) << burr_library()[static_cast<std::size_t>(tool)].name();
        EXPECT_GT(ratio, kMin) << burr_library()[static_cast<std::size_t>(tool)].name();
      }
    }
  }
}

// What it has covered at any time counts, so that passes side by side leave no ridges; tick and voxel do not matter.
TEST(Removal, PassesSideBySideLeaveNoRidges) {
  const Face face{{0, 0, 1}, 0.11};
  const Path path = groove(3, 0.4, 1, 4, 0.6);
  const double swept = swept_mm3(path, face);
  for (const auto& [h, hz] : {std::pair{0.5, 1000.0}, {0.5, 5000.0}, {0.6, 500.0}, {0.28, 500.0}}) {
    auto bone = block(h, face);
    const double ratio = removed_mm3(path, bone, ContactMethod::overlap, hz) / swept;
    EXPECT_LT(ratio, kMax) << h << " " << hz;
    EXPECT_GT(ratio, kMin) << h << " " << hz;
  }
}

// Where the hand is too fast for the burr, its rate decides; where it comes back, the rest goes.
TEST(Removal, AFastHandLeavesBoneAndTakesItTheNextTime) {
  Path path = groove(3, 0.4, 40, 1, 0);
  const double swept = swept_mm3(path, {});
  auto bone = block(0.5, {});
  const double once = removed_mm3(path, bone, ContactMethod::overlap, 1000);
  EXPECT_LT(once, 0.7 * swept);
  auto again = block(0.5, {});
  for (int n = 0; n < 80; ++n) path.legs.push_back({path.legs[1].to_mm + Vec3{n % 2 == 0 ? -4.06 : 0, 0, 0}, 40});
  const double ratio = removed_mm3(path, again, ContactMethod::overlap, 1000) / swept;
  EXPECT_LT(ratio, kMax);
  EXPECT_GT(ratio, kMin);
}

TEST(Grains, SameBitsForEveryInstructionSet) {
  const overlap::GrainFunctions* const sets[] = {&overlap::kGrainsBase, &overlap::kGrainsAvx2, &overlap::kGrainsAvx512};
  if (!__builtin_cpu_supports("avx2")) GTEST_SKIP() << "this machine has no AVX2";
  std::uint32_t state = 1;
  const auto u = [&] { return static_cast<float>((state = state * 1664525U + 1013904223U) >> 8) * 0x1p-24F * 2 - 1; };
  std::uint32_t some = 0;
  for (int n = 0; n < 3000; ++n) {
    const std::uint32_t parts = n % 3 == 0 ? 1 : n % 3 == 1 ? 2 : 4;
    const float slope = n % 2 == 0 ? 0.0F : 0.2F;
    const overlap::Shape shape{
        {0.6F, 0, 0.8F}, n % 4 < 2 ? 0.0F : 6.0F, 2.1F, n % 4 == 3 ? slope : 0, n % 4 == 3 ? 0.204F : 0, 0, n % 4 < 2};
    const float at[3] = {3 * u(), 3 * u(), 3 * u()}, normal[3] = {u(), u(), u()};
    std::uint64_t left[3][64];
    std::uint32_t count[3][2];
    for (int f = 0; f < (__builtin_cpu_supports("avx512vl") ? 3 : 2); ++f) {
      std::fill_n(left[f], 64, ~std::uint64_t{0});
      count[f][0] = sets[f]->plane(normal, 0.3F * at[0], parts, left[f]);
      count[f][1] = sets[f]->take(shape, at, parts, left[f]);
      ASSERT_EQ(count[0][0], count[f][0]);
      ASSERT_EQ(count[0][1], count[f][1]);
      ASSERT_TRUE(std::equal(left[0], left[0] + 64, left[f]));
    }
    some += count[0][1] > 0 && count[0][1] < count[0][0] ? 1 : 0;
  }
  EXPECT_GT(some, 100u);
}

TEST(Grains, HalfAVoxelIsHalfItsBone) {
  for (const double h : {0.2, 0.5, 0.9}) {
    auto bone = block(h, {{0, 0, 1}, 0.0});
    Grains grains(bone);
    const VoxelKey voxel = bone.find(4, 4, 2);
    ASSERT_EQ(bone.value(voxel), 1.0F);
    const Vec3 middle = bone.frame().world_from_index({4, 4, 2});
    // So large a ball that its surface is a plane through the voxel's middle.
    const RoundCone ball{0, 0, 50, 50};
    grains.place(bone, ball, middle + Vec3{0, 0, 50}, {0, 0, 1}, true);
    EXPECT_NEAR(grains.reach(bone, voxel), 0.5, 0.02) << h;
    grains.place(bone, ball, middle + Vec3{0, 0, 50 + 2 * h}, {0, 0, 1}, true);
    EXPECT_NEAR(grains.reach(bone, voxel), 0.5, 0.02);  // it has been there
    grains.place(bone, ball, middle + Vec3{50, 0, 0}, {0, 0, 1}, true);
    EXPECT_NEAR(grains.reach(bone, voxel), 0.25, h < 0.28 ? 0.07 : 0.02);
    grains.place(bone, ball, middle, {0, 0, 1}, true);
    EXPECT_EQ(grains.reach(bone, voxel), 0);
    EXPECT_EQ(grains.used(), 0u);
  }
}

// A voxel half full of bone, below: what covers its upper half takes nothing, what covers its left half takes a half of
// it.
TEST(Grains, BoneLiesOnItsNeighboursSide) {
  const double h = 0.5;
  auto bone = block(h, {{0, 0, 1}, -1.5});
  const Vec3 at = bone.frame().index_from_world({0, 0, -1.5});
  const int k = static_cast<int>(std::lround(at.z));
  const VoxelKey voxel = bone.find(4, 4, k);
  const float full = bone.value(voxel);
  ASSERT_NEAR(full, 0.5, 1e-3);
  const Vec3 middle = bone.frame().world_from_index({4, 4, double(k)});
  Grains grains(bone);
  const RoundCone ball{0, 0, 50, 50};
  grains.place(bone, ball, middle + Vec3{0, 0, 50 + 0.02 * h}, {0, 0, 1}, true);
  EXPECT_NEAR(grains.reach(bone, voxel), full, 0.01);
  grains.place(bone, ball, middle - Vec3{50, 0, 0}, {0, 0, 1}, true);
  EXPECT_NEAR(grains.reach(bone, voxel), 0.5F * full, 0.01);
}

// With no room left voxels stay whole until they are covered whole; it is told, and those known already are not lost.
TEST(Grains, WithoutRoomBoneStays) {
  Frame f;
  f.dims = {16, 16, 16};
  f.spacing_mm = {1, 1, 1};
  BrickGrid bone = BrickGrid::dense(f);
  const auto voxels = static_cast<VoxelKey>(bone.brick_count() * BrickGrid::kVoxels);
  for (VoxelKey v = 0; v < voxels; ++v) bone.set(v, 1);
  Grains grains(bone);
  ASSERT_LT(grains.room(), voxels);
  const RoundCone ball{0, 0, 0.4, 0.4}, large{0, 0, 2, 2};
  const auto at = [&](VoxelKey v) {
    const Ijk c = bone.coordinate(v);
    return Vec3{double(c.i), double(c.j), double(c.k)};
  };
  std::size_t whole = 0;
  for (VoxelKey v = 0; v < voxels; ++v) {
    grains.place(bone, ball, at(v), {0, 0, 1}, true);
    whole += grains.reach(bone, v) == 1.0F ? 1 : 0;
  }
  EXPECT_EQ(grains.used(), grains.room());
  EXPECT_EQ(whole, voxels - grains.room());
  EXPECT_TRUE(grains.overflowed());
  EXPECT_FALSE(grains.overflowed());
  // In another order, so that what moved up when others went is found.
  for (VoxelKey v = 0; v < voxels; ++v) {
    const VoxelKey w = v * 1031 % voxels;
    grains.place(bone, ball, at(w) + Vec3{9, 0, 0}, {0, 0, 1}, true);
    const float left = grains.reach(bone, w);
    ASSERT_NEAR(left, w < grains.room() ? 1 - 4.0 / 3 * std::numbers::pi * 0.064 : 1, 0.01) << w;
    if (v % 2 == 0) continue;
    grains.place(bone, large, at(w), {0, 0, 1}, true);
    ASSERT_EQ(grains.reach(bone, w), 0);
  }
  EXPECT_LT(grains.used(), grains.room());
}

// A bone that came out of another by a saw: what was covered stays so, in proportion; what came back is whole.
TEST(Grains, GoOnInWhatBecomesOfABone) {
  auto bone = block(0.5, {{0, 0, 1}, 0.0});
  Grains grains(bone);
  const VoxelKey sawn = bone.find(4, 4, 2), kept = bone.find(5, 4, 2), back = bone.find(6, 4, 2);
  const RoundCone ball{0, 0, 50, 50};
  const auto reach = [&](Grains& g, const BrickGrid& b, VoxelKey v, double lift) {
    g.place(b, ball, b.frame().world_from_index({4, 4, 2}) + Vec3{0, 0, 50 + lift}, {0, 0, 1}, true);
    return g.reach(b, v);
  };
  for (const VoxelKey v : {sawn, kept, back}) ASSERT_NEAR(reach(grains, bone, v, 0), 0.5, 0.02);
  bone.set(back, 0.5F);
  BrickGrid after(bone);
  after.set(sawn, 0.4F);
  after.set(back, 1.0F);
  Grains next(after);
  next.inherit(after, bone, grains);
  EXPECT_NEAR(reach(next, after, sawn, 9), 0.2, 0.02);
  EXPECT_NEAR(reach(next, after, kept, 9), 0.5, 0.02);
  EXPECT_EQ(reach(next, after, back, 9), 1.0F);
}

// Bricks that both bones have are taken over as a whole: nothing else comes of it than voxel by voxel.
TEST(Grains, GoOnAlikeInSharedBricksAndInCopies) {
  auto bone = block(0.5, {{0, 0, 1}, 0.0});
  Grains grains(bone);
  const RoundCone ball{0, 0, 2, 2};
  const auto voxels = static_cast<VoxelKey>(bone.brick_count() * BrickGrid::kVoxels);
  const auto place = [&](Grains& g, const BrickGrid& b, double lift) {
    g.place(b, ball, b.frame().world_from_index({4, 4, 2}) + Vec3{0, 0, lift}, {0, 0, 1}, true);
  };
  place(grains, bone, 0);
  for (VoxelKey v = 0; v < voxels; ++v) bone.set(v, std::min(bone.value(v), grains.reach(bone, v)));
  const BrickGrid shared = bone.sharing(), copy(bone);
  ASSERT_TRUE(shared.shares_brick(0, bone, 0));
  ASSERT_FALSE(copy.shares_brick(0, bone, 0));
  Grains in_shared(shared), in_copy(copy);
  in_shared.inherit(shared, bone, grains);
  in_copy.inherit(copy, bone, grains);
  EXPECT_EQ(in_shared.used(), grains.used());
  EXPECT_EQ(in_copy.used(), grains.used());
  for (Grains* const g : {&grains, &in_shared, &in_copy}) place(*g, bone, 0.7);
  for (VoxelKey v = 0; v < voxels; ++v) {
    const float expected = grains.reach(bone, v);
    ASSERT_EQ(in_shared.reach(shared, v), expected) << v;
    ASSERT_EQ(in_copy.reach(copy, v), expected) << v;
  }
}

// Through a saw cut far off, taking apart and undoing both, what the burr has covered stays known.
TEST(Removal, WhereTheBurrHasBeenOutlivesSawSplitAndUndo) {
  World world(block(0.5, {}));
  HapticSetup setup;
  setup.device = SpringHand::traits();
  HapticRenderer renderer(setup, {}, 1e-3);
  auto scene = std::make_unique<HapticScene>(HapticScene::of(world, renderer.setup()));
  renderer.show(scene.get());
  const Path path = dwell(3, 0.46, 2);
  for (int t = 0; t < path.seconds() * 1000; ++t) static_cast<void>(renderer.step(path.sample(t * 1e-3)));
  const std::size_t known = scene->items.front().bone->grains().used();
  ASSERT_GT(known, 10u);
  const auto known_after = [&](const SceneAction& action) {
    EXPECT_TRUE(world.act(action).done);
    scene = std::make_unique<HapticScene>(HapticScene::of(world, renderer.setup(), scene.get()));
    std::size_t sum = 0;
    for (const HapticScene::Item& i : scene->items) sum += i.bone->grains().used();
    return sum;
  };
  EXPECT_EQ(known_after(SceneAction::saw({{3.1, 0, 0}, {1, 0, 0}, {0, 1, 0}, 1})), known);
  EXPECT_EQ(known_after(SceneAction::split(1)), known);
  EXPECT_EQ(world.bodies().size(), 2u);
  EXPECT_EQ(known_after(SceneAction::plain(ActionKind::undo)), known);
  EXPECT_EQ(known_after(SceneAction::plain(ActionKind::undo)), known);
  EXPECT_EQ(world.bodies().size(), 1u);
}

// A piece that was moved, its grid askew: the burr's place is that in the piece.
TEST(Removal, APieceThatWasMovedLosesWhatWasSweptInIt) {
  auto bone = block(0.5, {});
  HapticSetup setup;
  setup.params.effects.shaft = setup.params.effects.fail_safe = setup.params.effects.vibration = false;
  setup.device = SpringHand::traits();
  HapticRenderer renderer(setup, {}, 1e-3);
  const Vec3 n = normalized({0.3, -0.5, 0.4});
  const RigidTransform pose{frame_of_axis(n), {30, -12, 7}};
  HapticScene scene;
  scene.add(std::make_shared<TouchedBone>(bone, nullptr), pose, renderer.setup());
  renderer.show(&scene);
  const Path path = dwell(3, 0.46, 2);
  const double before = bone.sum();
  double reported = 0;
  for (int t = 0; t < path.seconds() * 1000; ++t) {
    DeviceSample s = path.sample(t * 1e-3);
    s.position_mm = to_floats(pose(from_floats(s.position_mm)));
    s.axis = to_floats(pose.rotation * from_floats(s.axis));
    reported += static_cast<double>(renderer.step(s).record.removed_mm3);
  }
  const double removed = (before - bone.sum()) * bone.frame().voxel_volume_mm3();
  EXPECT_NEAR(removed / (std::numbers::pi * 0.46 * 0.46 * (2 - 0.46 / 3)), 0.99, 0.02);
  EXPECT_NEAR(reported, removed, 1e-4 * removed);
}

TEST(Removal, BurrsTooSmallForTheirVoxelsAreTold) {
  const auto reported = [](double diameter, BurrShape shape, double h) {
    return too_small_for_voxels(
        burr_library()[static_cast<std::size_t>(burr_index(BurrKind::cutting, diameter, shape))], h);
  };
  EXPECT_EQ(reported(2, BurrShape::ball, 0.5), "");
  EXPECT_EQ(reported(4, BurrShape::taper, 0.5), "");
  EXPECT_NE(reported(2, BurrShape::taper, 0.5), "");
  const std::string text = reported(2, BurrShape::ball, 0.9);
  for (const char* const part : {"cutting 2 mm", "0.9 mm", "1.1 voxels", "from 0.5 mm", "--spacing"})
    EXPECT_NE(text.find(part), std::string::npos) << text;
}

// Where nothing is known any more of where the burr has been, as where a session goes on from another's end, the bone's
// own shape stands in for it: the same path again takes a little more at first touch.
TEST(Removal, OnBoneThatWasDrilledBeforeLittleMoreGoes) {
  const Face face{normalized({0.1, 0.05, 1}), 0.11};
  for (const auto& [h, most] : {std::pair{0.2, 0.01}, {0.5, 0.03}, {0.9, 0.08}}) {
    auto bone = block(h, face);
    const Path path = groove(3, 0.46, 0.4, 1, 0);
    const double swept = swept_mm3(path, face, 50000), first = removed_mm3(path, bone, ContactMethod::overlap, 500);
    EXPECT_LT(first + removed_mm3(path, bone, ContactMethod::overlap, 500), (1 + most) * swept) << h;
  }
}

}  // namespace
}  // namespace osteo
