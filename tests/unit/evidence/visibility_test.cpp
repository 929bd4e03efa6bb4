// Seen or hidden: against every voxel's box, one by one.
#include "osteo/assessment/evidence/visibility.h"

#include <gtest/gtest.h>

#include <random>

#include "osteo/geometry/grid/brick_places.h"
#include "osteo/simulation/bone/instrument.h"
#include "scene.h"

namespace osteo {
namespace {

// Whether the open segment passes through the inside of a voxel's cube.
bool passes(const Frame& f, Ijk at, Vec3 from_mm, Vec3 to_mm) {
  const Vec3 a = f.index_from_world(from_mm), b = f.index_from_world(to_mm);
  const double lo[3] = {at.i - 0.5, at.j - 0.5, at.k - 0.5};
  double t0 = 0, t1 = 1;
  for (std::size_t x = 0; x < 3; ++x) {
    const double d = b[x] - a[x];
    if (std::abs(d) < 1e-15) {
      if (a[x] <= lo[x] || a[x] >= lo[x] + 1) return false;
      continue;
    }
    const double u = (lo[x] - a[x]) / d, v = (lo[x] + 1 - a[x]) / d;
    t0 = std::max(t0, std::min(u, v));
    t1 = std::min(t1, std::max(u, v));
  }
  return t0 < t1 - 1e-12;
}

bool by_every_voxel(const World& world, Vec3 from, Vec3 to, const BoneSight::LeftOut& left_out) {
  for (const PlacedBody& b : world.bodies()) {
    const BrickGrid& bone = b.body->bone;
    const RigidTransform back = b.world_from_body.inverse();
    for (VoxelKey v = 0; v < bone.brick_count() * BrickGrid::kVoxels; ++v) {
      if (bone.value(v) >= kSolid && passes(bone.frame(), bone.coordinate(v), back(from), back(to)) &&
          !(left_out && left_out(b, v)))
        return true;
    }
  }
  return false;
}

// A shell with holes.
double sponge(Vec3 p) {
  const double r = length(p);
  return std::min(2.0 - std::abs(r - 7),
                  0.8 - std::sin(p.x * 1.3) * std::cos(p.y * 1.7) * std::sin(p.z * 1.1 + 1) * 2.5);
}

TEST(Visibility, ARayIsAsEveryVoxelsBoxSays) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(-1, 1);
  for (const double turn : {0.0, 0.4}) {
    World world = test::solid_world(sponge, 0.5, 20, {0.13, -0.21, 0.07}, turn);
    if (turn > 0)
      static_cast<void>(world.act(SceneAction::move(0, {rotation_about({}, {0, 0, 1}, 0.3).rotation, {1, 2, 3}})));
    const BoneSight sight(world);
    int blocked = 0;
    for (int n = 0; n < 150; ++n) {
      const Vec3 from{u(random) * 9, u(random) * 9, u(random) * 9},
          to = normalized({u(random), u(random), u(random)}) * (5 + 60 * std::abs(u(random)));
      const BoneSight::LeftOut out =
          n % 2 == 0 ? BoneSight::LeftOut() : [](const PlacedBody&, VoxelKey v) { return v % 3 == 0; };
      const bool is = sight.blocked(from, to, out);
      ASSERT_EQ(is, by_every_voxel(world, from, to, out)) << n << ' ' << turn;
      blocked += is ? 1 : 0;
    }
    EXPECT_GT(blocked, 30);
    EXPECT_LT(blocked, 145);
  }
}

TEST(Visibility, AlongAxesAndFromOutside) {
  const World world = test::solid_world([](Vec3 p) { return 2 - length(p); }, 0.5, 16, {0.25, 0.25, 0.25});
  const BoneSight sight(world);
  EXPECT_TRUE(sight.blocked({-30, 0.1, 0.1}, {30, 0.1, 0.1}));
  EXPECT_TRUE(sight.blocked({30, 0.1, 0.1}, {-30, 0.1, 0.1}));
  EXPECT_FALSE(sight.blocked({-30, 3.1, 0.1}, {30, 3.1, 0.1}));
  EXPECT_FALSE(sight.blocked({-30, 0, 0}, {-10, 0, 0}));
  EXPECT_TRUE(sight.blocked({0.1, 0.1, 0.1}, {0.1, 0.1, 40}));
}

// A burr goes into a block from above; a roof stands over half of its way.
class Drilled : public ::testing::Test {
 protected:
  Drilled()
      : world_(test::solid_world([](Vec3 p) { return std::max(-p.z, std::min(1.0 - std::abs(p.z - 4), -p.x)); }, 0.5,
                                 24)) {}

  // Takes the bone within 0.9 mm of a point, in one frame, by a small burr there.
  void take(VisibilityMetric& metric, Vec3 at, std::uint64_t tick, const CameraPose* camera) {
    BrickGrid& bone = world_.bodies().front().body->bone;
    std::vector<VoxelChange> changes;
    for (VoxelKey v = 0; v < bone.brick_count() * BrickGrid::kVoxels; ++v) {
      if (bone.value(v) < kSolid || length(place_of_voxel_mm(bone, v) - at) > 0.9) continue;
      changes.push_back({v, 0, bone.value(v)});
      bone.set(v, 0);
    }
    ASSERT_FALSE(changes.empty());
    TickRecord t;
    t.tick = tick;
    t.device.position_mm = to_floats(at);
    t.device.tool = static_cast<std::uint8_t>(instrument_index("cutting 2 mm"));
    t.removed_mm3 = 1;
    metric.frame({1000, {}, {&t, 1}, changes, {}, world_, camera, 0});
  }
  static double value(const std::vector<Measured>& values, const std::string& name) {
    for (const Measured& m : values) {
      if (m.name() == name) return m.value.value_or(-1);
    }
    return -2;
  }
  World world_;
};

TEST_F(Drilled, WhatLiesUnderARoofIsHidden) {
  const CameraPose above{0, {0.3, 0.2, 200}, {}};
  VisibilityMetric metric({1000, nullptr, nullptr});
  take(metric, {6, 0, -0.2}, 10, &above);
  const std::size_t open = metric.voxels().size();
  take(metric, {-6, 0, -0.2}, 20, &above);
  const std::size_t all = metric.voxels().size();
  for (const auto& [name, v] : metric.voxels())
    EXPECT_EQ(v.seen, v.own_mm.x > 0 ? VisibilityMetric::Seen::seen : VisibilityMetric::Seen::hidden);
  std::vector<Measured> values;
  std::vector<Moment> moments;
  metric.finish(world_, values, moments);
  EXPECT_DOUBLE_EQ(value(values, "seen_share"), static_cast<double>(open) / static_cast<double>(all));
  EXPECT_DOUBLE_EQ(value(values, "hidden_mm3"), 0.125 * static_cast<double>(all - open));
}

// Unseen and next to a structure at risk is a moment, one a second of each; what is 2 mm off and more is none.
TEST_F(Drilled, UnseenNextToAStructureIsAMomentASecond) {
  const StructureMap map = test::structure_map(
      [](Vec3 p) -> std::uint8_t {
        if (p.x > -8 && p.x < -4 && p.z > -4 && p.z < -2 && std::abs(p.y) < 9) return p.y < 3 ? 1 : 2;
        return 0;
      },
      {{1, "nerve", {}}, {2, "vein", {}}, {3, "nowhere", {}}}, 0.5, 24);
  const CameraPose above{0, {0.3, 0.2, 200}, {}};
  VisibilityMetric metric({1000, &map, nullptr});
  const std::size_t last = 8;
  const std::pair<Vec3, std::uint64_t> taken[last + 1] = {{{6, 0, -0.2}, 50},      // seen
                                                          {{-10.5, 0, -0.2}, 60},  // unseen, but far from both
                                                          {{-6, -8, -1.2}, 100},  {{-6, -6, -1.2}, 1099},
                                                          {{-6, -4, -1.2}, 1100}, {{-6, -2, -1.2}, 1600},
                                                          {{-6, 7, -1.2}, 1700},  // of the other
                                                          {{-6, 0, -1.2}, 2101},  {{-6, 5, -1.2}, 2699}};
  for (const auto& [at, tick] : taken) take(metric, at, tick, &above);
  double seen = 0, hidden = 0, near[3] = {};
  for (const auto& [name, v] : metric.voxels()) {
    (v.seen == VisibilityMetric::Seen::seen ? seen : hidden) += 0.125;
    if (v.seen == VisibilityMetric::Seen::seen) continue;
    // Faces are planes but for the ends.
    const StructureMap::Answer a = map.at_risk(v.own_mm);
    if (a.distance_mm <= 2 && a.structure > 0) near[a.structure - 1] += 0.125;
  }
  EXPECT_GT(near[0], 1);
  EXPECT_GT(near[1], 1);
  EXPECT_LT(near[0] + near[1], hidden);
  std::vector<Measured> values;
  std::vector<Moment> moments;
  metric.finish(world_, values, moments);
  EXPECT_DOUBLE_EQ(value(values, "seen_share"), seen / (seen + hidden));
  EXPECT_DOUBLE_EQ(value(values, "hidden_mm3"), hidden);
  EXPECT_EQ(value(values, "sight_unknown_mm3"), -2) << "all of it is known";
  EXPECT_DOUBLE_EQ(value(values, "hidden_near_mm3[nerve]"), near[0]);
  EXPECT_DOUBLE_EQ(value(values, "hidden_near_mm3[vein]"), near[1]);
  std::vector<std::pair<std::string, double>> told,
      wanted{{"nerve", 0.1}, {"nerve", 1.1}, {"vein", 1.7}, {"nerve", 2.101}};
  for (const Moment& m : moments) {
    EXPECT_EQ(m.what, "removed unseen");
    EXPECT_LE(m.value, 2);
    EXPECT_EQ(m.limit, 2);
    told.emplace_back(m.structure, m.t_s);
  }
  EXPECT_EQ(told, wanted);
}

// Before the first note of a camera it is not known what was seen; the shares are of what is.
TEST_F(Drilled, WhatNoCameraWasThereForIsUnknown) {
  const CameraPose above{0, {0.3, 0.2, 200}, {}};
  VisibilityMetric metric({1000, nullptr, nullptr});
  take(metric, {6, 0, -0.2}, 10, nullptr);
  const std::size_t unknown = metric.voxels().size();
  take(metric, {6, 5, -0.2}, 20, &above);
  std::vector<Measured> values;
  std::vector<Moment> moments;
  metric.finish(world_, values, moments);
  EXPECT_EQ(value(values, "seen_share"), 1);
  EXPECT_EQ(value(values, "hidden_mm3"), 0);
  EXPECT_DOUBLE_EQ(value(values, "sight_unknown_mm3"), 0.125 * static_cast<double>(unknown));
  EXPECT_TRUE(moments.empty());
}

// What the burr touches does not hide what it takes; what lies a voxel farther does.
TEST_F(Drilled, BoneInTouchWithTheBurrDoesNotHide) {
  const CameraPose aside{0, {200, 0.2, -2.9}, {}};
  VisibilityMetric metric({1000, nullptr, nullptr});
  take(metric, {6, 0, -3}, 10, &aside);
  for (const auto& [name, v] : metric.voxels()) EXPECT_EQ(v.seen, VisibilityMetric::Seen::hidden);
  // The same at the very edge of the block: all that is between is touched.
  VisibilityMetric edge({1000, nullptr, nullptr});
  take(edge, {11.2, 0, -3}, 20, &aside);
  for (const auto& [name, v] : edge.voxels())
    EXPECT_EQ(v.seen, VisibilityMetric::Seen::seen) << v.own_mm.x << ' ' << v.own_mm.z;
}

TEST_F(Drilled, WithoutACameraNothingIsSaidAndUndoTakesBack) {
  VisibilityMetric metric({1000, nullptr, nullptr});
  take(metric, {6, 0, -0.2}, 10, nullptr);
  const VoxelKey first = metric.voxels().begin()->first;
  std::vector<Measured> values;
  std::vector<Moment> moments;
  world_.bodies().front().body->bone.set(first, 1);
  const std::size_t before = metric.voxels().size();
  metric.finish(world_, values, moments);
  EXPECT_EQ(metric.voxels().size(), before - 1);
  ASSERT_FALSE(values.empty());
  for (const Measured& m : values) {
    EXPECT_FALSE(m.value);
    EXPECT_EQ(m.word, "the session has no camera notes");
  }
  VisibilityMetric none({1000, nullptr, nullptr});
  values.clear();
  none.finish(world_, values, moments);
  EXPECT_EQ(values.front().word, "no voxel lost half of its bone");
}

}  // namespace
}  // namespace osteo
