#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "ball.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/geometry/grid/brick_grid.h"
#include "osteo/geometry/grid/grid_io.h"
#include "osteo/geometry/grid/resample.h"
#include "osteo/geometry/grid/sampler.h"
#include "osteo/imaging/dicom/save_series.h"
#include "osteo/imaging/dicom/volume.h"
#include "osteo/imaging/image/phantom.h"
#include "osteo/imaging/image/threshold.h"

namespace osteo {
namespace {

using test::ball;

ResampledBone bone_of(const Image& ct, double spacing, int threads = 0) {
  ThresholdParams t;
  t.lower = 500;
  ResampleParams r;
  r.lower = 500;
  r.spacing_mm = spacing;
  Context c;
  c.threads = threads;
  return resample_bone(ct, threshold(ct, t), r, c);
}

TEST(Resample, BallKeepsItsVolumeAtEveryVoxelSize) {
  const double exact = 4.0 / 3 * M_PI * std::pow(20.3, 3);
  for (const double z : {1.0, 2.0}) {
    const Image ct = ball(z, 20.3);
    for (const double h : {0.25, 0.5, 1.0, 2.0, 3.7}) {
      const auto bone = bone_of(ct, h);
      EXPECT_NEAR(bone.volume_after_mm3 / bone.volume_before_mm3, 1, 0.005) << h;
      EXPECT_NEAR(bone.volume_after_mm3 / exact, 1, 0.01) << h;
    }
  }
}

TEST(Resample, DensityIsTheShareOfTheVoxelInside) {
  const Image ct = ball(1, 20.3);
  const auto bone = to_bricks(bone_of(ct, 1.0).density);
  const Frame& f = bone.frame();
  double worst = 0, mean = 0;
  int n = 0;
  for (int k = 5; k < f.dims[2] - 5; k += 3)
    for (int j = 5; j < f.dims[1] - 5; j += 3)
      for (int i = 5; i < f.dims[0] - 5; i += 3) {
        double inside = 0;
        for (int s = 0; s < 1000; ++s) {
          inside += length(f.world_from_index(
                        {i + (s % 10 - 4.5) / 10, j + (s / 10 % 10 - 4.5) / 10, k + (s / 100 - 4.5) / 10})) < 20.3
                        ? 0.001
                        : 0;
        }
        const double e = std::abs(inside - static_cast<double>(bone.at(i, j, k)));
        worst = std::max(worst, e);
        mean += e;
        ++n;
      }
  EXPECT_LT(worst, 0.15);
  EXPECT_LT(mean / n, 0.005);
}

TEST(Resample, SameBytesForAnyThreadCount) {
  const Image ct = ball(2, 12);
  EXPECT_EQ(to_bricks(bone_of(ct, 0.5, 1).density).hash(), to_bricks(bone_of(ct, 0.5, 2).density).hash());
}

TEST(Resample, DroppedPiecesStayDropped) {
  // Two cubes; the mask keeps the larger one only.
  Frame f;
  f.dims = {30, 12, 12};
  const auto v = make_voxels<std::int16_t>(f.voxel_count());
  std::size_t at = 0;
  for (int k = 0; k < 12; ++k)
    for (int j = 0; j < 12; ++j)
      for (int i = 0; i < 30; ++i)
        v[at++] = (i > 2 && i < 11 && j > 1 && j < 10 && k > 1 && k < 10) ||
                          (i > 20 && i < 25 && j > 3 && j < 8 && k > 3 && k < 8)
                      ? 1000
                      : 0;
  const Image ct{f, v};
  ThresholdParams t;
  t.lower = 500;
  t.keep_largest = 1;
  ResampleParams r;
  r.lower = 500;
  const auto bone = to_bricks(resample_bone(ct, threshold(ct, t), r).density);
  const Vec3 in_small = bone.frame().index_from_world(f.world_from_index({22, 5, 5})),
             in_large = bone.frame().index_from_world(f.world_from_index({6, 5, 5}));
  EXPECT_EQ(bone.at(std::lround(in_small.x), std::lround(in_small.y), std::lround(in_small.z)), 0.0F);
  EXPECT_EQ(bone.at(std::lround(in_large.x), std::lround(in_large.y), std::lround(in_large.z)), 1.0F);
}

TEST(Resample, OnlyBoneIsStored) {
  PhantomParams p;
  p.region = PhantomRegion::temporal;
  p.spacing_mm = 2;
  const auto bone = bone_of(make_phantom(p).ct, 1);
  EXPECT_EQ(bone.hu.active_voxels, bone.density.active_voxels);
}

TEST(Resample, MaskElsewhereIsRefused) {
  const Image ct = ball(1, 10);
  Labels mask = threshold(ct, {});
  mask.frame.origin_mm.x += 1;
  EXPECT_THROW(static_cast<void>(resample_bone(ct, mask, {})), Error);
}

TEST(GridIo, VdbKeepsVoxelsAndObliqueFrame) {
  Frame f;
  f.dims = {20, 20, 20};
  f.spacing_mm = {0.5, 0.5, 0.5};
  f.origin_mm = {-3, 4, 5.5};
  const Vec3 u = normalized({1, 0.3, -0.2}), w = normalized(cross(u, {0, 1, 0.1}));
  f.direction = {{u, cross(w, u), w}};
  BrickGrid bricks(f, {{0, 0, 0}, {2, 1, 0}, {1, 2, 2}});
  for (VoxelKey v = 0; v < 3 * 512; v += 7) bricks.set(v, 0.001F * static_cast<float>(v % 997) + 0.001F);
  const auto path = std::filesystem::temp_directory_path() / ("osteo-grid-" + std::to_string(::getpid()) + ".vdb");
  save_grid(to_sparse(bricks, "density"), path);
  const BrickGrid back = to_bricks(load_grid(path));
  EXPECT_TRUE(same_place(back.frame(), f, 1e-6));
  for (VoxelKey v = 0; v < 3 * 512; ++v) {
    const Ijk c = bricks.coordinate(v);
    EXPECT_EQ(back.at(c.i, c.j, c.k), bricks.value(v));
  }
#ifndef __SANITIZE_ADDRESS__  // OpenVDB may then ask for an absurd amount of memory, which ends the program there
                              // instead of throwing
  std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
  EXPECT_THROW(static_cast<void>(load_grid(path)), Error);
#endif
}

TEST(BrickGrid, FindCoordinateAndBlocksAgree) {
  Frame f;
  f.dims = {32, 32, 32};
  BrickGrid g(f, {{3, 0, 1}, {0, 0, 0}, {2, 3, 3}});
  for (VoxelKey v = 0; v < 3 * 512; ++v) {
    const Ijk c = g.coordinate(v);
    EXPECT_EQ(g.find(c.i, c.j, c.k), v);
    g.set(v, static_cast<float>(v));
  }
  EXPECT_EQ(g.find(-1, 0, 0), BrickGrid::kNone);
  EXPECT_EQ(g.find(8, 0, 0), BrickGrid::kNone);
  EXPECT_EQ(g.find(0, 0, 99), BrickGrid::kNone);
  std::vector<float> block(13 * 11 * 12);
  g.read_block({-3, -2, 5}, {13, 11, 12}, block.data());
  std::size_t at = 0;
  for (int k = 5; k < 17; ++k)
    for (int j = -2; j < 9; ++j)
      for (int i = -3; i < 10; ++i) EXPECT_EQ(block[at++], g.at(i, j, k));
}

// What a case keeps of a patient is bone: no voxel is stored that does not touch bone, so no skin, and no face.
TEST(BrickGrid, DenseHoldsEachVoxelOfItsFrameAndNoBrickBeyond) {
  Frame f;
  f.dims = {16, 9, 1};
  const BrickGrid g = BrickGrid::dense(f);
  EXPECT_EQ(g.brick_count(), 4u);
  EXPECT_NE(g.find(15, 8, 0), BrickGrid::kNone);
  EXPECT_EQ(g.find_brick(2, 0, 0), BrickGrid::kNone);
  EXPECT_EQ(g.sum(), 0);
}

TEST(Resample, NothingButBoneIsKept) {
  PhantomParams p;
  p.spacing_mm = 2;
  const Phantom phantom = make_phantom(p);
  ThresholdParams t;
  t.lower = 500;
  const Labels mask = threshold(phantom.ct, t);
  const ResampledBone bone = resample_bone(phantom.ct, mask, {});
  EXPECT_EQ(bone.hu.active_voxels, bone.density.active_voxels);
  // Skin: soft tissue with air beside it. The phantom's head has a whole coat of it.
  const Frame& f = phantom.ct.frame;
  const GridSampler hu(bone.hu);
  std::size_t skin = 0, kept = 0, near = 0;
  for (int k = 1; k + 1 < f.dims[2]; ++k)
    for (int j = 1; j + 1 < f.dims[1]; ++j)
      for (int i = 1; i + 1 < f.dims[0]; ++i) {
        bool air = false, is_bone = false;
        for (int n = 0; n < 27; ++n) {
          const int x = i + n % 3 - 1, y = j + n / 3 % 3 - 1, z = k + n / 9 - 1;
          air = air || phantom.ct.at(x, y, z) < -500;
          // A thin wall of a sinus may be bone between voxels below the threshold.
          is_bone = is_bone || mask.at(x, y, z) != 0 || osteo::is_bone(static_cast<Tissue>(phantom.labels.at(x, y, z)));
        }
        if (!air || phantom.ct.at(i, j, k) < -300) continue;
        ++skin;
        const bool stored = hu.nearest(f.world_from_index({double(i), double(j), double(k)})) > -1024;
        kept += stored && !is_bone;
        near += is_bone;
      }
  EXPECT_GT(skin, 5000u);
  EXPECT_EQ(kept, 0u);
  EXPECT_LT(near, skin / 2);
}

// A wall of 0.8 mm, oblique in voxels of 1 mm: it never reaches its own value there. With the threshold for thin bone,
// the grid keeps it whole: every line across it meets bone.
TEST(Resample, WallThinnerThanAVoxelStaysWhole) {
  Frame f;
  f.dims = {50, 50, 50};
  f.origin_mm = {-24.5, -24.5, -24.5};
  const Vec3 n = normalized({0.4, 0.25, 1});
  const auto v = make_voxels<std::int16_t>(f.voxel_count());
  std::size_t at = 0;
  for (int k = 0; k < 50; ++k)
    for (int j = 0; j < 50; ++j)
      for (int i = 0; i < 50; ++i) {
        // Blurred as a scanner of this voxel size blurs: a normal distribution of 0.55 mm.
        const double d = dot(f.world_from_index({double(i), double(j), double(k)}), n), s = 0.55 * std::sqrt(2.0);
        const double share = 0.5 * (std::erf((d + 0.4) / s) - std::erf((d - 0.4) / s));
        v[at++] = static_cast<std::int16_t>(std::lround(40 + 1160 * share));
      }
  const Image ct{f, v};
  EXPECT_LT(*std::max_element(ct.span().begin(), ct.span().end()), 700);  // the wall itself has 1200 HU
  ThresholdParams t;
  t.lower = 40 + 0.2 * 1160;
  const ResampledBone bone = resample_bone(ct, threshold(ct, t), {});
  const GridSampler density(bone.density);
  const Vec3 u = any_perpendicular(n), w = cross(n, u);
  int lines = 0, broken = 0;
  for (double a = -15; a <= 15; a += 0.37)
    for (double b = -15; b <= 15; b += 0.37) {
      float best = 0;
      for (double c = -1; c <= 1; c += 0.1) best = std::max(best, density.nearest(u * a + w * b + n * c));
      ++lines;
      broken += best < 0.5F;
    }
  EXPECT_GT(lines, 5000);
  EXPECT_EQ(broken, 0);
  // Partial volume makes it thicker than it is, by less than a voxel of the CT.
  const double area = bone.volume_after_mm3 / 50 / 50 * std::abs(n.z);
  EXPECT_GT(area, 0.8);
  EXPECT_LT(area, 1.8);
}

// Half the space below a plane, in slices of `z` mm that are as thick as they lie apart.
Image below_a_plane(Vec3 n, double z) {
  Frame f;
  f.spacing_mm = {0.8, 0.8, z};
  f.dims = {50, 50, static_cast<int>(40 / z)};
  f.origin_mm = {-19.7, -19.6, -19.6};
  const auto v = make_voxels<std::int16_t>(f.voxel_count());
  std::size_t at = 0;
  for (int k = 0; k < f.dims[2]; ++k)
    for (int j = 0; j < f.dims[1]; ++j)
      for (int i = 0; i < f.dims[0]; ++i) {
        double share = 0;
        for (int s = 0; s < 16; ++s) {
          const double d = -dot(f.world_from_index({double(i), double(j), k + (s + 0.5) / 16 - 0.5}), n);
          share += 0.5 * (1 + std::erf(d / (0.5 * std::sqrt(2.0)))) / 16;
        }
        v[at++] = static_cast<std::int16_t>(std::lround(1000 * share));
      }
  return {f, v};
}

// How far the half-full density lies from the plane, along lines across it: a terrace swings about it.
double terrace_mm(const SparseGrid& bone, Vec3 n) {
  const GridSampler density(bone);
  const Vec3 u = any_perpendicular(n), w = cross(n, u);
  double sum = 0;
  int lines = 0;
  for (double a = -10; a <= 10; a += 0.43)
    for (double b = -10; b <= 10; b += 0.43, ++lines) {
      double filled = 0;  // length of bone along the line, from 4 mm within
      for (double c = -4; c < 4; c += 0.05)
        filled += 0.05 * static_cast<double>(density.nearest(u * a + w * b + n * c));
      sum += std::abs(filled - 4);
    }
  return sum / lines;
}

TEST(Resample, OutlinesMakeNoTerraces) {
  for (const double degrees : {25.0, 45.0, 65.0}) {
    const double a = degrees * M_PI / 180;
    const Vec3 n = normalized({std::sin(a), 0.1, std::cos(a)});
    for (const double z : {2.0, 4.0}) {
      const Image ct = below_a_plane(n, z);
      ThresholdParams t;
      t.lower = 500;
      const Labels mask = threshold(ct, t);
      const auto by = [&](Between between) {
        ResampleParams p;
        p.lower = 500;
        p.between = between;
        return resample_bone(ct, mask, p);
      };
      const double values = terrace_mm(by(Between::values).density, n),
                   outlines = terrace_mm(by(Between::outlines).density, n);
      EXPECT_LT(outlines, std::max(0.6 * values, 0.05)) << degrees << " degrees, slices of " << z;
      EXPECT_LT(outlines, 0.1) << degrees << " degrees, slices of " << z;
      EXPECT_EQ(to_bricks(by(Between::automatic).density).hash(), to_bricks(by(Between::outlines).density).hash());
    }
  }
}

TEST(Resample, OutlinesOfEvenVoxelsAreOffByDefault) {
  const Image ct = ball(1, 12);
  ThresholdParams t;
  t.lower = 500;
  const Labels mask = threshold(ct, t);
  const auto by = [&](Between between) {
    return to_bricks(resample_bone(ct, mask, {.lower = 500, .between = between}).density).hash();
  };
  EXPECT_EQ(by(Between::automatic), by(Between::values));
  EXPECT_NE(by(Between::automatic), by(Between::outlines));
}

// A body that ends level with the slices: its end lies where partial volume has it, not a slice off.
TEST(Resample, OutlinesLeaveLevelEndsWhereTheyAre) {
  const Vec3 level{0, 0, 1};
  for (const double z : {2.0, 3.0}) {
    const Image ct = below_a_plane(level, z);
    ThresholdParams t;
    t.lower = 500;
    const Labels mask = threshold(ct, t);
    ResampleParams p;
    p.lower = 500;
    p.between = Between::values;
    const double values = resample_bone(ct, mask, p).volume_after_mm3;
    p.between = Between::outlines;
    EXPECT_NEAR(resample_bone(ct, mask, p).volume_after_mm3, values, 1e-6 * values) << z;
  }
}

// Whatever axis the slices are stacked along.
TEST(Resample, OutlinesOfSlicesAlongAnyAxis) {
  const Vec3 n = normalized({0.7, 0.1, 0.7});
  const Image ct = below_a_plane(n, 3);
  Image turned;
  turned.frame = ct.frame;
  for (std::size_t a = 0; a < 3; ++a) {
    turned.frame.dims[a] = ct.frame.dims[(a + 2) % 3];
    turned.frame.spacing_mm[a] = ct.frame.spacing_mm[(a + 2) % 3];
    turned.frame.direction.column[a] = ct.frame.direction.column[(a + 2) % 3];
  }
  const auto v = make_voxels<std::int16_t>(ct.frame.voxel_count());
  turned.voxels = v;
  for (int k = 0; k < ct.frame.dims[2]; ++k)
    for (int j = 0; j < ct.frame.dims[1]; ++j)
      for (int i = 0; i < ct.frame.dims[0]; ++i) v[turned.offset(k, i, j)] = ct.at(i, j, k);
  ThresholdParams t;
  t.lower = 500;
  const auto by = [&](const Image& image) { return resample_bone(image, threshold(image, t), {.lower = 500}).density; };
  EXPECT_NEAR(terrace_mm(by(turned), n), terrace_mm(by(ct), n), 1e-3);
}

TEST(Resample, FindsTheThresholdOfTheMask) {
  const Image ct = ball(1, 20.3);
  for (const double lower : {350.0, 500.0, 720.0}) {
    ThresholdParams t;
    t.lower = lower;
    Context c;
    const ResampledBone given = resample_bone(ct, threshold(ct, t), {.spacing_mm = 0.5, .lower = lower});
    const ResampledBone found = resample_bone(ct, threshold(ct, t), {.spacing_mm = 0.5}, c);
    double lower_hu = 0;
    for (const auto& [key, value] : c.take_report()) {
      if (key == "lower_hu") lower_hu = std::get<double>(value);
    }
    EXPECT_NEAR(lower_hu, lower, 12);  // the ball's values are not dense
    EXPECT_NEAR(found.volume_after_mm3, given.volume_after_mm3, 0.002 * given.volume_after_mm3);
  }
}

// Straight to sparse: the same ball through DICOM, tilted by 20 degrees and unevenly spaced.
TEST(ImportBone, TiltedUnevenBallKeepsItsShape) {
  const TemporaryFolder folder;
  // Slices of the ball where a tilted scanner would have put them.
  const double radius = 20.3, shear = std::tan(20 * M_PI / 180);
  std::vector<double> z;
  for (double at = -26; at < 26; at += z.size() % 2 == 0 ? 0.8 : 1.3) z.push_back(at);
  for (std::size_t k = 0; k < z.size(); ++k) {
    Frame f;
    f.dims = {64, 64, 1};
    f.spacing_mm = {1, 1, 1};
    f.origin_mm = {-31.6, -31.3 + shear * z[k], z[k]};
    const auto v = make_voxels<std::int16_t>(f.voxel_count());
    for (int j = 0; j < 64; ++j)
      for (int i = 0; i < 64; ++i) {
        const double d = radius - length(f.world_from_index({double(i), double(j), 0}));
        v[static_cast<std::size_t>(j) * 64 + static_cast<std::size_t>(i)] =
            static_cast<std::int16_t>(std::lround(500 + 500 * std::tanh(d / 1.5)));
      }
    save_dicom_series({f, v}, folder.path() / ("s" + std::to_string(k)));
  }
  // Each folder is a series of its own: one UID for all.
  DicomScan scan = scan_dicom(folder.path());
  DicomSeries series = scan.series.front();
  series.headers.clear();
  for (auto& s : scan.series) series.headers.insert(series.headers.end(), s.headers.begin(), s.headers.end());
  ASSERT_EQ(series.headers.size(), z.size());
  // A ball of 1000 in 0 looks like a scan without its offset.
  DicomSlabs slabs(series, {.any_modality = true}, 0.5);
  EXPECT_NEAR(slabs.verdict().tilt_deg, 20, 0.01);
  double volume = 0, off = 0;
  std::size_t edge = 0;
  slabs.run(8, {}, [&](int first, int layers, const std::int16_t* hu) {
    const Frame& f = slabs.frame();
    for (int k = 0; k < layers; ++k)
      for (int j = 0; j < f.dims[1]; ++j)
        for (int i = 0; i < f.dims[0]; ++i, ++hu) {
          if (*hu == DicomSlabs::kNoValue) continue;
          volume += *hu >= 500 ? f.voxel_volume_mm3() : 0;
          if (*hu < 300 || *hu > 700) continue;
          // Near the edge the value tells how deep the point lies.
          const double depth = 1.5 * std::atanh((*hu - 500) / 500.0);
          off += std::abs(depth - (radius - length(f.world_from_index({double(i), double(j), double(first + k)}))));
          ++edge;
        }
  });
  EXPECT_NEAR(volume / (4.0 / 3 * M_PI * radius * radius * radius), 1, 0.01);
  EXPECT_LT(off / static_cast<double>(edge), 0.06);
}

}  // namespace
}  // namespace osteo
