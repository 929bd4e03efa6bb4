// Pixels and outlines of cuts against bodies known in closed form.
#include "osteo/display/view/live_cut.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>

#include "osteo/geometry/grid/brick_grid.h"
#include "osteo/geometry/mesh/bone_surface.h"
#include "osteo/simulation/bone/instrument.h"
#include "solid.h"

namespace osteo {
namespace {

constexpr double kRadius = 8;

std::shared_ptr<Body> ball_of_bone(double h = 0.5) {
  auto body = std::make_shared<Body>();
  body->bone = test::solid(h, 12, [](Vec3 p) { return length(p) < kRadius; });
  return body;
}

// CT values of a ball: 1000 HU in its middle, falling evenly to 200 at 8 mm; as cases keep them, only where there is
// bone.
double hu_of(Vec3 p) {
  return 1000 - 100 * length(p);
}
SparseGrid hu_where_bone_is(const BrickGrid& bone) {
  BrickGrid hu = bone;
  for (VoxelKey v = 0; v < hu.brick_count() * BrickGrid::kVoxels; ++v) {
    const Ijk c = hu.coordinate(v);
    hu.set(v, bone.value(v) > 0
                  ? static_cast<float>(hu_of(hu.frame().world_from_index({double(c.i), double(c.j), double(c.k)})))
                  : 0);
  }
  return to_sparse(hu, "hu");
}

SliceView view_of(int size, double mm_per_pixel, const std::optional<SliceAxes>& oblique = {}, Vec3 through = {}) {
  SliceView v;
  v.width = v.height = size;
  v.mm_per_pixel = mm_per_pixel;
  v.oblique = oblique;
  v.through_mm = v.centre_mm = through;
  return v;
}
int red(std::uint32_t c) {
  return static_cast<int>(c & 255);
}
int blue(std::uint32_t c) {
  return static_cast<int>(c >> 16 & 255);
}
const SliceAxes kTilted{normalized({1, 0.4, -0.2}), normalized(cross(normalized({1, 0.4, -0.2}), Vec3{0.3, -1, 0.5}))};

TEST(LiveCut, ShowsTheValuesOfTheScanBetweenVoxels) {
  const auto body = ball_of_bone();
  const SparseGrid hu = hu_where_bone_is(body->bone);
  const CtValues ct(hu);
  LiveCut cut;
  cut.parts = {{body, {}}};
  cut.ct = &ct;
  cut.hu = {1000, 500};
  std::vector<std::uint32_t> rgba;
  for (const auto& oblique : {std::optional<SliceAxes>(), std::optional(kTilted)}) {
    const SliceView view = view_of(101, 0.21, oblique, {0.3, -0.2, 1.1});
    draw_live_cut(view, cut, rgba);
    for (int y = 0; y < view.height; ++y) {
      for (int x = 0; x < view.width; ++x) {
        const Vec3 p = view.world(x, y);
        const std::uint32_t c = rgba[static_cast<std::size_t>(y * view.width + x)];
        if (length(p) < kRadius - 1 && length(p) > 1) {
          ASSERT_NEAR(red(c), cut.hu.grey(hu_of(p)), 2) << x << ' ' << y;
        }
        if (length(p) > kRadius + 1) {
          ASSERT_EQ(c, 0xff000000U) << x << ' ' << y;
        }
        ASSERT_EQ(red(c), blue(c));
      }
    }
  }
  EXPECT_NEAR(*ct.at_world({3, 0, 0}), 700, 3);
  EXPECT_FALSE(ct.at_world({11, 0, 0}));
  EXPECT_FALSE(ct.at_world({1e9, 0, 0}));
}

TEST(LiveCut, AWholeScanShowsSoftTissueToo) {
  Image scan;
  scan.frame.dims = {20, 20, 20};
  scan.frame.origin_mm = {-9.5, -9.5, -9.5};
  const auto v = make_voxels<std::int16_t>(scan.frame.voxel_count());
  std::fill_n(v.get(), scan.frame.voxel_count(), std::int16_t{40});
  scan.voxels = v;
  const CtValues ct(scan);
  LiveCut cut;
  cut.ct = &ct;
  cut.hu = grey_presets()[1].hu;
  std::vector<std::uint32_t> rgba;
  draw_live_cut(view_of(40, 1), cut, rgba);
  EXPECT_NEAR(red(rgba[20 * 40 + 20]), 127.5, 1);
  EXPECT_EQ(rgba[0], 0xff000000U);  // outside the scan
}

TEST(LiveCut, KnowsTheScanOfTheCaseFromAnother) {
  const auto body = ball_of_bone();
  const SparseGrid kept = hu_where_bone_is(body->bone);
  const auto scan_at = [](Vec3 shift, int size) {
    Image scan;
    scan.frame.dims = {size, size, size};
    const double lo = -(size - 1) / 2.0;
    scan.frame.origin_mm = Vec3{lo, lo, lo} + shift;
    const auto v = make_voxels<std::int16_t>(scan.frame.voxel_count());
    std::size_t n = 0;
    for (int k = 0; k < size; ++k)
      for (int j = 0; j < size; ++j)
        for (int i = 0; i < size; ++i)
          v[n++] = static_cast<std::int16_t>(
              std::lround(hu_of(scan.frame.world_from_index({double(i), double(j), double(k)}) - shift)));
    scan.voxels = v;
    return scan;
  };
  EXPECT_LT(difference_hu(kept, scan_at({}, 20)), 5);
  EXPECT_GT(difference_hu(kept, scan_at({3, 0, 0}, 24)), 60);
  EXPECT_EQ(difference_hu(kept, scan_at({}, 8)), std::numeric_limits<double>::infinity());  // a part of it
}

TEST(LiveCut, TintsWhatIsMissingAndOnlyThat) {
  const auto body = ball_of_bone();
  const GridSampler before(to_sparse(body->bone, "density"));
  LiveCut cut;
  cut.parts = {{body, {}}};
  cut.before = {&before};
  std::vector<std::uint32_t> rgba;
  const SliceView view = view_of(120, 0.2);
  draw_live_cut(view, cut, rgba);
  for (const std::uint32_t c : rgba) ASSERT_EQ(red(c), blue(c));  // nothing is missing, at no edge either
  // A burr's ball of 3 mm at the rim.
  const Vec3 at{7, 0, 0};
  for (VoxelKey v = 0; v < body->bone.brick_count() * BrickGrid::kVoxels; ++v) {
    const Ijk c = body->bone.coordinate(v);
    if (length(body->bone.frame().world_from_index({double(c.i), double(c.j), double(c.k)}) - at) < 3)
      body->bone.set(v, 0);
  }
  draw_live_cut(view, cut, rgba);
  double tinted_mm2 = 0;
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      const std::uint32_t c = rgba[static_cast<std::size_t>(y * view.width + x)];
      const Vec3 p = view.world(x, y);
      const double burr = length(p - at) - 3;
      if (blue(c) > red(c)) tinted_mm2 += 0.04 * (blue(c) - red(c)) / (0.55 * (kRemovedColour[2] - kRemovedColour[0]));
      if (burr > 0.9) {
        ASSERT_EQ(red(c), blue(c));
      }
      if (burr < -0.9 && length(p) < kRadius - 0.9) {
        ASSERT_GT(blue(c), red(c) + 60);
      }
    }
  }
  // Two circles, of 8 and 3, 7 apart: what they have in common.
  const double a = std::acos((49 + 64 - 9) / (2 * 7.0 * 8)), b = std::acos((49 + 9 - 64) / (2 * 7.0 * 3));
  const double lens = 64 * (a - std::sin(2 * a) / 2) + 9 * (b - std::sin(2 * b) / 2);
  EXPECT_NEAR(tinted_mm2, lens, 0.05 * lens);
  cut.tint_removed = false;
  draw_live_cut(view, cut, rgba);
  for (const std::uint32_t c : rgba) ASSERT_EQ(red(c), blue(c));
}

TEST(LiveCut, APieceThatWasMovedTakesItsValuesAlong) {
  const auto body = ball_of_bone();
  const SparseGrid hu = hu_where_bone_is(body->bone);
  const CtValues ct(hu);
  LiveCut cut;
  const Vec3 by{20, 3, 0};
  cut.parts = {{body, RigidTransform{{}, by}.inverse()}};
  cut.ct = &ct;
  cut.hu = {1000, 500};
  std::vector<std::uint32_t> rgba;
  const SliceView view = view_of(21, 0.5, {}, by);
  draw_live_cut(view, cut, rgba);
  for (int y = 0; y < view.height; ++y)
    for (int x = 0; x < view.width; ++x) {
      const double r = length(view.world(x, y) - by);
      if (r > 0.5 && r < 7) {
        ASSERT_NEAR(red(rgba[static_cast<std::size_t>(y * 21 + x)]), cut.hu.grey(1000 - 100 * r), 2);
      }
    }
}

TEST(LiveCut, TheFinerGridTellsWhatWasThere) {
  // A fine block in which there was no bone, inside a coarse one that (before the block was taken out of it) was full
  // there.
  const auto body = ball_of_bone();
  const GridSampler coarse(to_sparse(body->bone, "density"));
  BrickGrid empty = test::solid(0.25, 2, [](Vec3 p) { return p.x > 1.6; });
  const GridSampler fine(to_sparse(empty, "density"));
  auto nothing = std::make_shared<Body>();
  nothing->bone = BrickGrid(body->bone.frame(), {});
  LiveCut cut;
  cut.parts = {{nothing, {}}};
  cut.before = {&fine, &coarse};
  std::vector<std::uint32_t> rgba;
  const SliceView view = view_of(41, 0.25);
  draw_live_cut(view, cut, rgba);
  EXPECT_EQ(blue(rgba[20 * 41 + 20]), 0);    // the fine one's: there was none
  EXPECT_GT(blue(rgba[20 * 41 + 36]), 100);  // 4 mm beside: the coarse one's
}

// --- outlines
// -----------------------------------------------------------------------------------------------------------------------------

TEST(CutOutline, OfABallIsACircleWithinHalfAPixel) {
  const auto body = ball_of_bone();
  const TriMesh mesh = surface_nets(body->bone).mesh;
  for (const Vec3 normal : {Vec3{0, 0, 1}, normalized({0.3, -0.5, 0.8})}) {
    for (const double off : {0.0, 3.0, 7.0}) {
      const auto lines = section_of(mesh, normal * off, normal);
      ASSERT_EQ(lines.size(), 1u);
      EXPECT_TRUE(lines[0].closed);
      double around = 0, off2 = 0;
      const double radius = std::sqrt(kRadius * kRadius - off * off);
      for (std::size_t n = 0; n < lines[0].points_mm.size(); ++n) {
        const Vec3 p = lines[0].points_mm[n];
        ASSERT_NEAR(dot(p, normal), off, 1e-5);
        ASSERT_NEAR(length(p - normal * off), radius, 0.1) << off;  // half a pixel of 0.2 mm
        off2 += std::pow(length(p - normal * off) - radius, 2);
        around += length(lines[0].points_mm[(n + 1) % lines[0].points_mm.size()] - p);
      }
      std::printf("cut %.0f mm beside the middle: outline off by %.3f mm rms\n", off,
                  std::sqrt(off2 / static_cast<double>(lines[0].points_mm.size())));
      EXPECT_NEAR(around, 2 * std::numbers::pi * radius, 0.03 * 2 * std::numbers::pi * radius);
    }
    EXPECT_TRUE(section_of(mesh, normal * 9, normal).empty());
  }
}

TEST(CutOutline, TwoBodiesAreTwoLoopsAndAnOpenMeshALine) {
  auto body = std::make_shared<Body>();
  body->bone = test::solid(0.5, 12, [](Vec3 p) {
    return length(p - Vec3{5, 0, 0}) < 3 || length(p + Vec3{5, 0, 0}) < 2;
  });
  EXPECT_EQ(section_of(surface_nets(body->bone).mesh, {}, {0, 0, 1}).size(), 2u);
  TriMesh sheet;  // two triangles, upright
  sheet.points_mm = {{0, 0, -1}, {2, 0, -1}, {2, 0, 1}, {0, 0, 1}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  const auto lines = section_of(sheet, {}, {0, 0, 1});
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_FALSE(lines[0].closed);
  ASSERT_EQ(lines[0].points_mm.size(), 3u);
  EXPECT_NEAR(length(lines[0].points_mm.front() - lines[0].points_mm.back()), 2, 1e-6);
}

// Each point lies on the tool's surface and in the plane; and none of the outline is missing.
TEST(CutOutline, OfEveryInstrumentIsItsTrueShape) {
  const Vec3 at{3, -2, 7}, axis = normalized({0.3, 0.8, -0.5}), beside = any_perpendicular(axis);
  const Vec3 across = cross(axis, beside);
  for (const Instrument& tool : instrument_library()) {
    for (const RoundCone* const shape : {&tool.head, &tool.shaft}) {
      const Vec3 middle = at + axis * (shape->start_mm + shape->length_mm / 3);
      for (const Vec3 normal : {axis, beside, normalized(axis + beside), normalized(axis * 0.02 + beside)}) {
        const CutLine line = section_of(*shape, at, axis, middle, normal);
        ASSERT_EQ(line.points_mm.size(), 128u) << tool.name;
        Vec3 lo{1e9, 1e9, 1e9}, hi{-1e9, -1e9, -1e9};
        for (const Vec3 p : line.points_mm) {
          const Vec3 d = p - at, own{dot(d, beside), dot(d, across), dot(d, axis)};
          ASSERT_NEAR(shape->distance_mm(own), 0, 1e-4) << tool.name;
          ASSERT_NEAR(dot(p - middle, normal), 0, 1e-9);
          for (std::size_t a = 0; a < 3; ++a) {
            lo[a] = std::min(lo[a], own[a]);
            hi[a] = std::max(hi[a], own[a]);
          }
        }
        if (normal == beside) {  // along the axis: all of its length
          EXPECT_NEAR(lo.z, shape->start_mm - shape->start_radius_mm, 1e-3) << tool.name;
          EXPECT_NEAR(hi.z, shape->start_mm + shape->length_mm + shape->end_radius_mm, 1e-3) << tool.name;
        }
        if (normal == axis && shape->slope() == 0) {
          EXPECT_NEAR(hi.x - lo.x, 2 * shape->start_radius_mm, 1e-2) << tool.name;
        }
      }
      const double beyond = shape->start_mm + shape->length_mm + shape->end_radius_mm + 0.01;
      EXPECT_TRUE(section_of(*shape, at, axis, at + axis * beyond, axis).points_mm.empty()) << tool.name;
    }
  }
}

}  // namespace
}  // namespace osteo
