#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include "osteo/simulation/bone/dust.h"
#include "slab.h"
#include "solid.h"

namespace osteo {
namespace {

double sum(const Dust::Totals& t) {
  return t.present_mm3 + t.slurry_mm3 + t.sucked_mm3 + t.fallen_mm3;
}

double water(const Dust::Totals& t) {
  return t.water_mm3 + t.water_sucked_mm3 + t.dried_mm3 + t.run_off_mm3;
}

// A bowl open towards -y (gravity is +y), so that dust stays in it.
BrickGrid bowl() {
  return test::solid(0.5, 12, [](Vec3 p) { return length(p) < 11 && !(length(p - Vec3{0, -3, 0}) < 8); });
}

TEST(Dust, FallsPilesAndComesToRestWithNothingLost) {
  const auto bone = bowl();
  Dust dust(bone);
  const VoxelKey source = bone.find(24, 10, 24);
  ASSERT_LT(bone.value(source), 0.5F);
  for (int s = 0; s < 400; ++s) {
    dust.add(source, 0.0371);
    dust.step();
  }
  for (int s = 0; s < 2000 && dust.awake_bricks() > 0; ++s) dust.step();
  EXPECT_EQ(dust.awake_bricks(), 0u) << "it never comes to rest";
  const auto t = dust.totals();
  EXPECT_NEAR(t.added_mm3, 400 * 0.0371, 2e-6);
  EXPECT_DOUBLE_EQ(t.added_mm3, sum(t));
  EXPECT_EQ(t.fallen_mm3, 0);
  // It lies on the floor of the bowl, no cell fuller than packed, in no bone, nothing hanging in the air.
  double lowest = -1e9, highest = 1e9;
  dust.visit([&](Vec3 p, double full) {
    EXPECT_LE(full, 1.0 + 1e-9);
    EXPECT_LT(bone.nearest(p), 0.5F);
    lowest = std::max(lowest, p.y);
    highest = std::min(highest, p.y);
  });
  EXPECT_GT(lowest, 4);
  EXPECT_GT(highest, 0);
}

TEST(Dust, FallsWhereNothingIsBelowUntilItLies) {
  // A shelf over half of the width, a floor 6 mm below it.
  const auto bone =
      test::solid(0.5, 12, [](Vec3 p) { return (p.x < 0 && p.y > -2 && p.y < 0) || (p.y > 6 && p.y < 8 && p.x < 6); });
  Dust dust(bone, {.gravity = {0, 1, 0}});
  const auto cell = [&](Vec3 p) {
    const Vec3 x = bone.frame().index_from_world(p);
    return Ijk{static_cast<int>(std::lround(x.x)), static_cast<int>(std::lround(x.y)),
               static_cast<int>(std::lround(x.z))};
  };
  EXPECT_FALSE(dust.falls(cell({3, 0, 0}), 8)) << "there is none";
  for (const double x : {-3.0, 3.0, 9.0}) dust.add_at({x, -6, 0}, 0.02);
  EXPECT_TRUE(dust.falls(cell({-3, -6, 0}), 6));
  EXPECT_FALSE(dust.falls(cell({-3, -6, 0}), 8)) << "the shelf is 4 mm below";
  EXPECT_TRUE(dust.falls(cell({3, -6, 0}), 8));
  EXPECT_FALSE(dust.falls(cell({3, -6, 0}), 26)) << "the floor is 12 mm below";
  EXPECT_TRUE(dust.falls(cell({9, -6, 0}), 200)) << "beside both";
  dust.step();
  for (int s = 0; s < 500 && dust.awake_bricks() > 0; ++s) dust.step();
  EXPECT_EQ(dust.awake_bricks(), 0U);
  std::size_t cells = 0;
  dust.visit([&](Vec3 p, double) {
    ++cells;
    EXPECT_FALSE(dust.falls(cell(p), 8)) << "it lies";
  });
  EXPECT_GT(cells, 0U);
  // A heap of packed dust carries what comes upon it, though bone is farther below.
  for (int n = 0; n < 8; ++n) dust.add_at({3, 5.9 - 0.5 * n, 0}, 0.044);
  dust.add_at({3, -0.5, 0}, 0.001);
  EXPECT_FALSE(dust.falls(cell({3, 1.5, 0}), 8));
}

TEST(Dust, MassIsConservedThroughEverything) {
  const auto bone = bowl();
  Dust dust(bone);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> u(-7, 7);
  double added = 0;
  for (int s = 0; s < 1500; ++s) {
    const double mm3 = 0.001 * static_cast<double>(random() % 100);
    dust.add(static_cast<VoxelKey>(random() % (bone.brick_count() * 512)), mm3);
    added += mm3;
    if (s % 7 == 0) dust.push({0, 0, 2, 2}, {u(random), u(random), u(random)}, {0, 0, 1});
    if (s % 11 == 0) dust.suck({u(random), u(random), u(random)}, 3, 0.4);
    if (s % 13 == 0) dust.irrigate({u(random), u(random), u(random)}, {u(random), u(random), u(random)}, 5, 3.3);
    if (s % 301 == 300) dust.set_gravity({u(random), u(random), u(random)});
    dust.step();
    const auto t = dust.totals();
    ASSERT_DOUBLE_EQ(t.added_mm3, sum(t)) << s;
    ASSERT_NEAR(t.added_mm3, added, 1e-5);
    ASSERT_DOUBLE_EQ(t.poured_mm3, water(t)) << s;
  }
  EXPECT_GT(dust.totals().sucked_mm3, 0.5);
  EXPECT_GT(dust.totals().slurry_mm3, 0.1);
  EXPECT_GT(dust.totals().water_sucked_mm3, 0.1);
  EXPECT_GT(dust.totals().poured_mm3, 300);
}

TEST(Dust, ThePushedAsideComesBackAndTheSuckedOffDoesNot) {
  const auto bone = bowl();
  Dust dust(bone);
  for (int s = 0; s < 300; ++s) {
    dust.add(bone.find(24, 10, 24), 0.05);
    dust.step();
  }
  const auto near = [&](Vec3 c, double r) {
    double full = 0;
    dust.visit([&](Vec3 p, double f) { full += length(p - c) < r ? f : 0; });
    return full;
  };
  const Vec3 floor{0, 4.2, 0};
  EXPECT_GT(near(floor, 1.2), 1);
  dust.push({0, 0, 1.5, 1.5}, floor, {0, 0, 1});
  EXPECT_LT(near(floor, 1.0), 0.2);  // out of the tool's way
  const double before = dust.totals().present_mm3;
  EXPECT_GT(dust.suck(floor, 5, 1e9), 1);
  EXPECT_LT(dust.totals().present_mm3, before);
  EXPECT_EQ(near(floor, 4), 0);
}

TEST(Dust, SameCallsSameDust) {
  const auto bone = bowl();
  std::vector<double> first;
  for (int round = 0; round < 2; ++round) {
    Dust dust(bone);
    std::mt19937 random(9);
    for (int s = 0; s < 200; ++s) {
      dust.add(static_cast<VoxelKey>(random() % (bone.brick_count() * 512)), 0.02);
      dust.step();
    }
    std::size_t n = 0;
    dust.visit([&](Vec3 p, double f) {
      const double value = p.x + 100 * p.y + 10000 * p.z + 0.1 * f;
      if (round == 0) {
        first.push_back(value);
      } else {
        ASSERT_EQ(first[n], value);
      }
      ++n;
    });
    EXPECT_EQ(n, first.size());
  }
}

TEST(Dust, OutOfReachItIsCounted) {
  const auto bone = test::slab(0.5);
  Dust dust(bone, {.gravity = {0, 0, 1}});  // away from the slab
  dust.add(bone.find(40, 40, 36), 0.1);
  for (int s = 0; s < 400; ++s) dust.step();
  EXPECT_DOUBLE_EQ(dust.totals().fallen_mm3, dust.totals().added_mm3);
  EXPECT_EQ(dust.awake_bricks(), 0u);
}

// A radius is no reason to walk cells that hold nothing: what is reached is the same as far as dust lies, whatever the
// radius.
TEST(Dust, ARadiusBeyondAllBoundsCostsNoMoreThanTheDustThatLies) {
  const auto bone = bowl();
  const auto heap = [&] {
    auto dust = std::make_unique<Dust>(bone);
    for (int s = 0; s < 200; ++s) {
      dust->add(bone.find(24, 10, 24), 0.05);
      dust->step();
    }
    return dust;
  };
  // Nearest first, from a place in the middle of it, as if every cell of the ball were asked.
  const auto by_hand = heap(), sucked = heap();
  struct Cell {
    double d2;
    Vec3 at;
    double mm3;
  };
  std::vector<Cell> cells;
  const Vec3 nozzle{0.3, 3.1, -0.2};
  const double voxel = bone.frame().voxel_volume_mm3();
  by_hand->visit([&](Vec3 p, double full) { cells.push_back({dot(p - nozzle, p - nozzle), p, full * 0.35 * voxel}); });
  std::stable_sort(cells.begin(), cells.end(), [](const Cell& a, const Cell& b) { return a.d2 < b.d2; });
  ASSERT_GT(cells.size(), 100u);
  double wanted = 0.5 * by_hand->totals().present_mm3, first = 0;
  std::size_t emptied = 0;
  for (const Cell& c : cells) {
    if (first + c.mm3 > wanted) break;
    first += c.mm3;
    ++emptied;
  }
  EXPECT_NEAR(sucked->suck(nozzle, 1e7, wanted), wanted, 1e-4);
  std::size_t left = 0;
  sucked->visit([&](Vec3, double) { ++left; });
  EXPECT_NEAR(static_cast<double>(left), static_cast<double>(cells.size() - emptied), 1);
  for (const double odd : {0.0, -3.0, std::nan("")}) EXPECT_EQ(by_hand->suck(nozzle, odd, 1), 0);
  EXPECT_EQ(by_hand->suck({std::nan(""), 0, 0}, 5, 1), 0);
  EXPECT_EQ(by_hand->suck({1e300, 0, 0}, 5, 1), 0);
  EXPECT_EQ(by_hand->totals().sucked_mm3, 0);
}

}  // namespace
}  // namespace osteo
