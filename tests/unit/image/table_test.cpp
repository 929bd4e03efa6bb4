// Table and head holder: what is certain goes, no voxel of the head does, and what is not certain stays and is
// reported.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "osteo/core/base/error.h"
#include "osteo/imaging/image/threshold.h"

namespace osteo {
namespace {

constexpr int kN = 110, kSlices = 60;
constexpr double kMm = 2;

struct Scene {
  Image ct;
  std::vector<bool> head, holder;  // bone, and what is none
};

double ellipsoid(Vec3 p, Vec3 radii) {
  return length({p.x / radii.x, p.y / radii.y, p.z / radii.z});
}

// A head on its back, 150 x 190 mm, open below; +y is down. `extra`: HU to put over it, or below -2000 nothing.
Scene scene(bool tissue, bool with_holder, const std::function<double(Vec3)>& extra = nullptr) {
  Scene s;
  s.ct.frame.dims = {kN, kN, kSlices};
  s.ct.frame.spacing_mm = {kMm, kMm, kMm};
  s.ct.frame.origin_mm = {-kMm * (kN - 1) / 2, -kMm * (kN - 1) / 2, -20};
  const auto voxels = make_voxels<std::int16_t>(s.ct.frame.voxel_count());
  s.head.resize(s.ct.frame.voxel_count());
  s.holder.resize(s.ct.frame.voxel_count());
  std::size_t at = 0;
  for (int k = 0; k < kSlices; ++k) {
    for (int j = 0; j < kN; ++j) {
      for (int i = 0; i < kN; ++i, ++at) {
        const Vec3 p = s.ct.frame.world_from_index({double(i), double(j), double(k)});
        const double skin = ellipsoid(p, {75, 90, 95}), outer = ellipsoid(p, {68, 83, 88}),
                     inner = ellipsoid(p, {62, 77, 82});
        double hu = -1000;
        if (tissue && skin < 1) hu = 40;
        if (outer < 1 && inner >= 1) hu = 1000;
        // A wide cavity of air that opens to the front, with a thin free wall in its middle.
        const Vec3 nose = p - Vec3{0, -62, -5};
        if (tissue && ellipsoid(nose, {24, 36, 24}) < 1) hu = -1000;
        const bool septum = tissue && std::abs(nose.x) < 1.1 && std::abs(nose.y) < 10 && std::abs(nose.z) < 10;
        if (septum) hu = 800;
        const double r = std::hypot(p.x, p.y - 4);
        const bool holder = with_holder && std::abs(r - 100) < 2 && p.y > 20;
        if (holder) hu = 700;
        if (extra) {
          if (const double v = extra(p); v > -2000) hu = v;
        }
        voxels[at] = static_cast<std::int16_t>(hu);
        s.head[at] = hu >= 500 && !holder && (outer < 1.001 || septum);
        s.holder[at] = holder && hu >= 500;
      }
    }
  }
  s.ct.voxels = voxels;
  return s;
}

struct Outcome {
  std::size_t head_lost = 0, holder_left = 0, holder = 0;
  std::string said, warned;
};

Outcome take_off(const Scene& s, const ThresholdParams& given = {}) {
  ThresholdParams p = given;
  p.lower = 500;
  p.min_volume_mm3 = 0;
  Context context;
  Outcome o;
  context.on_log([&](LogLevel level, std::string_view text) {
    if (level == LogLevel::warning) o.warned += text;
  });
  const Labels mask = threshold(s.ct, p, context);
  for (const auto& [key, value] : context.take_report()) {
    if (key == "table") o.said = std::get<std::string>(value);
  }
  for (std::size_t v = 0; v < s.head.size(); ++v) {
    o.head_lost += s.head[v] && mask.voxels[v] == 0 ? 1 : 0;
    o.holder_left += s.holder[v] && mask.voxels[v] != 0 ? 1 : 0;
    o.holder += s.holder[v] ? 1 : 0;
  }
  return o;
}

TEST(Table, CertainHolderGoesAndNoVoxelOfTheHead) {
  const Outcome o = take_off(scene(true, true));
  EXPECT_GT(o.holder, 1000U);
  EXPECT_EQ(o.holder_left, 0U);
  EXPECT_EQ(o.head_lost, 0U);
  EXPECT_EQ(o.said.find("taken off: "), 0U) << o.said;
  EXPECT_EQ(o.warned, "");
}

TEST(Table, NoneIsNone) {
  const Outcome o = take_off(scene(true, false));
  EXPECT_EQ(o.head_lost, 0U);
  EXPECT_EQ(o.said, "none found");
}

TEST(Table, KeptWhenAsked) {
  ThresholdParams p;
  p.keep_table = true;
  const Outcome o = take_off(scene(true, true), p);
  EXPECT_EQ(o.holder_left, o.holder);
  EXPECT_EQ(o.said.find("left on, as asked"), 0U) << o.said;
  p.remove_table = true;
  EXPECT_THROW(static_cast<void>(take_off(scene(true, true), p)), Error);
}

TEST(Table, WhatTouchesTheSkullStaysAndIsTold) {
  // A bar from the holder into the skull.
  const Scene s = scene(
      true, true, [](Vec3 p) { return std::abs(p.x) < 3 && std::abs(p.z) < 3 && p.y > 70 && p.y < 105 ? 900 : -3000; });
  const Outcome o = take_off(s);
  EXPECT_EQ(o.head_lost, 0U);
  EXPECT_EQ(o.holder_left, o.holder);
  EXPECT_NE(o.warned.find("touches bone of the body"), std::string::npos) << o.said;
  EXPECT_NE(o.warned.find("--remove-table"), std::string::npos);
  ThresholdParams p;
  p.remove_table = true;
  const Outcome asked = take_off(s, p);
  EXPECT_EQ(asked.head_lost, 0U);
  EXPECT_LT(asked.holder_left, asked.holder / 20);
}

TEST(Table, ALimbBesideTheHeadIsNoTable) {
  // An arm beside the head, its bone 14 mm thick in 40 mm of tissue.
  const Scene s = scene(true, false, [](Vec3 p) {
    const double r = std::hypot(p.x - 87, p.y - 87);
    return r < 7 ? 1000.0 : r < 20 ? 40.0 : -3000.0;
  });
  ThresholdParams p;
  const Outcome o = take_off(s, p);
  EXPECT_EQ(o.head_lost, 0U);
  EXPECT_NE(o.said.find("LEFT ON: it has tissue near it, as a limb has"), std::string::npos) << o.said;
}

TEST(Table, DrySkullLosesNothing) {
  const Scene s = scene(false, true);
  const Outcome o = take_off(s);
  EXPECT_EQ(o.head_lost, 0U);
  EXPECT_EQ(o.holder_left, o.holder);
  EXPECT_NE(o.warned.find("dry skull"), std::string::npos) << o.said;
  ThresholdParams p;
  p.remove_table = true;
  const Outcome asked = take_off(s, p);
  EXPECT_EQ(asked.head_lost, 0U);
  EXPECT_EQ(asked.holder_left, 0U);
}

TEST(Table, ASkullFilledWithGelLosesNoLooseJaw) {
  // A teaching phantom: gel inside, no skin, and a jaw that hangs free in front.
  const auto jaw = [](Vec3 p) { return std::abs(p.x) < 30 && std::abs(p.y + 98) < 5 && std::abs(p.z + 5) < 8; };
  Scene s = scene(false, false, [&](Vec3 p) {
    return jaw(p) ? 1000.0 : ellipsoid(p, {62, 77, 82}) < 1 ? 40.0 : -3000.0;
  });
  std::size_t at = 0;
  for (int k = 0; k < kSlices; ++k) {
    for (int j = 0; j < kN; ++j) {
      for (int i = 0; i < kN; ++i, ++at) s.head[at] = s.ct.voxels[at] >= 500;
    }
  }
  EXPECT_EQ(take_off(s).head_lost, 0U);
}

TEST(Table, ThreadsDoNotMatter) {
  const Scene s = scene(true, true);
  Context one, four;
  one.threads = 1;
  four.threads = 4;
  const Labels a = threshold(s.ct, {.lower = 500}, one), b = threshold(s.ct, {.lower = 500}, four);
  EXPECT_TRUE(std::equal(a.span().begin(), a.span().end(), b.span().begin()));
}

}  // namespace
}  // namespace osteo
