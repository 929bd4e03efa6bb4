#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "osteo/bone/live_surface.h"
#include "osteo/haptics/servo.h"

namespace osteo {
namespace {

// A slab of bone below z = 0, 40 x 40 x 16 mm, in voxels of h.
BrickGrid slab(double h) {
  Frame f;
  f.dims = {static_cast<int>(40 / h), static_cast<int>(40 / h), static_cast<int>(20 / h)};
  f.spacing_mm = {h, h, h};
  f.origin_mm = {-20 + h / 2, -20 + h / 2, -16 + h / 2};
  std::vector<Ijk> bricks;
  for (int k = 0; k <= f.dims[2] / 8; ++k)
    for (int j = 0; j <= f.dims[1] / 8; ++j)
      for (int i = 0; i <= f.dims[0] / 8; ++i) bricks.push_back({i, j, k});
  BrickGrid g(f, bricks);
  for (int k = 0; k < f.dims[2]; ++k)
    for (int j = 0; j < f.dims[1]; ++j)
      for (int i = 0; i < f.dims[0]; ++i) {
        const double top = f.world_from_index({0, 0, double(k)}).z + h / 2;
        g.set(g.find(i, j, k), static_cast<float>(std::clamp((h - top) / h, 0.0, 1.0)));
      }
  return g;
}

DeviceSample at(double x, double y, double z, int tool = 3) {
  DeviceSample s;
  s.position_mm = {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
  s.axis = {0.6F, 0, 0.8F};
  s.drill_on = 1;
  s.tool = static_cast<std::uint8_t>(tool);
  return s;
}

TEST(CapDepth, InvertsTheVolumeOfACap) {
  for (double r = 0.5; r < 4; r += 0.7) {
    for (double d = 0; d <= 2 * r; d += r / 17) {
      EXPECT_NEAR(cap_depth_mm(std::numbers::pi * d * d * (r - d / 3), r), d, 1e-6 * r);
    }
  }
  EXPECT_EQ(cap_depth_mm(-1, 2), 0);
  EXPECT_NEAR(cap_depth_mm(1e9, 2), 4, 1e-6);
}

TEST(Contact, FlatBoneGivesDepthAndDirection) {
  const auto bone = slab(0.5);
  VolumeSampling model({});
  for (const double depth : {0.2, 0.5, 1.0, 1.8}) {
    const auto r = model.contact(bone, at(0.13, -0.21, 2 - depth));
    EXPECT_NEAR(r.depth_mm, depth, 0.06) << depth;
    EXPECT_GT(r.force_n.z / length(r.force_n), 0.999);
  }
  EXPECT_EQ(length(model.contact(bone, at(0, 0, 2.3)).force_n), 0);
  EXPECT_EQ(length(model.contact(bone, at(500, 0, 0)).force_n), 0);
}

TEST(Contact, ForceIsContinuousAndCapped) {
  const auto bone = slab(0.5);
  ContactParams params;
  VolumeSampling model(params);
  double before = 0;
  for (double z = 2.5; z > -1; z -= 0.01) {
    const double f = length(model.contact(bone, at(0.1, 0.2, z)).force_n);
    EXPECT_LE(f, params.max_force_n + 1e-9);
    // 0.01 mm may change the force by its stiffness times that, and the sampling adds its own grain.
    EXPECT_LT(std::abs(f - before), 0.30) << z;
    before = f;
  }
}

TEST(Contact, NotANumberGivesNoForce) {
  const auto bone = slab(1);
  VolumeSampling model({});
  auto pose = at(0, 0, 0);
  pose.position_mm[1] = std::numeric_limits<float>::quiet_NaN();
  const auto r = model.contact(bone, pose);
  EXPECT_EQ(length(r.force_n), 0);
  EXPECT_EQ(r.immersed, 0u);
}

TEST(Removal, WhatIsTakenIsWhatIsMissing) {
  auto bone = slab(0.5);
  const double before = bone.sum();
  VolumeSampling model({});
  double removed = 0;
  for (int t = 0; t < 3000; ++t) {
    model.contact(bone, at(2 * std::sin(t / 300.0), 2 * std::cos(t / 300.0), 1.5 - t / 3000.0));
    model.remove(bone, 1e-3, removed);
  }
  EXPECT_GT(removed, 5);
  EXPECT_NEAR((before - bone.sum()) * 0.125, removed, 1e-3 * removed);
}

// The rate is a property of the burr, not of voxels or ticks: a hand of constant force drills the same volume.
TEST(Removal, SameVolumeForAnyVoxelAndTick) {
  const auto drill = [](double h, double rate_hz) {
    auto bone = slab(h);
    VolumeSampling model({});
    SpringHand hand;
    double removed = 0;
    Vec3 force{};
    for (int t = 0; t < static_cast<int>(2 * rate_hz); ++t) {
      HandGoal goal;
      const double s = t / rate_hz;
      goal.position_mm = {4 * std::sin(6 * s), 4 * std::cos(6 * s), 0.4 - 1.0 * s};
      goal.axis = {0.6F, 0, 0.8F};
      goal.drill_on = 1;
      goal.tool = 3;
      const auto r = model.contact(bone, hand.step(goal, 1 / rate_hz, force));
      force = r.force_n;
      model.remove(bone, 1 / rate_hz, removed);
    }
    return removed;
  };
  const double reference = drill(0.5, 1000);
  EXPECT_GT(reference, 4);
  for (const auto& [h, hz] : {std::pair{0.25, 1000.0}, {1.0, 1000.0}, {0.5, 500.0}, {0.5, 4000.0}}) {
    EXPECT_NEAR(drill(h, hz) / reference, 1, 0.05) << h << " mm, " << hz << " Hz";
  }
}

TEST(Removal, PoleRemovesLessThanEquator) {
  const auto drill = [](std::array<float, 3> axis) {
    auto bone = slab(0.5);
    VolumeSampling model({});
    double removed = 0;
    auto pose = at(0, 0, 1.6);
    pose.axis = axis;
    model.contact(bone, pose);
    model.remove(bone, 1e-3, removed);
    return removed;
  };
  EXPECT_LT(drill({0, 0, 1}), 0.6 * drill({1, 0, 0}));
}

TEST(LiveSurface, FollowsTheDrillToTheBit) {
  auto bone = slab(0.5);
  LiveSurface live(bone, {});
  VolumeSampling model({});
  Stream stream;
  StreamReader& reader = stream.add_reader();
  Script script;
  script.axis = {0.6, 0, 0.8};
  script.waypoints = {{0, {-5, 0, 4}, true}, {0.3, {-5, 0, 0}, true}, {1.0, {5, 3, -2}, true}};
  ScriptedDevice device(script, 1000);
  Servo servo(bone, model, device, stream, 1000);
  std::vector<VoxelChange> changes(4096);
  while (servo.step(0)) {
    TickRecord tick;
    ASSERT_EQ(reader.ticks.pop({&tick, 1}), 1u);
    const std::size_t n = reader.changes.pop(changes);
    ASSERT_EQ(n, tick.voxels_changed);
    for (std::size_t c = 0; c < n; ++c) live.mark(changes[c].voxel);
    if (tick.tick % 37 == 0) live.update();
  }
  live.update();
  EXPECT_EQ(servo.ticks(), 1000u);
  EXPECT_EQ(surface_hash(live.joined().mesh), surface_hash(surface_nets(bone).mesh));
}

TEST(SpringHand, RestsOnBoneInsteadOfPassingThrough) {
  const auto bone = slab(0.5);
  VolumeSampling model({});
  SpringHand hand;
  HandGoal goal;
  goal.tool = 3;
  Vec3 force{};
  DeviceSample pose;
  double mean_force = 0, mean_z = 0;
  float lowest = 100, highest = -100;
  for (int t = 0; t < 4000; ++t) {
    goal.position_mm = {0, 0, t < 500 ? 5.0 : 0.0};  // 2 mm below contact
    pose = hand.step(goal, 1e-3, force);
    force = model.contact(bone, pose).force_n;
    if (t < 3000) continue;
    mean_force += force.z / 1000;
    mean_z += static_cast<double>(pose.position_mm[2]) / 1000;
    lowest = std::min(lowest, pose.position_mm[2]);
    highest = std::max(highest, pose.position_mm[2]);
  }
  EXPECT_GT(lowest, 1.4F);
  EXPECT_LT(highest - lowest, 0.05F);           // at rest, but for the grain of the samples
  EXPECT_NEAR(mean_force, 0.8 * mean_z, 0.02);  // in balance with the spring
}

}  // namespace
}  // namespace osteo
