// What the final product makes only in part, against the same made of all of the lattice.
#include "product_lattice.h"

#include <gtest/gtest.h>

#include <random>

#include "cavity.h"
#include "osteo/geometry/distance/binary_distance.h"
#include "scene.h"

namespace osteo {
namespace {

Frame lattice(std::array<int, 3> dims, double h, double turn) {
  Frame f;
  f.dims = dims;
  f.spacing_mm = {h, h, h};
  f.direction = rotation_about({}, normalized({1, 2, 3}), turn).rotation;
  f.origin_mm = f.direction * Vec3{(1 - dims[0]) * h / 2, (1 - dims[1]) * h / 2, (1 - dims[2]) * h / 2};
  return f;
}

// A large ball (deep inside it blocks are taken whole), another that cuts into it, a thin tube through both, a shell.
std::uint8_t structure_at(Vec3 p) {
  if (std::hypot(p.x, p.y - 1) < 0.7 && std::abs(p.z) < 13) return 3;
  if (length(p - Vec3{9, 0, 0}) < 5) return 2;
  if (length(p) < 9) return 1;
  const double r = length(p);
  return r > 10.5 && r < 11.5 && p.z > 3 ? 4 : 0;
}

TEST(ProductLattice, LabelsAreThoseOfEachCellAskedByItself) {
  const StructureMap map = test::structure_map(
      structure_at, {{1, "ball", {}}, {2, "other", {}}, {3, "tube", {}}, {4, "shell", {}}}, 0.5, 30);
  for (const double turn : {0.0, 0.3}) {
    const Frame f = lattice({59, 63, 57}, 0.45, turn);
    const auto labels = label_cells(f, map, std::vector<CellBlock>(map.values().size(), {{0, 0, 0}, f.dims}), {});
    std::vector<std::uint8_t> each(f.voxel_count());
    std::size_t at = 0;
    std::array<std::size_t, 256> count{};
    for (int k = 0; k < f.dims[2]; ++k)
      for (int j = 0; j < f.dims[1]; ++j)
        for (int i = 0; i < f.dims[0]; ++i, ++at) {
          double deepest = 0;
          for (std::size_t s = 0; s < map.values().size(); ++s) {
            const double d = map.distance_mm(s, f.world_from_index({double(i), double(j), double(k)}));
            if (d >= 0 || d >= deepest) continue;
            deepest = d;
            each[at] = map.values()[s];
          }
          ++count[each[at]];
        }
    EXPECT_EQ(labels, each) << turn;
    for (const std::uint8_t v : map.values()) EXPECT_GT(count[v], 100U);
  }
}

TEST(ProductLattice, BlocksHoldWhatTheyAreMadeOf) {
  const CellBlock a{{1, 2, 3}, {5, 6, 7}}, b{{4, 0, 5}, {9, 4, 6}}, none, far{{7, 7, 7}, {8, 8, 8}};
  const CellBlock around = block_around(a, b), common = common_block(a, b);
  EXPECT_EQ(around.lo, (std::array<int, 3>{1, 0, 3}));
  EXPECT_EQ(around.hi, (std::array<int, 3>{9, 6, 7}));
  EXPECT_EQ(common.lo, (std::array<int, 3>{4, 2, 5}));
  EXPECT_EQ(common.hi, (std::array<int, 3>{5, 4, 6}));
  EXPECT_FALSE(common.empty());
  EXPECT_TRUE(none.empty());
  EXPECT_TRUE(common_block(a, far).empty());
  for (const CellBlock& c : {block_around(a, none), block_around(none, a)}) {
    EXPECT_EQ(c.lo, a.lo);
    EXPECT_EQ(c.hi, a.hi);
  }
  int cells = 0;
  each_cell(common, [&](int i, int j, int k) {
    EXPECT_EQ(i, 4);
    EXPECT_EQ(j, 2 + cells);
    EXPECT_EQ(k, 5);
    ++cells;
  });
  EXPECT_EQ(cells, 2);
  // Of a mask, in whichever words of a row its first and last cells lie.
  EXPECT_TRUE(block_of(BitMask({200, 5, 4})).empty());
  for (const auto& [first, last] : {std::pair(0, 0), {63, 63}, {64, 64}, {3, 130}, {70, 199}}) {
    BitMask mask({200, 5, 4});
    mask.set(2 * 5 + 1, first, first + 1, true);
    mask.set(3 * 5 + 4, last, last + 1, true);
    const CellBlock of = block_of(mask);
    EXPECT_EQ(of.lo, (std::array<int, 3>{first, 1, 2}));
    EXPECT_EQ(of.hi, (std::array<int, 3>{last + 1, 5, 4}));
  }
}

TEST(ProductLattice, DistancesInAPartAreThoseOfAll) {
  std::mt19937 random(4);
  for (const double h : {0.5, 0.4, 0.31}) {
    const Frame f = lattice({60, 44, 38}, h, 0);
    BitMask cavity(f.dims);
    for (int n = 0; n < 40; ++n)
      cavity.set((10 + random() % 9) * 44 + 12 + random() % 7, 20 + static_cast<int>(random() % 5),
                 26 + static_cast<int>(random() % 9), true);
    std::vector<float> all = squared_distance_mm2(cavity.bytes(), f, 1);
    for (float& d : all) d = std::sqrt(d);
    // A part that does not hold the cavity itself, and reaches beyond the lattice.
    const CavityDistance part(cavity, f, {{40, 30, 25}, {70, 36, 60}}, {});
    const CavityDistance whole(cavity, f, {{0, 0, 0}, f.dims}, {});
    std::size_t at = 0, known = 0;
    for (int k = 0; k < f.dims[2]; ++k)
      for (int j = 0; j < f.dims[1]; ++j)
        for (int i = 0; i < f.dims[0]; ++i, ++at) {
          EXPECT_EQ(whole.at(i, j, k), static_cast<double>(all[at]));
          if (i >= 40 && j >= 30 && k >= 25 && j < 36) {
            EXPECT_LT(part.at(i, j, k), CavityDistance::kFarMm);
          }
          if (part.at(i, j, k) >= CavityDistance::kFarMm) continue;
          ++known;
          EXPECT_EQ(part.at(i, j, k), static_cast<double>(all[at]));
        }
    EXPECT_LT(known, f.voxel_count() / 2);
    EXPECT_EQ(part.linear({45.3, 31.2, 27.9}), whole.linear({45.3, 31.2, 27.9}));
    EXPECT_EQ(part.linear({2, 2, 2}), CavityDistance::kFarMm);
  }
  EXPECT_TRUE(CavityDistance(BitMask({8, 8, 8}), lattice({8, 8, 8}, 1, 0), {{0, 0, 0}, {8, 8, 8}}, {}).empty());
}

// Rows made again are all in which anything changed: on the bone's own lattice and on one between its voxels.
TEST(ProductLattice, WhatChangedIsMadeAgain) {
  const World before = test::solid_world([](Vec3 p) { return 8 - length(p); }, 0.5, 24);
  World after = before.copy();
  std::mt19937 random(8);
  BrickGrid& bone = after.bodies().front().body->bone;
  for (int n = 0; n < 30; ++n) {
    const VoxelKey v = random() % (bone.brick_count() * BrickGrid::kVoxels);
    const float density = static_cast<float>(random() % 100) / 100;
    bone.set(v, density);
  }
  const World cut = test::solid_world([](Vec3 p) { return std::min(8 - length(p), 2 - p.x); }, 0.5, 24);
  for (const double h : {0.5, 0.37}) {
    Frame f = before.bodies().front().body->bone.frame();
    f.dims = {48, 48, 48};
    f.spacing_mm = {h, h, h};
    for (const World* const end : std::array<const World*, 2>{&after, &cut}) {
      const BitMask again = solid_cells(*end, f, before, solid_cells(before, f, {}), {});
      EXPECT_TRUE(again == solid_cells(*end, f, {}));
      EXPECT_FALSE(again == solid_cells(before, f, {}));
    }
  }
}

}  // namespace
}  // namespace osteo
