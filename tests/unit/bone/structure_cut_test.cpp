// What a saw by its plane takes of structures, against shapes of known volume.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "osteo/core/base/error.h"
#include "osteo/simulation/bone/structure_map.h"
#include "soft_solid.h"

namespace osteo {
namespace {

// A nerve of 1 mm along z at x 0, and a sinus of 6 mm along y at x 8, both from -9 to 9; labels of 0.25 mm.
const StructureMap& nerve_and_sinus() {
  static const StructureMap map = [] {
    Labels l;
    constexpr double h = 0.25;
    l.frame.dims = {96, 80, 80};
    l.frame.spacing_mm = {h, h, h};
    l.frame.origin_mm = {-8 + h / 2, -10 + h / 2, -10 + h / 2};
    const auto v = make_voxels<std::uint8_t>(l.frame.voxel_count());
    std::size_t at = 0;
    for (int k = 0; k < l.frame.dims[2]; ++k)
      for (int j = 0; j < l.frame.dims[1]; ++j)
        for (int i = 0; i < l.frame.dims[0]; ++i) {
          const Vec3 p = l.frame.world_from_index({double(i), double(j), double(k)});
          v[at++] = std::hypot(p.x, p.y) < 0.5 && std::abs(p.z) < 9     ? 2
                    : std::hypot(p.x - 8, p.z) < 3 && std::abs(p.y) < 9 ? 7
                                                                        : 0;
        }
    l.voxels = v;
    l.structures = {{2, "facial nerve", {}}, {7, "sigmoid sinus", {}}};
    return StructureMap(l);
  }();
  return map;
}
double volume_mm3(const TriMesh& face) {
  double six = 0;
  const auto at = [&](std::uint32_t n) { return from_floats(face.points_mm[n]); };
  for (const auto& t : face.triangles) six += dot(at(t[0]), cross(at(t[1]), at(t[2])));
  return std::abs(six) / 6;
}
SawCut blade(Vec3 at, Vec3 normal, double kerf, double size = 30) {
  return {at, normal, {0.3, 0.8, 0.5}, kerf, size, size};
}

TEST(StructureCut, AcrossANerveItTakesADisc) {
  const StructureMap& map = nerve_and_sinus();
  // Of the map's own face, whose section is the same all along: the figure that there is to be met.
  const double section = volume_mm3(map.face(0)) / 18;
  for (const double kerf : {0.3, 0.6, 1.5}) {
    const auto cuts = structures_cut(map, blade({0, 0, 5}, {0, 0, 1}, kerf, 9));
    ASSERT_EQ(cuts.size(), 2U);
    EXPECT_EQ(cuts[0].structure, 2);
    EXPECT_EQ(cuts[1].mm3, 0) << "the sinus lies beyond the blade's end";
    EXPECT_GT(cuts[1].distance_mm, 0);
    EXPECT_NEAR(cuts[0].mm3 / (section * kerf), 1, 0.05) << kerf;
    EXPECT_EQ(cuts[0].distance_mm, 0);
    EXPECT_LT(length(cuts[0].at_mm - Vec3{0, 0, 5}), 0.15);
  }
  const auto both = structures_cut(map, blade({0, 0, 0}, {0, 0, 1}, 1));
  ASSERT_EQ(both.size(), 2U);
  EXPECT_NEAR(both[1].mm3, 6 * 18, 4) << "along the sinus' middle";
  EXPECT_EQ(reported_structures_cut(map, both).find("the facial nerve (0."), 0U) << reported_structures_cut(map, both);
  EXPECT_NE(reported_structures_cut(map, both).find(") and the sigmoid sinus (1"), std::string::npos)
      << reported_structures_cut(map, both);
}

// Halves of a blade take what the whole takes, wherever it is parted.
TEST(StructureCut, VolumesAddUp) {
  const StructureMap& map = nerve_and_sinus();
  const Vec3 normal = normalized({0.2, -0.3, 0.9});
  const auto whole = structures_cut(map, blade({3, 0.3, 0.2}, normal, 1.2));
  const auto lower = structures_cut(map, blade(Vec3{3, 0.3, 0.2} - normal * 0.4, normal, 0.4));
  const auto upper = structures_cut(map, blade(Vec3{3, 0.3, 0.2} + normal * 0.2, normal, 0.8));
  ASSERT_EQ(whole.size(), 2U);
  for (std::size_t n = 0; n < 2; ++n) EXPECT_NEAR((lower[n].mm3 + upper[n].mm3) / whole[n].mm3, 1, 0.02) << n;
}

TEST(StructureCut, MissedByHalfAMillimetreAndGrazed) {
  const StructureMap& map = nerve_and_sinus();
  // Beside the nerve, its blade parallel to it: 0.5 mm of it, and the blade's half of 0.3.
  const auto missed = structures_cut(map, blade({-1.3, 0, 0}, {1, 0, 0}, 0.6));
  ASSERT_FALSE(missed.empty());
  EXPECT_EQ(missed[0].structure, 2);
  EXPECT_EQ(missed[0].mm3, 0);
  EXPECT_NEAR(missed[0].distance_mm, 0.5, 0.12);
  EXPECT_EQ(reported_structures_cut(map, missed), "");
  const auto grazed = structures_cut(map, blade({-0.6, 0, 0}, {1, 0, 0}, 0.6));
  ASSERT_FALSE(grazed.empty());
  EXPECT_EQ(grazed[0].distance_mm, 0);
  // The segment of the circle beyond x = -0.3, 18 mm long: of the map's face, by points a twentieth of a millimetre
  // apart.
  double points = 0;
  for (double x = -0.875; x < -0.3; x += 0.05)
    for (double y = -0.975; y < 1; y += 0.05)
      for (double z = -9.475; z < 9.5; z += 0.05) points += map.distance_mm(0, {x, y, z}) < 0 ? 1 : 0;
  EXPECT_NEAR(grazed[0].mm3 / (points * 0.05 * 0.05 * 0.05), 1, 0.12);
  EXPECT_GT(grazed[0].mm3, 1);
  // Beyond what is asked for, and beyond the map's reach: nothing, and no wait.
  EXPECT_TRUE(structures_cut(map, blade({-7, 0, 0}, {1, 0, 0}, 0.6, 400)).empty());
  EXPECT_TRUE(structures_cut(map, blade({-90, 0, 0}, {1, 0, 0}, 0.6, 400)).empty());
  EXPECT_THROW(static_cast<void>(structures_cut(map, {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}, 0.6, 0, 0})), Error);
}

// Distances are those that points of the blade have, asked one by one.
TEST(StructureCut, TheNearestPlaceIsFound) {
  const StructureMap& map = nerve_and_sinus();
  for (const Vec3 normal : {Vec3{1, 0.4, 0.1}, Vec3{0.2, 1, -0.6}, Vec3{-0.5, 0.3, 1}}) {
    const SawCut b = blade({-3, 2.5, 1}, normal, 0.8, 7);
    double least = 1e9;
    const Vec3 n = normalized(b.normal), along = normalized(b.along - n * dot(b.along, n)), across = cross(n, along);
    for (double u = -3.5; u <= 3.5; u += 0.1)
      for (double v = -3.5; v <= 3.5; v += 0.1)
        for (const double w : {-0.4, 0.4})
          least = std::min(least, map.distance_mm(0, b.at_mm + along * u + across * v + n * w));
    const auto cuts = structures_cut(map, b);
    ASSERT_FALSE(cuts.empty());
    EXPECT_NEAR(cuts[0].distance_mm, std::max(0.0, least), 0.12);
    EXPECT_EQ(cuts[0].mm3 > 0, least <= 0);
  }
}

BrickGrid block() {
  Frame f;
  f.dims = {64, 64, 64};
  f.spacing_mm = {0.5, 0.5, 0.5};
  f.origin_mm = {-15.75, -15.75, -15.75};
  return test::soft_solid(f, [](Vec3 p) {
    return std::min({4 - std::abs(p.x + 4), 6 - std::abs(p.y), 6 - std::abs(p.z)});
  });
}

// An endless plane through a piece of bone on this side of the sinus does not cut the sinus.
TEST(StructureCut, ABladeIsAtWorkWhereThereIsBone) {
  World world(block());
  const SawCut plane{{0, 0, 1}, {0, 0, 1}, {1, 0, 0}, 1};
  const std::vector<VoxelKey> would = voxels_sawn(world, plane);
  const auto planned = blade_at_work(world, plane, would);
  const auto effect = world.act(SceneAction::saw(plane));
  ASSERT_TRUE(effect.done);
  std::vector<VoxelKey> taken;
  for (const auto& [name, density] : effect.dust) taken.push_back(name);
  EXPECT_EQ(taken, would) << "what would be cut is what is cut";
  const auto done = blade_at_work(world, plane, taken);
  ASSERT_TRUE(planned && done);
  EXPECT_EQ(planned->length_mm, done->length_mm);
  EXPECT_NEAR(done->length_mm, 8, 1);  // x from -8 to 0
  EXPECT_NEAR(done->depth_mm, 12, 1);
  EXPECT_NEAR(done->at_mm.x, -4, 0.6);
  const auto cuts = structures_cut(nerve_and_sinus(), *done, 6);
  ASSERT_EQ(cuts.size(), 2U);
  EXPECT_GT(cuts[0].mm3, 0) << "the nerve runs along the bone's edge";
  EXPECT_EQ(cuts[1].mm3, 0);
  EXPECT_NEAR(cuts[1].distance_mm, 4.9, 0.5);
  // A short blade stays short; where there is no bone there is no blade.
  SawCut small = plane;
  small.length_mm = 3;
  small.at_mm.x = -6;
  EXPECT_LE(blade_at_work(world, small, taken)->length_mm, 3);
  EXPECT_FALSE(blade_at_work(world, plane, {}));
  EXPECT_TRUE(voxels_sawn(world, {{20, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1}).empty());
  EXPECT_TRUE(voxels_sawn(world, plane, 99).empty()) << "a piece that is not there";
}

// Structures go with the first body, wherever that was moved to.
TEST(StructureCut, IsInTheFrameOfTheFirstBody) {
  World world(block());
  const RigidTransform by = rotation_about({}, normalized({1, 2, 3}), 0.7);
  ASSERT_TRUE(world.act(SceneAction::move(0, by)).done);
  const SawCut plane{by({0, 0, 1}), by.rotation * Vec3{0, 0, 1}, by.rotation * Vec3{1, 0, 0}, 1};
  const auto there = blade_at_work(world, plane, voxels_sawn(world, plane));
  ASSERT_TRUE(there);
  EXPECT_LT(length(there->at_mm - Vec3{-4, 0, 1}), 0.6);
  EXPECT_GT(structures_cut(nerve_and_sinus(), *there)[0].mm3, 0);
}

}  // namespace
}  // namespace osteo
