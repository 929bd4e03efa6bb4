// Labels beside what is found without training: planted differences are found at their place, true labels are not
// doubted.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "ear_truth.h"
#include "osteo/core/base/error.h"

namespace osteo::test {
namespace {

constexpr std::uint8_t kSinus = 7, kLabyrinth = 12, kCells = 17, kCanal = 18, kCavity = 19;

const Phantom& ear() {
  static const Phantom phantom = [] {
    PhantomParams p;
    p.region = PhantomRegion::temporal;
    p.spacing_mm = 0.5;
    p.individual = 4;
    p.noise_hu = 30;
    return make_phantom(p);
  }();
  return phantom;
}

/// Of the truth those that are compared; `keep` says of each voxel whether it stays.
template <class Keep>
Labels labelled(const std::vector<std::uint8_t>& values, const Keep& keep) {
  Labels l;
  const Labels& truth = ear().labels;
  l.frame = truth.frame;
  const auto v = make_voxels<std::uint8_t>(l.frame.voxel_count());
  std::size_t n = 0;
  for (int k = 0; k < l.frame.dims[2]; ++k)
    for (int j = 0; j < l.frame.dims[1]; ++j)
      for (int i = 0; i < l.frame.dims[0]; ++i, ++n) {
        const std::uint8_t t = truth.voxels[n];
        const bool wanted = std::find(values.begin(), values.end(), t) != values.end();
        v[static_cast<std::ptrdiff_t>(n)] =
            wanted && keep(t, l.frame.world_from_index({double(i), double(j), double(k)})) ? t : 0;
      }
  l.voxels = v;
  for (const std::uint8_t value : values) {
    const std::string name(tissue_name(static_cast<Tissue>(value)));
    l.structures.push_back({.value = value, .name = name});
  }
  return l;
}
const auto kAll = [](std::uint8_t, Vec3) { return true; };

const ComparedStructure& of(const EarComparison& c, const std::string& name) {
  for (const ComparedStructure& s : c.structures)
    if (s.name.find(name) != std::string::npos) return s;
  throw std::runtime_error("not compared: " + name);
}

std::size_t differing(const EarComparison& c, std::uint8_t value) {
  std::size_t n = 0;
  for (std::size_t v = 0; v < c.apart.size(); ++v) n += c.apart[v] == 255 && c.fused.voxels[v] == value ? 1 : 0;
  return n;
}

TEST(EarAgreement, OfTrueLabelsNothingDiffers) {
  const EarComparison c = compare_with_ear(ear().ct, labelled({kSinus, kLabyrinth, kCells, kCanal, kCavity}, kAll));
  ASSERT_EQ(c.structures.size(), 4U);
  for (const ComparedStructure& s : c.structures) {
    EXPECT_TRUE(s.labelled && s.found) << s.name << ": " << s.why;
    EXPECT_TRUE(s.places.empty()) << s.name << " " << s.places.front().apart_mm;
    EXPECT_GT(s.dice, 0.85) << s.name;
  }
  EXPECT_EQ(std::count(c.apart.begin(), c.apart.end(), 255), 0);
}

TEST(EarAgreement, ABallBesideTheSinusIsToldByItsPlace) {
  // Outward of the sinus' wall, where it runs down.
  const auto line = HeadAnatomy(4).sigmoid_sinus();
  Vec3 middle = line.front().at_mm;
  for (const TubePoint& p : line)
    if (p.at_mm.y > 20 && std::abs(p.at_mm.z + 22) < std::abs(middle.z + 22)) middle = p.at_mm;
  const Vec3 ball = middle + Vec3{6, 0, 0};
  Labels l = labelled({kSinus, kCanal, kLabyrinth}, kAll);
  const auto v = make_voxels<std::uint8_t>(l.frame.voxel_count());
  std::copy_n(l.voxels.get(), l.frame.voxel_count(), v.get());
  std::size_t n = 0;
  for (int k = 0; k < l.frame.dims[2]; ++k)
    for (int j = 0; j < l.frame.dims[1]; ++j)
      for (int i = 0; i < l.frame.dims[0]; ++i, ++n)
        if (length(l.frame.world_from_index({double(i), double(j), double(k)}) - ball) < 4)
          v[static_cast<std::ptrdiff_t>(n)] = kSinus;
  l.voxels = v;
  const EarComparison c = compare_with_ear(ear().ct, l);
  const ComparedStructure& sinus = of(c, "sigmoid sinus");
  ASSERT_FALSE(sinus.places.empty());
  EXPECT_LT(length(sinus.places.front().at_mm - ball), 5);
  EXPECT_GT(sinus.places.front().apart_mm, 2);
  EXPECT_TRUE(of(c, "ear canal").places.empty());
  EXPECT_GT(differing(c, kSinus), 20U);
  EXPECT_EQ(differing(c, kCanal), 0U);
}

TEST(EarAgreement, WhatTheLabelsHaveNoneOfIsDrawnAsItWasFound) {
  const EarComparison c = compare_with_ear(
      ear().ct, labelled({kSinus, kCanal, kLabyrinth}, [](std::uint8_t t, Vec3) { return t != kSinus; }));
  const ComparedStructure& sinus = of(c, "sigmoid sinus");
  EXPECT_FALSE(sinus.labelled);
  ASSERT_TRUE(sinus.found) << sinus.why;
  EXPECT_GT(std::count(c.fused.span().begin(), c.fused.span().end(), kSinus), 4000);
}

TEST(EarAgreement, WhatTheScanDoesNotShowIsNotFound) {
  // A CT of nothing: neither canal nor walls.
  Image blank = ear().ct;
  const auto v = make_voxels<std::int16_t>(blank.frame.voxel_count());
  std::fill_n(v.get(), blank.frame.voxel_count(), std::int16_t{40});
  blank.voxels = v;
  const Labels l = labelled({kSinus, kCanal}, kAll);
  const EarComparison c = compare_with_ear(blank, l);
  ASSERT_EQ(c.structures.size(), 2U);
  for (const ComparedStructure& s : c.structures) {
    EXPECT_TRUE(s.labelled);
    EXPECT_FALSE(s.found) << s.name;
    EXPECT_NE(s.why, "") << s.name;
    EXPECT_TRUE(s.places.empty());
  }
  EXPECT_TRUE(std::equal(c.fused.span().begin(), c.fused.span().end(), l.span().begin()));
  EXPECT_EQ(std::count(c.apart.begin(), c.apart.end(), 0), static_cast<std::ptrdiff_t>(c.apart.size()));
}

TEST(EarAgreement, WhatBothEarsLackIsDrawnByTheSidesOfItsNames) {
  Labels l = labelled({kSinus, kCanal, kLabyrinth}, [](std::uint8_t t, Vec3) { return t != kSinus; });
  l.structures[0].name = "sigmoid_sinus_left";
  l.structures.push_back({.value = 60, .name = "Right Sigmoid Sinus"});
  const EarComparison c = compare_with_ear(ear().ct, l);
  const ComparedStructure &left = of(c, "sinus_left"), &right = of(c, "Right Sigmoid");
  EXPECT_EQ(left.values, std::vector<std::uint8_t>{kSinus});
  EXPECT_FALSE(left.labelled);
  EXPECT_TRUE(left.found) << left.why;
  // The scan is of the left ear.
  EXPECT_FALSE(right.found);
  EXPECT_NE(right.why, "");
  EXPECT_GT(std::count(c.fused.span().begin(), c.fused.span().end(), kSinus), 4000);
  EXPECT_EQ(std::count(c.fused.span().begin(), c.fused.span().end(), 60), 0);
}

/// Beside the ear its mirror image, as far away as the other ear is.
template <class T>
Volume<T> with_mirrored(const Volume<T>& one, T between) {
  Frame f = one.frame;
  const double low = f.origin_mm.x, step = f.spacing_mm.x;
  const int nx = f.dims[0], right = static_cast<int>(std::lround((low + (nx - 1) * step) / step));
  f.dims[0] = 2 * right + 1;
  f.origin_mm.x = -right * step;
  const auto v = make_voxels<T>(f.voxel_count());
  std::fill_n(v.get(), f.voxel_count(), between);
  const Volume<T> shape{f, v};
  for (int k = 0; k < f.dims[2]; ++k)
    for (int j = 0; j < f.dims[1]; ++j)
      for (int i = 0; i < nx; ++i)
        for (const int to : {right + static_cast<int>(std::lround(low / step)) + i,
                             right - static_cast<int>(std::lround(low / step)) - i})
          if (to >= 0 && to < f.dims[0]) v[static_cast<std::ptrdiff_t>(shape.offset(to, j, k))] = one.at(i, j, k);
  return shape;
}

TEST(EarAgreement, BothEarsAreComparedWhereOneLabelIsOfBoth) {
  Labels l = labelled({kLabyrinth}, kAll);
  const std::vector<Structure> names = l.structures;
  l = {with_mirrored<std::uint8_t>(l, 0), names};
  const Image head{with_mirrored<std::int16_t>(ear().ct, 40)};
  const EarComparison c = compare_with_ear(head, l);
  const ComparedStructure& both = of(c, "labyrinth");
  ASSERT_TRUE(both.found) << both.why;
  EXPECT_GT(both.dice, 0.85);
  EXPECT_TRUE(both.places.empty()) << both.places.front().at_mm.x;
}

TEST(EarAgreement, NamesThatAreNotKnownAreNotCompared) {
  Labels l = labelled({kCanal}, kAll);
  for (const char* const other : {"mandible", "internal ear canal", "labyrinthine artery", "sigmoid sinus segment",
                                  "facial nerve labyrinthine segment", "artery of the labyrinth"}) {
    l.structures.front().name = other;
    EXPECT_TRUE(compare_with_ear(ear().ct, l).structures.empty()) << other;
  }
  l.frame.origin_mm.x += 5;
  EXPECT_THROW(static_cast<void>(compare_with_ear(ear().ct, l)), Error);
}

TEST(EarAgreement, SameBitsForAnyNumberOfThreads) {
  const Labels l = labelled({kSinus, kCanal}, kAll);
  Context one, two;
  one.threads = 1;
  two.threads = 2;
  const EarComparison a = compare_with_ear(ear().ct, l, one), b = compare_with_ear(ear().ct, l, two);
  EXPECT_EQ(a.apart, b.apart);
  EXPECT_TRUE(std::equal(a.fused.span().begin(), a.fused.span().end(), b.fused.span().begin()));
}

}  // namespace
}  // namespace osteo::test
