// Planned cuts against what was sawn, where the truth is known: planes displaced and turned by given amounts.
#include "osteo/assessment/evidence/score.h"

#include <gtest/gtest.h>

#include <numbers>

#include "scene.h"

namespace osteo {
namespace {

constexpr double kDeg = std::numbers::pi / 180;

// A bar along z of 14 x 10 x 52 mm, on a lattice that lies askew to it.
World bar(double h = 0.5) {
  return test::solid_world(
      [](Vec3 p) {
        return std::min({7 - std::abs(p.x), 5 - std::abs(p.y), 26 - std::abs(p.z)});
      },
      h, 64, {}, 0.2);
}

PlannedCut planned(const char* name, Vec3 at, Vec3 normal, double kerf = 1) {
  PlannedCut c;
  c.name = name;
  c.cut.at_mm = at;
  c.cut.normal = normal;
  c.cut.along = {1, 0, 0};
  c.cut.kerf_mm = kerf;
  return c;
}

// Off by `mm` along the planned normal, and turned by `deg` about a direction in the plane, through the planned place.
SawCut sawn_off(const PlannedCut& p, double mm, double deg) {
  SawCut c = p.cut;
  const Vec3 n = normalized(c.normal);
  c.normal = rotation_about({}, any_perpendicular(n), deg * kDeg).rotation * n;
  c.at_mm += n * mm;
  return c;
}

const std::vector<PlannedCut>& two() {
  static const std::vector<PlannedCut> cuts{planned("low", {0, 0, -12}, {0.1, 0.2, 1}),
                                            planned("high", {0, 0, 9}, {-0.15, 0.05, 2}, 0.8)};
  return cuts;
}

TEST(PlannedSawing, ADisplacedAndTurnedPlaneIsTold) {
  for (const double mm : {0.0, 0.5, -1.7}) {
    for (const double deg : {0.0, 2.0, 7.0}) {
      World left = bar();
      left.act(SceneAction::saw(sawn_off(two()[0], mm, deg)));
      const auto planes = sawn_planes(bar(), left, std::span(two()).first(1));
      ASSERT_EQ(planes.size(), 1U);
      ASSERT_EQ(planes[0].why, "") << mm << ' ' << deg;
      // The middle of the section lies beside the plan's place: the turned plane is elsewhere there by so much.
      EXPECT_NEAR(planes[0].off_mm, mm, 0.05) << deg;
      EXPECT_NEAR(planes[0].angle_deg, deg, 0.2) << mm;
      // A kerf of 1 mm through 14 x 10 mm, in voxels of 0.125 mm3, and those that it only touches.
      EXPECT_GT(planes[0].voxels, 1000U);
      EXPECT_LT(planes[0].voxels, 2500U);
    }
  }
}

TEST(PlannedSawing, TwoCutsInAnyOrderAndPiecesThatWereMoved) {
  const SawCut low = sawn_off(two()[0], 0.5, 2), high = sawn_off(two()[1], -0.8, 4);
  std::vector<std::vector<SawnPlane>> all;
  for (const bool low_first : {true, false}) {
    World left = bar();
    left.act(SceneAction::saw(low_first ? low : high));
    left.act(SceneAction::saw(low_first ? high : low));
    all.push_back(sawn_planes(bar(), left, two()));
    left.act(SceneAction::split(5));
    ASSERT_EQ(left.bodies().size(), 3U);
    left.act(SceneAction::move(left.bodies()[1].body->id, rotation_about({}, {1, 0, 0}, 0.5)));
    all.push_back(sawn_planes(bar(), left, two()));
  }
  // The plan's own order is no matter either.
  World left = bar();
  left.act(SceneAction::saw(low));
  left.act(SceneAction::saw(high));
  const std::vector<PlannedCut> swapped{two()[1], two()[0]};
  all.push_back(sawn_planes(bar(), left, swapped));
  std::swap(all.back()[0], all.back()[1]);
  for (const auto& planes : all) {
    for (const SawnPlane& p : planes) ASSERT_EQ(p.why, "");
    EXPECT_NEAR(planes[0].off_mm, 0.5, 0.05);
    EXPECT_NEAR(planes[0].angle_deg, 2, 0.2);
    EXPECT_NEAR(planes[1].off_mm, -0.8, 0.05);
    EXPECT_NEAR(planes[1].angle_deg, 4, 0.2);
    EXPECT_NEAR(planes[0].off_mm, all[0][0].off_mm, 1e-6);
    EXPECT_NEAR(planes[1].angle_deg, all[0][1].angle_deg, 1e-6);
  }
}

TEST(PlannedSawing, WhatWasNotSawnIsNotMade) {
  const auto none = planned_cut_values(bar(), bar(), two());
  ASSERT_EQ(none.size(), 6U);
  for (const Measured& m : none) {
    EXPECT_FALSE(m.value) << m.name();
    EXPECT_EQ(m.word.find("not made"), 0U) << m.word;
  }
  // One cut alone belongs to the plane that it is nearest to, though another is within reach.
  const std::vector<PlannedCut> beside{planned("below", {0, 0, -4}, {0, 0, 1}), planned("above", {0, 0, 0}, {0, 0, 1})};
  World left = bar();
  left.act(SceneAction::saw(sawn_off(beside[1], -1, 1)));
  const auto one = sawn_planes(bar(), left, beside);
  EXPECT_EQ(one[0].why.find("not made"), 0U);
  EXPECT_EQ(one[1].why, "");
  EXPECT_NEAR(one[1].off_mm, -1, 0.05);
  // Taken back, it was not made.
  left.act(SceneAction::plain(ActionKind::undo));
  EXPECT_NE(sawn_planes(bar(), left, beside)[1].why, "");
}

// Within 5 mm and 20 degrees it is the planned cut, told however far off; beyond it is another.
TEST(PlannedSawing, FiveMillimetresAndTwentyDegreesAreTheEnd) {
  for (const auto& [mm, deg, made] :
       {std::tuple(4.7, 0.0, true), {-4.7, 0.0, true}, {5.4, 0.0, false}, {0.0, 19.0, true}, {0.0, 21.5, false}}) {
    const std::vector<PlannedCut> plan{planned("cut", {0, 0, 0}, {0, 0, 1})};
    World left = bar(0.8);
    left.act(SceneAction::saw(sawn_off(plan[0], mm, deg)));
    const auto planes = sawn_planes(bar(0.8), left, plan);
    EXPECT_EQ(planes[0].why.empty(), made) << mm << ' ' << deg << ' ' << planes[0].why;
    if (!made) {
      EXPECT_EQ(planes[0].why, "not made: nothing is sawn within 5 mm and 20 degrees of it");
      continue;
    }
    EXPECT_NEAR(planes[0].off_mm, mm, 0.15) << deg;
    EXPECT_NEAR(planes[0].angle_deg, deg, 0.5) << mm;
    EXPECT_NEAR(length(planes[0].at_mm - Vec3{0, 0, mm}), 0, 0.3);
    EXPECT_NEAR(length(planes[0].normal), 1, 1e-9);
    EXPECT_NEAR(planes[0].normal.z, std::cos(deg * kDeg), 0.01);
  }
}

// So deep from one side: less than 5 mm2 is a scratch and no cut; a shallow groove has no plane; a deep one has.
TEST(PlannedSawing, ASlotHasToBeDeepEnoughForAPlane) {
  const std::string shallow = "too little is sawn: no plane can be measured";
  for (const auto& [kerf, deep, why] : {std::tuple<double, double, std::string>{1, 0.25, "not made"},
                                        {2, 0.25, "not made"},
                                        {1, 2, shallow},
                                        {2, 1, shallow},
                                        {1, 4.5, ""}}) {
    const std::vector<PlannedCut> plan{planned("cut", {0, 0, 0}, {0, 0, 1}, kerf)};
    const World left = test::solid_world(
        [kerf = kerf, deep = deep](Vec3 p) {
          return std::min(std::min({7 - std::abs(p.x), 5 - std::abs(p.y), 26 - std::abs(p.z)}),
                          std::max({std::abs(p.z - 0.4) - kerf / 2, 5 - deep - p.y, p.x - 5}));
        },
        0.5, 64, {}, 0.2);
    const auto planes = sawn_planes(bar(), left, plan);
    if (why.empty()) {
      ASSERT_EQ(planes[0].why, "");
      EXPECT_NEAR(planes[0].off_mm, 0.4, 0.1);
      EXPECT_LT(planes[0].angle_deg, 1.5);
      EXPECT_NEAR(planes[0].at_mm.x, -1, 0.4);  // of -7 to 5 mm
      EXPECT_NEAR(planes[0].at_mm.y, 5 - deep / 2, 0.4);
    } else {
      EXPECT_EQ(planes[0].why.find(why), 0U) << kerf << ' ' << deep << ": " << planes[0].why;
    }
  }
}

TEST(PlannedSawing, AHoleIsNoPlane) {
  World left = test::solid_world(
      [](Vec3 p) {
        return std::min({7 - std::abs(p.x), 5 - std::abs(p.y), 26 - std::abs(p.z), length(p - Vec3{0, 0, -12}) - 4});
      },
      0.5, 64, {}, 0.2);
  EXPECT_NE(sawn_planes(bar(), left, two())[0].why.find("more is gone there"), std::string::npos);
  // A far cut of the same plane does not hide it, nor a hole beside it.
  left.act(SceneAction::saw(sawn_off(two()[1], 0.3, 1)));
  const auto planes = sawn_planes(bar(), left, two());
  EXPECT_NE(planes[0].why, "");
  EXPECT_NEAR(planes[1].off_mm, 0.3, 0.05);
  EXPECT_NEAR(planes[1].angle_deg, 1, 0.2);
}

TEST(PlannedSawing, AsMetricsOfAScore) {
  World left = bar(0.8);
  left.act(SceneAction::saw(sawn_off(two()[1], -0.5, 2)));
  const auto values = planned_cut_values(bar(0.8), left, two());
  ASSERT_EQ(values.size(), 6U);
  EXPECT_EQ(values[0].name(), "plan_off_mm[low]");
  EXPECT_FALSE(values[0].value);
  EXPECT_EQ(values[3].name(), "plan_off_mm[high]");
  EXPECT_NEAR(values[3].value.value_or(-1), 0.5, 0.05);
  EXPECT_EQ(values[4].name(), "plan_angle_deg[high]");
  EXPECT_NEAR(values[4].value.value_or(-1), 2, 0.3);
  EXPECT_EQ(values[5].name(), "plan_voxels[high]");
  EXPECT_GT(values[5].value.value_or(-1), 100);
}

}  // namespace
}  // namespace osteo
