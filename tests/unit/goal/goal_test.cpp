// The cavity that a procedure asks for, in a slab of which everything is known.
#include <gtest/gtest.h>

#include <cmath>

#include "../evidence/scene.h"
#include "osteo/assessment/goal/goal.h"
#include "osteo/core/base/error.h"

namespace osteo {
namespace {

// Bone below z = 8; cells (2) as a ball of 4 mm at z = 0, and beside it a rod along y (1) that is to be left alone.
World slab() {
  return test::solid_world(
      [](Vec3 p) {
        return std::min({8.0 - p.z, p.z + 11, 12 - std::abs(p.x), 12 - std::abs(p.y)});
      },
      0.5, 32);
}
StructureMap rod_and_cells(double rod_x) {
  return test::structure_map(
      [=](Vec3 p) -> std::uint8_t {
        if (std::hypot(p.x - rod_x, p.z) < 1.5 && std::abs(p.y) < 10) return 1;
        return length(p) < 4 ? 2 : 0;
      },
      {{1, "rod", {}}, {2, "cells", {}}}, 0.5, 30);
}
Procedure procedure(const std::string& role = "never_touch", const std::string& kind = "target") {
  return parse_procedure(
      "{ \"osteotome_procedure\": 1, \"name\": \"t\", \"structures\": [ {\"name\": \"rod\", \"role\": \"" + role +
          "\"}, {\"name\": \"cells\", \"role\": \"enter\"} ], \"regions\": [ {\"name\": \"around the cells\", "
          "\"kind\": \"" +
          kind +
          "\", \"structure\": \"cells\", \"within_mm\": 1} ], \"items\": [ {\"name\": \"shown\", \"kind\": "
          "\"exposed\", \"structure\": \"rod\", \"towards\": [0, 0, 1], \"within_deg\": 60, \"threshold\": 0.1} ] }",
      "t.json");
}
GoalOptions down(double slope = 0.25) {
  GoalOptions o;
  o.toward = Vec3{0, 0, 1};
  o.slope = slope;
  return o;
}

// Far from the rod the goal is a shaft over the ball and the millimetre around it, to the ball's lower end.
TEST(Goal, OpensWhatIsToBeOpened) {
  const World world = slab();
  const GoalCavity g = goal_cavity(world, rod_and_cells(20), procedure(), down(0));
  EXPECT_TRUE(g.has({0, 0, 7}));
  EXPECT_TRUE(g.has({0, 0, -3}));
  EXPECT_FALSE(g.has({0, 0, -6.5}));
  EXPECT_FALSE(g.has({10, 0, 7}));
  // From above, columns of burrs whose lowest point comes within 1 mm of the ball: up to 5 mm from the middle,
  // and the burr's own radius beyond.
  EXPECT_TRUE(g.has({4.5, 0, 7}));
  const double least = M_PI * 5 * 5 * 8, most = M_PI * 7 * 7 * 13;
  EXPECT_GT(g.bone_mm3, least);
  EXPECT_LT(g.bone_mm3, most);
}

// The margin holds along the whole of every burr's way, whatever the role, and is the one that is reported.
TEST(Goal, KeepsTheMarginOfEachRole) {
  const World world = slab();
  for (const char* const role : {"never_touch", "expose", "thin"}) {
    const StructureMap map = rod_and_cells(6);
    const Procedure rules = procedure(role);
    const GoalCavity g = goal_cavity(world, map, rules, down());
    ASSERT_EQ(g.margins.size(), 1U);
    const double asked = kept_mm(rules.structures[0].role);
    EXPECT_EQ(g.margins[0].asked_mm, asked);
    EXPECT_GE(g.margins[0].margin_mm, asked - 0.05) << role;
    EXPECT_LT(g.margins[0].margin_mm, asked + 0.6) << role;
    // Looked at independently: no place of the cavity lies nearer to the rod's axis.
    double nearest = 99;
    for (double x = -12; x <= 12; x += 0.25)
      for (double z = -10; z <= 8; z += 0.25)
        for (const double y : {-3.0, 0.0, 2.5})
          if (g.has({x, y, z})) nearest = std::min(nearest, std::hypot(x - 6, z) - 1.5);
    EXPECT_GE(nearest, asked - 0.45) << role;  // floor and columns have steps of half a millimetre
  }
}

// Where a margin forbids the straight way, another direction is better.
TEST(Goal, TakesADirectionThatReachesMore) {
  const World world = slab();
  const StructureMap over = test::structure_map(
      [](Vec3 p) -> std::uint8_t {
        if (std::abs(p.x - 2.5) < 1.5 && std::abs(p.z - 6) < 0.8 && std::abs(p.y) < 10) return 1;
        return length(p) < 4 ? 2 : 0;
      },
      {{1, "rod", {}}, {2, "cells", {}}}, 0.5, 30);
  const GoalCavity straight = goal_cavity(world, over, procedure(), down());
  const GoalCavity best = goal_cavity(world, over, procedure());
  EXPECT_LT(dot(best.toward, Vec3{0, 0, 1}), 0.99);
  EXPECT_GE(best.margins[0].margin_mm, 1 - 0.05);
  std::size_t reached_straight = 0, reached_best = 0;
  for (double x = -4; x <= 4; x += 0.5)
    for (double y = -4; y <= 4; y += 0.5)
      for (double z = -4; z <= 4; z += 0.5) {
        if (length(Vec3{x, y, z}) > 4) continue;
        reached_straight += straight.has({x, y, z}) ? 1 : 0;
        reached_best += best.has({x, y, z}) ? 1 : 0;
      }
  EXPECT_GT(reached_best, reached_straight);
}

TEST(Goal, IsWiderAbove) {
  const World world = slab();
  const StructureMap map = rod_and_cells(20);
  const auto width = [&](const GoalCavity& g, double z) {
    int n = 0;
    for (double x = -12; x <= 12; x += 0.5) n += g.has({x, 0, z}) ? 1 : 0;
    return n;
  };
  const GoalCavity narrow = goal_cavity(world, map, procedure(), down(0)),
                   wide = goal_cavity(world, map, procedure(), down(0.5));
  EXPECT_GT(width(wide, 7.5), width(narrow, 7.5));
  EXPECT_GE(width(wide, 7.5), width(wide, 0));
  EXPECT_EQ(width(wide, -3), width(narrow, -3));
}

TEST(Goal, ScoresWhatWasDoneLeftAndBeyond) {
  const World world = slab();
  const GoalCavity g = goal_cavity(world, rod_and_cells(20), procedure(), down(0));
  const BrickGrid& before = world.bodies().front().body->bone;
  const auto after = [&](auto gone) {
    return test::solid_world(
        [&](Vec3 p) {
          const double solid = std::min({8.0 - p.z, p.z + 11, 12 - std::abs(p.x), 12 - std::abs(p.y)});
          return gone(p) ? -1.0 : solid;
        },
        0.5, 32);
  };
  const GoalScore nothing = score_against(g, before, before);
  EXPECT_EQ(nothing.dice, 0);
  EXPECT_NEAR(nothing.left_mm3, g.bone_mm3, 1e-6 * g.bone_mm3);
  const World all = after([&](Vec3 p) { return g.has(p); });
  const GoalScore whole = score_against(g, before, all.bodies().front().body->bone);
  EXPECT_GT(whole.dice, 0.97);
  EXPECT_LT(whole.beyond_mm3, 0.03 * g.bone_mm3);
  const World deep = after([&](Vec3 p) { return g.has(p + Vec3{0, 0, 1}); });
  const GoalScore beyond = score_against(g, before, deep.bodies().front().body->bone);
  EXPECT_GT(beyond.beyond_mm3, 20);
  EXPECT_NEAR(beyond.beyond_mm, 1, 0.6);
  EXPECT_LT(beyond.dice, whole.dice);
  const World half = after([&](Vec3 p) { return g.has(p) && p.x > 0; });
  const GoalScore one_side = score_against(g, before, half.bodies().front().body->bone);
  EXPECT_NEAR(one_side.done_mm3, g.bone_mm3 / 2, 0.06 * g.bone_mm3);
}

TEST(Goal, SaysWhyThereIsNone) {
  const World world = slab();
  const auto said = [&](const StructureMap& map, const Procedure& rules, const GoalOptions& o) {
    try {
      (void)goal_cavity(world, map, rules, o);
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string("nothing");
  };
  EXPECT_NE(said(rod_and_cells(20), procedure("never_touch", "forbidden"), down()).find("no target region"),
            std::string::npos);
  GoalOptions shallow = down();
  shallow.most_depth_mm = 1;
  EXPECT_NE(said(rod_and_cells(20), procedure(), shallow).find("reaches the target regions"), std::string::npos);
}

}  // namespace
}  // namespace osteo
