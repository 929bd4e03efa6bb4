#include "osteo/imaging/segment/ear.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "ear_truth.h"
#include "osteo/core/base/error.h"
#include "osteo/imaging/image/crop.h"

namespace osteo::test {
namespace {

constexpr std::array<double, 3> kVestibule{36.8, 3.1, -16.4};

const Phantom& ear() {
  static const Phantom phantom = [] {
    PhantomParams p;
    p.region = PhantomRegion::temporal;
    p.spacing_mm = 0.8;
    p.individual = 3;
    p.noise_hu = 30;
    return make_phantom(p);
  }();
  return phantom;
}

EarFindings find(const Image& ct, const std::string& what, Side side = Side::left) {
  EarParams p;
  p.what = what;
  p.side = side;
  if (what == "all") p.labyrinth_mm = kVestibule;
  return find_ear_structures(ct, p);
}

/// The CT with each voxel's value changed.
Image changed(const Image& ct, const std::function<int(std::size_t, Vec3, int)>& change) {
  const auto v = make_voxels<std::int16_t>(ct.frame.voxel_count());
  std::size_t at = 0;
  for (int k = 0; k < ct.frame.dims[2]; ++k)
    for (int j = 0; j < ct.frame.dims[1]; ++j)
      for (int i = 0; i < ct.frame.dims[0]; ++i, ++at)
        v[at] = static_cast<std::int16_t>(
            change(at, ct.frame.world_from_index({double(i), double(j), double(k)}), ct.voxels[at]));
  return {ct.frame, v};
}

const EarFinding& of(const EarFindings& f, EarStructure what) {
  for (const EarFinding& x : f.findings)
    if (x.what == what) return x;
  throw std::runtime_error("not asked for");
}

void expect_overlaps(const EarFindings& found, const std::array<double, kEarStructures>& least) {
  const HeadAnatomy head(3);
  for (const EarFinding& f : found.findings) {
    const auto s = static_cast<std::size_t>(f.what);
    ASSERT_TRUE(f.found) << EnumNames<EarStructure>::values[s] << ": " << f.why;
    const Overlap o = overlap(found.labels, static_cast<std::uint8_t>(1 + s), ear_truth(ear().labels, head, f.what));
    EXPECT_GT(o.dice, least[s]) << EnumNames<EarStructure>::values[s];
    EXPECT_LT(o.p95_mm, 3.5) << EnumNames<EarStructure>::values[s];
    EXPECT_GT(f.quality, 0.5) << EnumNames<EarStructure>::values[s];
    EXPECT_NEAR(f.volume_mm3, o.true_mm3, 0.3 * o.true_mm3) << EnumNames<EarStructure>::values[s];
  }
}

TEST(Ear, StructuresOfAPhantomAtCoarseSpacing) {
  const EarFindings found = find(ear().ct, "ear_canal,air_cells,sigmoid_sinus,tegmen,dura");
  ASSERT_EQ(found.findings.size(), 5u);
  EXPECT_LT(length(found.drum_mm - kTrueDrum), 3);
  expect_overlaps(found, {0.8, 0.7, 0.8, 0.7, 0.75, 0.7});
}

TEST(Ear, AScaleOffByFivePercent) {
  for (const double scale : {0.95}) {
    expect_overlaps(find(scaled(ear().ct, scale), "sigmoid_sinus,tegmen"), {0.8, 0.7, 0.8, 0.7, 0.75, 0.7});
  }
}

TEST(Ear, TheRightEarIsTheMirrorOfTheLeft) {
  // Voxel for voxel: the same bytes behind a mirrored frame.
  Image ct = ear().ct;
  ct.frame.origin_mm.x *= -1;
  for (Vec3& c : ct.frame.direction.column) c.x *= -1;
  const EarFindings left = find(ear().ct, "ear_canal,air_cells,tegmen"),
                    right = find(ct, "ear_canal,air_cells,tegmen", Side::right);
  ASSERT_EQ(left.findings.size(), right.findings.size());
  for (std::size_t i = 0; i < ct.frame.voxel_count(); ++i) ASSERT_EQ(left.labels.voxels[i], right.labels.voxels[i]);
  EXPECT_DOUBLE_EQ(left.drum_mm.x, -right.drum_mm.x);
}

TEST(Ear, NothingIsFoundOnTheWrongSide) {
  const EarFindings found = find(ear().ct, "all", Side::right);
  for (const EarFinding& f : found.findings) {
    if (f.what == EarStructure::labyrinth) continue;  // its point was given
    EXPECT_FALSE(f.found);
    EXPECT_NE(f.why, "");
    EXPECT_EQ(f.volume_mm3, 0);
  }
  for (const Structure& s : found.labels.structures) EXPECT_EQ(s.name, "labyrinth");
}

TEST(Ear, ADrySkullHasNoSinusAndNoDura) {
  const Image dry = changed(ear().ct, [](std::size_t, Vec3, int hu) { return hu < 350 ? -1000 : hu; });
  for (const EarFinding& f : find(dry, "sigmoid_sinus,tegmen,dura").findings) {
    EXPECT_FALSE(f.found) << EnumNames<EarStructure>::values[static_cast<std::size_t>(f.what)];
    EXPECT_NE(f.why, "");
  }
}

TEST(Ear, WhatIsCutOffIsNotFound) {
  // Nothing above the ear: no floor of the middle fossa.
  const Frame& f = ear().ct.frame;
  Image low = ear().ct;
  low.frame.dims[2] = static_cast<int>((-14 - f.origin_mm.z) / f.spacing_mm.z);
  const EarFindings a = find(low, "ear_canal,sigmoid_sinus,tegmen,dura");
  EXPECT_TRUE(of(a, EarStructure::ear_canal).found);
  for (const EarStructure s : {EarStructure::tegmen, EarStructure::dura}) EXPECT_FALSE(of(a, s).found);
  // Nothing behind it: no sinus.
  const auto keep = static_cast<int>((12 - f.origin_mm.y) / f.spacing_mm.y);
  Image front;
  front.frame = f;
  front.frame.dims[1] = keep;
  const auto v = make_voxels<std::int16_t>(front.frame.voxel_count());
  std::size_t at = 0;
  for (int k = 0; k < f.dims[2]; ++k)
    for (int j = 0; j < keep; ++j)
      for (int i = 0; i < f.dims[0]; ++i, ++at) v[at] = ear().ct.at(i, j, k);
  front.voxels = v;
  EXPECT_FALSE(of(find(front, "sigmoid_sinus"), EarStructure::sigmoid_sinus).found);
}

TEST(Ear, AClosedCanalAndAFilledMastoidAreNotFound) {
  const auto& labels = ear().labels;
  const Image closed = changed(ear().ct, [&](std::size_t at, Vec3 p, int hu) {
    return labels.voxels[at] == static_cast<std::uint8_t>(Tissue::ear_canal) ||
                   (hu < 300 && p.x > 46 && length(Vec3{0, p.y - 3, p.z + 19}) < 8)
               ? 40
               : hu;
  });
  EXPECT_FALSE(of(find(closed, "ear_canal"), EarStructure::ear_canal).found);
  const Image filled = changed(ear().ct, [&](std::size_t, Vec3 p, int hu) {
    return hu < -100 && length(p - Vec3{52, 15, -22}) < 30 && p.y > 4.5 + 0.05 * (p.x - 45) + 5 ? 40 : hu;
  });
  const EarFindings f = find(filled, "air_cells");
  // What is left is the middle ear, a small part.
  EXPECT_LT(of(f, EarStructure::air_cells).volume_mm3, 2500);
}

TEST(Ear, WithoutAVisibleDrumNothingIsPlacedByTheCanal) {
  // The drum's plane is air: canal, middle ear and cells are one.
  const auto& labels = ear().labels;
  const Image open = changed(ear().ct, [&](std::size_t at, Vec3 p, int hu) {
    const auto t = static_cast<Tissue>(labels.voxels[at]);
    return length(p - kTrueDrum) < 5.5 && !is_bone(t) && hu < 300 ? -1000 : hu;
  });
  for (const EarFinding& f : find(open, "ear_canal,air_cells,tegmen").findings) {
    EXPECT_FALSE(f.found) << EnumNames<EarStructure>::values[static_cast<std::size_t>(f.what)] << " of quality "
                          << f.quality;
    EXPECT_NE(f.why.find("drum"), std::string::npos) << f.why;
  }
}

// What lies above is there, but the image ends before it could be told: no dry skull.
TEST(Ear, AFieldThatEndsAboveTheEarIsTheReasonForNoBrain) {
  const auto why = [](const Image& ct) { return of(find(ct, "dura"), EarStructure::dura).why; };
  const Frame& f = ear().ct.frame;
  Image low = ear().ct;
  low.frame.dims[2] = static_cast<int>((-12 - f.origin_mm.z) / f.spacing_mm.z);
  EXPECT_NE(why(low).find("the image ends"), std::string::npos) << why(low);
}

// Fields of 40 to 50 mm, as temporal bones are scanned. Beyond the skin they hold less air than a ball of 8 mm has room
// in, which was taken for the middle ear without a drum.
TEST(Ear, SmallFieldsHaveTheirStructuresOrATrueReason) {
  const auto field = [](const Image& ct, Vec3 middle, double size) {
    const Vec3 half{size / 2, size / 2, size / 2};
    return crop(ct, {middle - half, middle + half});
  };
  const Image mouth = field(ear().ct, {55, 6, -18}, 49);
  const EarFindings found = find(mouth, "ear_canal,air_cells,sigmoid_sinus,tegmen,dura");
  for (const EarFinding& f : found.findings)
    EXPECT_TRUE(f.found) << EnumNames<EarStructure>::values[static_cast<std::size_t>(f.what)] << ": " << f.why;
  // Inward of the drum there is no canal to place anything by: that is the reason, and no drum that is not seen.
  for (const EarFinding& f : find(field(ear().ct, {22, 6, -18}, 40), "ear_canal,dura").findings) {
    EXPECT_FALSE(f.found);
    EXPECT_NE(f.why.find("the image ends inside the head on"), std::string::npos) << f.why;
    EXPECT_EQ(f.by_canal, f.what == EarStructure::dura);
  }
}

// Over the petrous bone the canal's mouth is not in the field, but the canal is, cut across.
TEST(Ear, PetrousFieldsArePlacedByTheCanalThatTheyCut) {
  const HeadAnatomy head(3);
  for (const double size : {40.0, 49.0, 60.0}) {
    const Vec3 middle{40, 6, -18}, half{size / 2, size / 2, size / 2};
    const Box box{middle - half, middle + half};
    const Labels labels = crop(ear().labels, box);
    const EarFindings found = find(crop(ear().ct, box), "ear_canal,air_cells,dura");
    for (const EarFinding& f : found.findings) {
      const auto s = static_cast<std::size_t>(f.what);
      ASSERT_TRUE(f.found) << size << " mm: " << EnumNames<EarStructure>::values[s] << ": " << f.why;
      const double dice = overlap(found.labels, static_cast<std::uint8_t>(1 + s), ear_truth(labels, head, f.what)).dice;
      EXPECT_TRUE(dice > 0.7 || f.quality < 0.7)
          << size << " mm: " << EnumNames<EarStructure>::values[s] << " " << dice;
    }
    EXPECT_LT(length(found.drum_mm - kTrueDrum), 4);
    EXPECT_NE(of(found, EarStructure::ear_canal).why.find("cuts its outer end off"), std::string::npos);
  }
}

// Without a visible drum, in a field that cuts off most of the cells: a pass between what is left of them is no drum.
TEST(Ear, CellsThatTheFieldCutsOffAreNoDrum) {
  PhantomParams p;
  p.region = PhantomRegion::temporal;
  p.spacing_mm = 0.5;
  p.individual = 19;
  p.noise_hu = 30;
  const Phantom phantom = make_phantom(p);
  std::mt19937 random(19);  // the field of bench_segment.cpp
  const auto moved = [&] { return static_cast<double>(random()) / 4294967296.0 * 8 - 4; };
  const double x = moved(), y = moved(), z = moved();
  const Vec3 middle = kTrueDrum + Vec3{10 + x, 6 + y, 2 + z}, half{20, 20, 20};
  const Box box{middle - half, middle + half};
  const Labels labels = crop(phantom.labels, box);
  const Image ct = changed(crop(phantom.ct, box), [&](std::size_t at, Vec3 place, int hu) {
    return length(place - kTrueDrum) < 5.5 && !is_bone(static_cast<Tissue>(labels.voxels[at])) && hu < 300 ? -1000 : hu;
  });
  const EarFindings found = find(ct, "ear_canal");
  EXPECT_FALSE(of(found, EarStructure::ear_canal).found) << of(found, EarStructure::ear_canal).volume_mm3;
}

TEST(Ear, NoiseMakesItUnsureRatherThanWrong) {
  PhantomParams p;
  p.region = PhantomRegion::temporal;
  p.spacing_mm = 0.8;
  p.individual = 3;
  p.noise_hu = 200;
  const Phantom noisy = make_phantom(p);
  const EarFindings found = find(noisy.ct, "ear_canal,air_cells,sigmoid_sinus,tegmen,dura");
  const HeadAnatomy head(3);
  for (const EarFinding& f : found.findings) {
    if (!f.found) continue;
    const Overlap o = overlap(found.labels, static_cast<std::uint8_t>(1 + static_cast<int>(f.what)),
                              ear_truth(noisy.labels, head, f.what));
    EXPECT_GT(o.dice, 0.5) << EnumNames<EarStructure>::values[static_cast<std::size_t>(f.what)] << " of quality "
                           << f.quality;
  }
}

TEST(Ear, LabyrinthFromAPoint) {
  EarParams p;
  p.what = "labyrinth";
  PhantomParams fine;
  fine.region = PhantomRegion::temporal;
  fine.spacing_mm = 0.6;
  fine.individual = 3;
  const Phantom phantom = make_phantom(fine);
  const HeadAnatomy head(3);
  const auto truth = ear_truth(phantom.labels, head, EarStructure::labyrinth);
  // The point need not be exact.
  for (const Vec3 shift : {Vec3{0, 0, 0}, Vec3{0.6, -0.5, 0.4}, Vec3{-0.5, 0.6, -0.5}}) {
    p.labyrinth_mm = {kVestibule[0] + shift.x, kVestibule[1] + shift.y, kVestibule[2] + shift.z};
    const EarFindings f = find_ear_structures(phantom.ct, p);
    ASSERT_TRUE(f.findings[0].found) << f.findings[0].why;
    EXPECT_GT(overlap(f.labels, 6, truth).dice, 0.8);
  }
  // Nor need it lie elsewhere than where the scanner's coordinates begin.
  Image moved = phantom.ct;
  moved.frame.origin_mm = moved.frame.origin_mm - Vec3{kVestibule[0], kVestibule[1], kVestibule[2]};
  p.labyrinth_mm = {0, 0, 0};
  EXPECT_TRUE(find_ear_structures(moved, p).findings[0].found);
  // In bone, in the ear canal, in the brain.
  for (const std::array<double, 3> wrong : {std::array<double, 3>{62, 8, -12}, {55, 3, -19}, {35, 5, 8}}) {
    p.labyrinth_mm = wrong;
    const EarFindings f = find_ear_structures(phantom.ct, p);
    EXPECT_FALSE(f.findings[0].found) << wrong[0];
    EXPECT_NE(f.findings[0].why, "");
  }
}

TEST(Ear, Refusals) {
  const auto code_of = [](const EarParams& p) {
    try {
      (void)find_ear_structures(ear().ct, p);
    } catch (const Error& e) {
      return e.code();
    }
    return ExitCode::ok;
  };
  EarParams p;
  p.what = "sigmoid_sinsu";
  EXPECT_EQ(code_of(p), ExitCode::usage);
  p.what = "";
  EXPECT_EQ(code_of(p), ExitCode::usage);
  p.what = "labyrinth";
  EXPECT_EQ(code_of(p), ExitCode::usage);
  p.labyrinth_mm = {500, 0, 0};
  EXPECT_EQ(code_of(p), ExitCode::usage);
}

}  // namespace
}  // namespace osteo::test
