// Surfaces after an action of the scene: only what it changed is made again, and nothing of that is missing.
#include "osteo/session/scene/detail/surface_reader.h"

#include <gtest/gtest.h>

#include "bar.h"
#include "osteo/simulation/bone/saw.h"

namespace osteo {
namespace {

// Its voxels lie along the axes: bricks of 4 mm, whose middle voxel is at a multiple of 4 mm.
BrickGrid bar() {
  return test::bar(0.5, 0);
}
std::string fresh(const World& world) {
  return SurfaceReader(world, {}).hash();
}

// A block whose values differ from voxel to voxel, so that each of them moves the surface around it.
BrickGrid block() {
  Frame f;
  f.dims = {24, 24, 24};
  BrickGrid g = BrickGrid::dense(f);
  for (std::uint32_t b = 0; b < g.brick_count(); ++b) {
    for (VoxelKey v = 0; v < BrickGrid::kVoxels; ++v) {
      const VoxelKey key = b * BrickGrid::kVoxels + v;
      const Ijk c = g.coordinate(key);
      const bool is_bone = (c.i + c.j + c.k) % 2 == 0;
      g.set(key, is_bone ? 0.8F : 0.2F);
    }
  }
  return g;
}

// As World::act tells of bodies that differ in these bricks.
World::Effect changed(const World& world, const std::vector<std::uint32_t>& bricks) {
  World::Effect e;
  e.changed.push_back({world.bodies().front().body->id, bricks});
  return e;
}

// One voxel of the middle brick of 27: the first and the second from its faces, edges and corners.
TEST(SurfaceReader, ADifferenceAtAnyDepthOfABrickIsFollowedAndTakenBack) {
  const World before(block());
  SurfaceReader reader(before, {});
  const std::string begin = reader.hash();
  for (const int i : {0, 1, 6, 7}) {
    for (const int j : {1, 6}) {
      for (const int k : {0, 1, 7}) {
        BrickGrid bone = block();
        const VoxelKey key = bone.find(8 + i, 8 + j, 8 + k);
        bone.set(key, 1 - bone.value(key));
        const World after(std::move(bone));
        const World::Effect effect = changed(before, {key / BrickGrid::kVoxels});
        reader.scene_changed(after, effect);
        const std::string now = reader.hash();
        ASSERT_NE(now, begin);
        ASSERT_EQ(now, fresh(after)) << i << ' ' << j << ' ' << k;
        reader.scene_changed(before, effect);
        ASSERT_EQ(reader.hash(), begin) << "taken back " << i << ' ' << j << ' ' << k;
      }
    }
  }
}

// Two differences of one brick, far from each other: what lies between their reach is made again as well.
TEST(SurfaceReader, DifferencesAtBothEndsOfABrickAreFollowed) {
  const World before(block());
  SurfaceReader reader(before, {});
  BrickGrid bone = block();
  for (const Ijk c : {Ijk{8, 15, 9}, Ijk{15, 8, 14}}) {
    const VoxelKey key = bone.find(c.i, c.j, c.k);
    bone.set(key, 1 - bone.value(key));
  }
  const std::uint32_t brick = bone.find(8, 8, 8) / BrickGrid::kVoxels;
  const World after(std::move(bone));
  reader.scene_changed(after, changed(before, {brick}));
  EXPECT_EQ(reader.hash(), fresh(after));
  reader.scene_changed(before, changed(before, {brick}));
  EXPECT_EQ(reader.hash(), fresh(before));
}

// A saw's faces, voxel by voxel through a whole brick, along each axis: cut, and taken back.
TEST(SurfaceReader, ACutAnywhereInABrickIsFollowedAndTakenBack) {
  const Vec3 across[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    World world(bar());
    SurfaceReader reader(world, {});
    const std::string begin = reader.hash();
    for (int voxel = 0; voxel < 8; ++voxel) {
      const SawCut cut{across[axis] * (0.5 * voxel - 1.9), across[axis], across[(axis + 1) % 3], 0.6};
      reader.scene_changed(world, world.act(SceneAction::saw(cut)));
      ASSERT_NE(reader.hash(), begin);
      ASSERT_EQ(reader.hash(), fresh(world)) << axis << ": " << voxel;
      reader.scene_changed(world, world.act(SceneAction::plain(ActionKind::undo)));
      ASSERT_EQ(reader.hash(), begin) << axis << ": " << voxel;
    }
  }
}

}  // namespace
}  // namespace osteo
