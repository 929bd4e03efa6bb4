#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "osteo/simulation/bone/dust.h"
#include "osteo/simulation/bone/posture.h"
#include "slab.h"
#include "solid.h"

namespace osteo {
namespace {

constexpr double kCell = 0.5, kRadius = 8;
const Vec3 kMiddle{0, -3, 0};  // of the bowl's inner ball

BrickGrid bowl() {
  return test::solid(kCell, 12, [](Vec3 p) { return length(p) < 11.5 && !(length(p - kMiddle) < kRadius); });
}

// A whole ball of air inside bone: what is in it stays there however it is turned.
BrickGrid cave() {
  return test::solid(kCell, 12, [](Vec3 p) { return length(p) < 11.5 && !(length(p) < kRadius); });
}

void settle(Dust& dust, int most = 3000) {
  for (int s = 0; s < most && (s < 20 || dust.awake_bricks() > 0); ++s) dust.step();
}

double sum_of_water(const Dust::Totals& t) {
  return t.water_mm3 + t.water_sucked_mm3 + t.dried_mm3 + t.run_off_mm3;
}

TEST(Water, StandsAsHighAsTheVolumeOfACapSays) {
  const auto bone = bowl();
  Dust dust(bone);
  for (int s = 0; s < 100; ++s) {
    dust.irrigate({1.5, -2, 0.7}, {0, 1, 0}, 10, 1.5);
    dust.step();
  }
  settle(dust);
  EXPECT_EQ(dust.awake_bricks(), 0u) << "it never comes to rest";
  // By layers: what they hold of what they have room for.
  std::map<int, std::pair<double, double>> least_most;
  double in_pool = 0, depth = 0;
  dust.visit_liquid([&](Ijk c, double full, double) {
    if (full < 3 * Dust::kFilm) return;
    const double room = 1 - static_cast<double>(bone.at(c.i, c.j, c.k));
    auto& [least, most] = least_most.try_emplace(c.j, 2.0, 0.0).first->second;
    least = std::min(least, full / room);
    most = std::max(most, full / room);
    in_pool += full * kCell * kCell * kCell;
    const Vec3 p = bone.frame().world_from_index({double(c.i), double(c.j), double(c.k)});
    if (std::abs(p.x - 0.25) < 0.3 && std::abs(p.z - 0.25) < 0.3) depth += full * kCell;
  });
  ASSERT_GT(least_most.size(), 3u);
  for (const auto& [layer, share] : least_most)
    EXPECT_LT(share.second - share.first, 0.01) << "not level in layer " << layer;
  EXPECT_GT(in_pool, 140);
  EXPECT_NEAR(depth, cap_depth_mm(in_pool, kRadius), 0.15);
}

// However the head is turned: the surface lies across gravity.
TEST(Water, IsLevelWhateverTheHeadIsTurnedBy) {
  const auto bone = cave();
  Dust dust(bone);
  for (int s = 0; s < 60; ++s) {
    dust.irrigate({0, 0, 0}, {}, 10, 4);
    dust.step();
  }
  for (const double turned : {-30.0, 20.0, 55.0}) {
    const Vec3 down = down_of(Posture::supine, turned);
    dust.set_gravity(down);
    settle(dust);
    EXPECT_EQ(dust.awake_bricks(), 0u) << turned;
    const double half = 0.5 * (std::abs(down.x) + std::abs(down.y) + std::abs(down.z));
    double least = 1e9, most = -1e9, deepest = -1e9, held = 0;
    dust.visit_liquid([&](Ijk c, double full, double) {
      const double room = 1 - static_cast<double>(bone.at(c.i, c.j, c.k)), share = full / room;
      const Vec3 p = bone.frame().world_from_index({double(c.i), double(c.j), double(c.k)});
      if (full > 3 * Dust::kFilm) held += full * kCell * kCell * kCell;
      if (full > 3 * Dust::kFilm) deepest = std::max(deepest, dot(p, down));
      if (full < 3 * Dust::kFilm || share > 0.97) return;
      const double height = -dot(p, down) / kCell - half + 2 * half * share;
      least = std::min(least, height);
      most = std::max(most, height);
    });
    EXPECT_LT(most - least, 0.35) << turned << " degrees: in cells, at the rim over wet bone too";
    EXPECT_GT(deepest, kRadius - 1) << "at the lowest place of the ball";
    EXPECT_NEAR(-least * kCell, kRadius - cap_depth_mm(held, kRadius), 0.2) << turned;
  }
}

TEST(Water, TakesDustAlongAndIsSuckedOffWithIt) {
  const auto bone = bowl();
  Dust dust(bone);
  for (int s = 0; s < 200; ++s) {
    dust.add(bone.find(24, 10, 24), 0.05);
    dust.step();
  }
  settle(dust);
  EXPECT_EQ(dust.totals().slurry_mm3, 0);
  for (int s = 0; s < 60; ++s) {
    dust.irrigate({0, 0, 0}, {0, 1, 0}, 10, 2);
    dust.step();
  }
  settle(dust);
  const auto stirred = dust.totals();
  EXPECT_GT(stirred.slurry_mm3, 8) << "of 10 mm3 of dust under 120 of water";
  dust.visit_liquid([](Ijk, double full, double solid) {
    if (full > 3 * Dust::kFilm) {
      EXPECT_LE(solid, Dust::kMaxSolid + 1e-3);
    }
  });
  // By a nozzle at the floor; half a litre a minute.
  for (int s = 0; s < 200; ++s) {
    dust.suck({0, 4.5, 0}, 4, 0.3);
    dust.step();
  }
  const auto after = dust.totals();
  EXPECT_GT(after.sucked_mm3, 0.8 * stirred.slurry_mm3);
  EXPECT_LT(after.water_mm3, 0.35 * stirred.water_mm3) << "but for the film";
  EXPECT_DOUBLE_EQ(after.added_mm3, after.present_mm3 + after.slurry_mm3 + after.sucked_mm3 + after.fallen_mm3);
  EXPECT_DOUBLE_EQ(after.poured_mm3, sum_of_water(after));
}

TEST(Water, ASuckerTakesNothingBeyondItsReach) {
  const auto bone = bowl();
  Dust dust(bone);
  for (int s = 0; s < 60; ++s) dust.irrigate({0, 0, 0}, {0, 1, 0}, 10, 2), dust.step();
  settle(dust);
  EXPECT_EQ(dust.suck({0, -4, 0}, 4, 100), 0);
  EXPECT_EQ(dust.totals().water_sucked_mm3, 0);
}

TEST(Water, AFilmStaysDriesAndLeavesItsDust) {
  const auto bone = test::slab(0.5);
  Dust dust(bone, {.gravity = {0, 0, -1}});
  const Vec3 above = bone.frame().world_from_index({40, 40, 36});
  for (int s = 0; s < 20; ++s) dust.add_at(above, 0.02);
  dust.irrigate(above, {}, 15, 3);
  settle(dust);
  double wettest = 0;
  dust.visit_liquid([&](Ijk, double full, double) { wettest = std::max(wettest, full); });
  EXPECT_GT(wettest, Dust::kFilm / 2);
  for (int s = 0; s < static_cast<int>(100 * Dust::kDrySeconds) + 6000; ++s) dust.step();
  const auto t = dust.totals();
  EXPECT_EQ(t.water_mm3, 0);
  EXPECT_NEAR(t.dried_mm3 + t.run_off_mm3, 3, 1e-4);
  EXPECT_EQ(t.slurry_mm3, 0);
  EXPECT_DOUBLE_EQ(t.added_mm3, t.present_mm3 + t.sucked_mm3 + t.fallen_mm3);
}

TEST(Water, FallsAndDustToWhereGravityPoints) {
  const auto bone = test::slab(0.5);
  for (const Vec3 down : {down_of(Posture::supine, 25), down_of(Posture::sitting, 0),
                          down_of(Posture::right_side, -10), normalized({0.3, -0.5, 0.8})}) {
    // Away from the bone.
    const Vec3 far = bone.frame().world_from_index({40, 40, 60}) + Vec3{0, 0, 8};
    Dust dust(bone, {.gravity = down});
    dust.add_at(far, 0.05);
    dust.irrigate(far, down, 0.1, 0.1);
    Vec3 from{}, wet_from{};
    const auto middle = [&](Vec3& dry, Vec3& wet) {
      double all = 0, all_wet = 0;
      dry = wet = {};
      dust.visit([&](Vec3 p, double f) { dry += p * f, all += f; });
      dust.visit_liquid([&](Ijk c, double f, double) {
        wet += bone.frame().world_from_index({double(c.i), double(c.j), double(c.k)}) * f, all_wet += f;
      });
      dry = all > 0 ? dry / all : Vec3{};
      wet = all_wet > 0 ? wet / all_wet : Vec3{};
    };
    dust.step();
    middle(from, wet_from);
    for (int s = 0; s < 20; ++s) dust.step();
    Vec3 to, wet_to;
    middle(to, wet_to);
    ASSERT_GT(length(wet_to - wet_from), 5);
    EXPECT_GT(dot(normalized(wet_to - wet_from), down), std::cos(0.12)) << down.x << " " << down.y << " " << down.z;
  }
  Dust dust(bone, {.gravity = {0, 0, 0}});
  EXPECT_EQ(dust.gravity(), (Vec3{0, 1, 0})) << "no direction: as it was";
  dust.set_gravity({std::nan(""), 0, 1});
  EXPECT_EQ(dust.gravity(), (Vec3{0, 1, 0}));
}

TEST(Water, OfAPatientThatLiesSo) {
  EXPECT_EQ(down_of(Posture::supine, 0), (Vec3{0, 1, 0}));
  EXPECT_EQ(down_of(Posture::prone, 0), (Vec3{0, -1, 0}));
  EXPECT_EQ(down_of(Posture::sitting, 70), (Vec3{0, 0, -1}));
  // The face to the left: the left ear (+x in LPS) is below.
  EXPECT_GT(down_of(Posture::supine, 60).x, 0.86);
  for (const Posture p :
       {Posture::supine, Posture::prone, Posture::sitting, Posture::left_side, Posture::right_side}) {
    for (const double turned : {-80.0, -20.0, 0.0, 35.0}) {
      const Vec3 down = down_of(p, turned);
      const PostureNow now = posture_of(down);
      EXPECT_LE(std::abs(now.head_turned_deg), 90.01);
      EXPECT_NEAR(length(down_of(now.posture, now.head_turned_deg) - down), 0, 1e-9)
          << static_cast<int>(p) << " " << turned;
    }
  }
  EXPECT_NEAR(length(down_of(Posture::supine, 90) - down_of(Posture::left_side, 0)), 0, 1e-12);
}

TEST(Water, IntoBoneItRunsOffAndIsCounted) {
  const auto bone = bowl();
  Dust dust(bone);
  dust.irrigate({0, 8.5, 0}, {}, 5, 2);  // in the floor, two millimetres deep
  for (int s = 0; s < 200; ++s) dust.step();
  const auto t = dust.totals();
  EXPECT_NEAR(t.poured_mm3, 2, 1e-4);
  EXPECT_DOUBLE_EQ(t.poured_mm3, sum_of_water(t));
  for (const double bad : {0.0, -1.0, std::nan("")}) dust.irrigate({0, 0, 0}, {}, 5, bad);
  dust.irrigate({std::nan(""), 0, 0}, {}, 5, 1);
  EXPECT_EQ(dust.totals().poured_mm3, t.poured_mm3);
}

}  // namespace
}  // namespace osteo
