#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "osteo/base/error.h"
#include "osteo/base/files.h"
#include "osteo/image/phantom.h"
#include "osteo/io/dicom.h"
#include "osteo/io/import.h"
#include "osteo/io/surface_io.h"
#include "osteo/io/volume_io.h"

namespace osteo {
namespace {

fs::path folder() {
  static const fs::path p = [] {
    const auto f = fs::temp_directory_path() / ("osteo-io-" + std::to_string(::getpid()));
    fs::remove_all(f);
    fs::create_directories(f);
    return f;
  }();
  return p;
}

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

class EveryFormat : public testing::TestWithParam<const char*> {};

TEST_P(EveryFormat, ObliqueFrameAndVoxelsSurvive) {
  for (const bool left_handed : {false, true}) {
    SCOPED_TRACE(left_handed ? "left-handed" : "right-handed");
    const Image image = oblique(left_handed);
    const auto path = folder() / (std::string("oblique") + (left_handed ? "l" : "r") + GetParam());
    save_image(image, path);
    expect_same_world(image, load_image(path));
  }
}

TEST_P(EveryFormat, SameVolumeSameBytes) {
  const auto a = folder() / (std::string("a") + GetParam()), b = folder() / (std::string("b") + GetParam());
  save_image(oblique(false), a);
  save_image(oblique(false), b);
  EXPECT_EQ(hash_path(a), hash_path(b));
}

TEST_P(EveryFormat, LeftStaysLeft) {
  PhantomParams p;
  p.spacing_mm = 4;
  p.noise_hu = 0;
  const Image ct = make_phantom(p).ct;
  const auto path = folder() / (std::string("head") + GetParam());
  save_image(ct, path);
  const Image back = load_image(path);
  double left = 0, right = 0;
  for (int k = 0; k < back.frame.dims[2]; ++k)
    for (int j = 0; j < back.frame.dims[1]; ++j)
      for (int i = 0; i < back.frame.dims[0]; ++i) {
        if (back.at(i, j, k) > 1500) (back.frame.world_from_index({double(i), double(j), double(k)}).x > 0 ? left : right) += 1;
      }
  EXPECT_GT(left, 0);
  EXPECT_EQ(right, 0);
}

TEST_P(EveryFormat, CutFileIsRefusedByName) {
  const auto whole = folder() / (std::string("whole") + GetParam()), cut = folder() / (std::string("cut") + GetParam());
  PhantomParams p;
  p.region = PhantomRegion::temporal;
  p.spacing_mm = 3;
  save_image(make_phantom(p).ct, whole);
  const std::string text = read_text(whole);
  for (const double share : {0.0, 0.02, 0.5, 0.95}) {
    std::ofstream(cut, std::ios::binary) << text.substr(0, static_cast<std::size_t>(share * static_cast<double>(text.size())));
    try {
      static_cast<void>(load_image(cut));
      FAIL() << "a file cut to " << share << " was read";
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::corrupt) << e.what();
      EXPECT_NE(std::string(e.what()).find(cut.filename().string()), std::string::npos) << e.what();
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Io, EveryFormat, testing::Values(".nrrd", ".nii", ".nii.gz", ".mha", ".vti"), [](const auto& test) {
  std::string n = test.param;
  std::erase(n, '.');
  return n;
});

TEST(Nrrd, RasBigEndianRawIsReadRight) {
  const auto path = folder() / "ras.nrrd";
  std::ofstream out(path, std::ios::binary);
  out << "NRRD0005\n# by hand\ntype: short\ndimension: 3\nspace: right-anterior-superior\nsizes: 2 1 1\n"
         "space directions: (2,0,0) (0,3,0) (0,0,4)\nkinds: domain domain domain\nendian: big\nencoding: raw\nspace origin: (10,20,30)\n\n";
  out.write("\x01\x02\xff\xfe", 4);
  out.close();
  const Image image = load_image(path);
  EXPECT_EQ(image.at(0, 0, 0), 0x0102);
  EXPECT_EQ(image.at(1, 0, 0), -2);
  EXPECT_EQ(image.frame.world_from_index({1, 0, 0}), (Vec3{-12, -20, 30}));
  EXPECT_EQ(orientation_code(image.frame), "RAS");
}

TEST(Nrrd, ShearIsRefused) {
  const auto path = folder() / "shear.nrrd";
  std::ofstream(path, std::ios::binary) << "NRRD0004\ntype: uchar\ndimension: 3\nspace: left-posterior-superior\nsizes: 1 1 1\n"
                                           "space directions: (1,0,0) (0,1,0) (0,0.3,1)\nencoding: raw\nspace origin: (0,0,0)\n\nx";
  EXPECT_THROW(static_cast<void>(load_labels(path)), Error);
}

TEST(Labels, CtIsNotTakenForLabels) {
  const auto path = folder() / "ct.nrrd";
  save_image(oblique(false), path);
  EXPECT_THROW(static_cast<void>(load_labels(path)), Error);
}

TEST(Dicom, SeriesComesBackToTheVoxel) {
  const auto path = folder() / "series";
  const Image image = oblique(false);
  save_dicom_series(image, path);
  const auto series = scan_dicom(path);
  ASSERT_EQ(series.size(), 1u);
  EXPECT_TRUE(series[0].recommended);
  const Image back = load_dicom_series(series[0], 8);
  expect_same_world(image, back);
}

TEST(Dicom, LeftHandedVolumeKeepsItsPlace) {
  const auto path = folder() / "series-left-handed";
  const Image image = oblique(true);
  save_dicom_series(image, path);
  expect_same_world(image, load_dicom_series(scan_dicom(path)[0], 8));
}

TEST(Dicom, MissingSliceIsInterpolatedOrRefused) {
  PhantomParams p;
  p.region = PhantomRegion::temporal;
  p.spacing_mm = 2;
  const auto path = folder() / "gap";
  const Image ct = make_phantom(p).ct;
  save_dicom_series(ct, path);
  std::vector<fs::path> files(fs::directory_iterator(path), {});
  std::sort(files.begin(), files.end());
  fs::remove(files[10]);
  const auto series = scan_dicom(path)[0];
  try {
    static_cast<void>(load_dicom_series(series, 3));
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::failed);
    EXPECT_NE(std::string(e.what()).find("gap of 4 mm"), std::string::npos) << e.what();
  }
  // Interpolated: every slice that is there keeps its place.
  const Image back = load_dicom_series(series, 8);
  double worst = 0;
  for (int k = 0; k < ct.frame.dims[2]; ++k) {
    if (k == 10) continue;
    const Vec3 x = back.frame.index_from_world(ct.frame.world_from_index({20, 20, double(k)}));
    const int z = static_cast<int>(std::lround(x.z));
    if (std::abs(x.z - z) > 1e-3 || z >= back.frame.dims[2]) continue;
    worst = std::max(worst, std::abs(double(back.at(20, 20, z)) - double(ct.at(20, 20, k))));
  }
  EXPECT_LE(worst, 1);
}

TEST(Dicom, DuplicateAndForeignSlicesAreRefusedByName) {
  PhantomParams p;
  p.region = PhantomRegion::temporal;
  p.spacing_mm = 4;
  const auto path = folder() / "dup";
  save_dicom_series(make_phantom(p).ct, path);
  auto series = scan_dicom(path)[0];
  auto twice = series;
  twice.files.push_back(series.files[3]);
  EXPECT_THROW(static_cast<void>(load_dicom_series(twice, 8)), Error);
  const auto other = folder() / "other";
  p.spacing_mm = 3;
  save_dicom_series(make_phantom(p).ct, other);
  series.files.push_back(scan_dicom(other)[0].files[2]);
  try {
    static_cast<void>(load_dicom_series(series, 8));
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("pixels"), std::string::npos) << e.what();
  }
}

TEST(Dicom, CutFileIsRefusedByName) {
  PhantomParams p;
  p.region = PhantomRegion::temporal;
  p.spacing_mm = 4;
  const auto path = folder() / "cutslice";
  save_dicom_series(make_phantom(p).ct, path);
  const auto series = scan_dicom(path)[0];
  fs::resize_file(series.files[5], fs::file_size(series.files[5]) / 2);
  try {
    static_cast<void>(load_dicom_series(series, 8));
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::corrupt);
    EXPECT_NE(std::string(e.what()).find(series.files[5].filename().string()), std::string::npos) << e.what();
  }
}

TEST(Import, AxesOverrideTurnsAVolumeAboutItsCentre) {
  const auto path = folder() / "axes.nrrd";
  PhantomParams p;
  p.region = PhantomRegion::temporal;
  p.spacing_mm = 4;
  const Image ct = make_phantom(p).ct;
  save_image(ct, path);
  ImportParams params;
  params.axes = "LPI";
  const Image turned = import_ct(path, params);
  EXPECT_EQ(orientation_code(turned.frame), "LPI");
  EXPECT_LT(length(turned.frame.centre_mm() - ct.frame.centre_mm()), 1e-9);
  params.axes = "LLS";
  EXPECT_THROW(static_cast<void>(import_ct(path, params)), Error);
}

TEST(Surface, FormatsKeepPointsAndTriangles) {
  TriMesh mesh;
  mesh.points_mm = {{-1.5F, 2, 3}, {4, 5.25F, 6}, {7, 8, 9.125F}, {0, 0, 1}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  for (const char* suffix : {".ply", ".stl", ".obj", ".vtp"}) {
    const auto path = folder() / (std::string("mesh") + suffix);
    save_surface(mesh, path);
    const auto back = load_surface(path);
    EXPECT_EQ(back->triangles.size(), 2u) << suffix;
    EXPECT_NEAR(area_mm2(*back), area_mm2(mesh), 1e-4) << suffix;
  }
}

// Real series: the position of every slice against its own header.
TEST(RealDicom, TiltedUnevenHeadIsPlacedByPosition) {
  const fs::path data = fs::path(OSTEO_SHARED_DATA) / "dicom_ct_head_tilt_gaps";
  if (!fs::exists(data)) GTEST_SKIP() << "no " << data;
  const Image image = import_ct(data, {});
  EXPECT_EQ(image.frame.dims[0], 512);
  EXPECT_GT(image.frame.dims[1], 600);  // the lean needs more rows than a slice has
  EXPECT_NEAR(length(image.frame.world_from_index({0, 0, image.frame.dims[2] - 1.0}) - image.frame.origin_mm), 144.1, 1.0);
}

TEST(RealDicom, StraightPhantomSeriesIsTakenVoxelForVoxel) {
  const fs::path data = fs::path(OSTEO_SHARED_DATA) / "dicom_ct_skull_phantom" / "S21570";
  if (!fs::exists(data)) GTEST_SKIP() << "no " << data;
  const auto all = scan_dicom(data);
  const auto best = std::find_if(all.begin(), all.end(), [](const auto& s) { return s.recommended; });
  ASSERT_NE(best, all.end());
  EXPECT_EQ(best->images, 140);
  Context context;
  const Image image = import_ct(data, {}, context);
  EXPECT_EQ(image.frame.dims, (std::array<int, 3>{512, 512, 140}));
  EXPECT_NEAR(image.frame.spacing_mm.x, 0.4512, 1e-4);
  EXPECT_NEAR(image.frame.spacing_mm.z, 1.0, 1e-6);
  const auto [lo, hi] = std::minmax_element(image.span().begin(), image.span().end());
  EXPECT_EQ(*lo, -1024);
  EXPECT_EQ(*hi, 3071);
  for (const auto& s : all) {
    EXPECT_EQ(s.usable && s.what == "localizer", false);
  }
}

}  // namespace
}  // namespace osteo
