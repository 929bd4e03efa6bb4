#include <cmath>

#include "edit.h"
#include "osteo/base/error.h"
#include "osteo/dicom/import.h"
#include "osteo/dicom/volume.h"
#include "osteo/io/volume_io.h"

namespace osteo {
namespace {

using test::data;
using test::put;
using test::scratch;
using test::Series;
using test::straight_series;

// An oblique frame of unequal spacing; every voxel differs from its neighbours.
Image oblique(bool left_handed) {
  Frame f;
  f.dims = {7, 5, 4};
  f.spacing_mm = {0.7, 0.9, 2.5};
  f.origin_mm = {-31.5, 12.25, 107};
  const Vec3 u = normalized({1, 0.2, -0.1}), w = normalized(cross(u, {0.05, 1, 0.3}));
  f.direction = {{u, cross(w, u), left_handed ? w * -1 : w}};
  const auto v = make_voxels<std::int16_t>(f.voxel_count());
  for (std::size_t i = 0; i < f.voxel_count(); ++i) v[i] = static_cast<std::int16_t>(static_cast<int>(i) * 23 - 1024);
  return {f, v};
}

// The value at a world point must survive, however the file orders its voxels.
void expect_same_world(const Image& a, const Image& b) {
  ASSERT_EQ(a.frame.voxel_count(), b.frame.voxel_count());
  for (int k = 0; k < a.frame.dims[2]; ++k)
    for (int j = 0; j < a.frame.dims[1]; ++j)
      for (int i = 0; i < a.frame.dims[0]; ++i) {
        const Vec3 x = b.frame.index_from_world(a.frame.world_from_index({double(i), double(j), double(k)}));
        const int p = static_cast<int>(std::lround(x.x)), q = static_cast<int>(std::lround(x.y)), r = static_cast<int>(std::lround(x.z));
        ASSERT_NEAR(length(x - Vec3{double(p), double(q), double(r)}), 0, 2e-3);
        ASSERT_TRUE(p >= 0 && q >= 0 && r >= 0 && p < b.frame.dims[0] && q < b.frame.dims[1] && r < b.frame.dims[2]);
        ASSERT_EQ(a.at(i, j, k), b.at(p, q, r));
      }
}

TEST(Dicom, SeriesComesBackToTheVoxel) {
  for (const bool left_handed : {false, true}) {
    const auto path = scratch(left_handed ? "left" : "right") / "series";
    const Image image = oblique(left_handed);
    save_dicom_series(image, path);
    const DicomScan scan = scan_dicom(path);
    ASSERT_EQ(scan.series.size(), 1u);
    EXPECT_TRUE(scan.series[0].recommended);
    expect_same_world(image, load_dicom_series(scan.series[0]).image);
  }
}

TEST(Import, AxesOverrideTurnsAVolumeAboutItsCentre) {
  const auto path = scratch("axes") / "axes.nrrd";
  PhantomParams p;
  p.region = PhantomRegion::temporal;
  p.spacing_mm = 4;
  const Image ct = make_phantom(p).ct;
  save_image(ct, path);
  ImportParams params;
  params.axes = "LPI";
  const Image turned = import_ct(path, params).image;
  EXPECT_EQ(orientation_code(turned.frame), "LPI");
  EXPECT_LT(length(turned.frame.centre_mm() - ct.frame.centre_mm()), 1e-9);
  params.axes = "LLS";
  EXPECT_THROW(static_cast<void>(import_ct(path, params)), Error);
}

TEST(RealDicom, StraightPhantomSeriesIsTakenVoxelForVoxel) {
  const fs::path source = data("dicom_ct_skull_phantom") / "S21570";
  if (!fs::exists(source)) GTEST_SKIP() << "no " << source;
  const DicomScan scan = scan_dicom(source);
  const DicomSeries& best = choose_series(scan, "", "here");
  EXPECT_EQ(best.images, 140);
  const Imported r = import_ct(source, {});
  EXPECT_EQ(r.verdict.status(), "good");
  EXPECT_EQ(r.image.frame.dims, (std::array<int, 3>{512, 512, 140}));
  EXPECT_NEAR(r.image.frame.spacing_mm.x, 0.4512, 1e-4);
  EXPECT_NEAR(r.image.frame.spacing_mm.z, 1.0, 1e-6);
  const auto [lo, hi] = std::minmax_element(r.image.span().begin(), r.image.span().end());
  EXPECT_EQ(*lo, -1024);
  EXPECT_EQ(*hi, 3071);
  for (const auto& s : scan.series) EXPECT_FALSE(s.usable && s.what == "localizer");
}

}  // namespace
}  // namespace osteo
