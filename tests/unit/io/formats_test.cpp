#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "oblique.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/image/phantom.h"
#include "osteo/imaging/io/surface_io.h"
#include "osteo/imaging/io/tet_io.h"
#include "osteo/imaging/io/volume_io.h"

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

using test::expect_same_world;
using test::oblique;

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
        if (back.at(i, j, k) > 1500)
          (back.frame.world_from_index({double(i), double(j), double(k)}).x > 0 ? left : right) += 1;
      }
  EXPECT_GT(left, 0);
  EXPECT_EQ(right, 0);
}

// Larger than what is packed at once, of stretches that pack well, hardly and not at all, with a rest at the end.
TEST_P(EveryFormat, PackedInManyPiecesIsOneVolume) {
  Image image;
  image.frame.dims = {129, 127, 45};
  const std::size_t count = image.frame.voxel_count();
  const auto voxels = make_voxels<std::int16_t>(count);
  std::uint32_t state = 1;
  for (std::size_t i = 0; i < count; ++i) {
    state = state * 1664525U + 1013904223U;
    const auto noise = static_cast<std::int16_t>(state >> 16);
    voxels[i] = i < 200'000   ? std::int16_t{-1000}
                : i < 400'000 ? noise
                : i < 600'000 ? static_cast<std::int16_t>(noise & 31)
                              : static_cast<std::int16_t>(i % 3000);
  }
  image.voxels = voxels;
  const auto path = folder() / (std::string("pieces") + GetParam());
  save_image(image, path);
  const Image back = load_image(path);
  ASSERT_EQ(back.frame.dims, image.frame.dims);
  EXPECT_TRUE(std::equal(back.span().begin(), back.span().end(), image.span().begin()));
}

TEST_P(EveryFormat, CutFileIsRefusedByName) {
  const auto whole = folder() / (std::string("whole") + GetParam()), cut = folder() / (std::string("cut") + GetParam());
  PhantomParams p;
  p.region = PhantomRegion::temporal;
  p.spacing_mm = 3;
  save_image(make_phantom(p).ct, whole);
  const std::string text = read_text(whole);
  for (const double share : {0.0, 0.02, 0.5, 0.95}) {
    std::ofstream(cut, std::ios::binary) << text.substr(
        0, static_cast<std::size_t>(share * static_cast<double>(text.size())));
    try {
      static_cast<void>(load_image(cut));
      FAIL() << "a file cut to " << share << " was read";
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ExitCode::corrupt) << e.what();
      EXPECT_NE(std::string(e.what()).find(cut.filename().string()), std::string::npos) << e.what();
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Io, EveryFormat, testing::Values(".nrrd", ".nii", ".nii.gz", ".mha", ".vti"),
                         [](const auto& test) {
                           std::string n = test.param;
                           std::erase(n, '.');
                           return n;
                         });

// Files of others: packed by zlib, whole or in its own wrapping.
TEST(Nrrd, PackedByOthersIsReadAlike) {
  const std::string header =
      "NRRD0004\ntype: uint8\ndimension: 3\nspace: LPS\nsizes: 2 2 1\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n"
      "encoding: gzip\n\n";
  // Of the bytes 1, 2, 3, 40: a stored block, in gzip's wrapping and in zlib's.
  const std::string block("\x01\x04\x00\xfb\xff\x01\x02\x03\x28", 9);
  const std::string gzip = std::string("\x1f\x8b\x08\0\0\0\0\0\0\x03", 10) + block +
                           std::string("\x2e\x97\xe4\x84", 4) + std::string("\x04\0\0\0", 4);
  const std::string zlib = "\x78\x01" + block + std::string("\x00\x3c\x00\x2f", 4);
  for (const std::string& packed : {gzip, zlib}) {
    write_file(folder() / "others.nrrd", header + packed);
    const Image image = load_image(folder() / "others.nrrd");
    for (int i = 0; i < 4; ++i) EXPECT_EQ(image.voxels[static_cast<std::size_t>(i)], i < 3 ? i + 1 : 40);
  }
}

TEST(Nrrd, RasBigEndianRawIsReadRight) {
  const auto path = folder() / "ras.nrrd";
  std::ofstream out(path, std::ios::binary);
  out << "NRRD0005\n# by hand\ntype: short\ndimension: 3\nspace: right-anterior-superior\nsizes: 2 1 1\n"
         "space directions: (2,0,0) (0,3,0) (0,0,4)\nkinds: domain domain domain\nendian: big\nencoding: raw\nspace "
         "origin: (10,20,30)\n\n";
  out.write("\x01\x02\xff\xfe", 4);
  out.close();
  const Image image = load_image(path);
  EXPECT_EQ(image.at(0, 0, 0), 0x0102);
  EXPECT_EQ(image.at(1, 0, 0), -2);
  EXPECT_EQ(image.frame.world_from_index({1, 0, 0}), (Vec3{-12, -20, 30}));
  EXPECT_EQ(orientation_code(image.frame), "RAS");
}

// A header apart from its voxels, which lie in one file a slice, or two slices a file: listed by name, or by a pattern.
TEST(Nrrd, SeveralDataFilesAreReadInTheirOrder) {
  const fs::path at = folder() / "several";
  fs::create_directories(at);
  const auto file = [&](const std::string& name, int first, int count) {
    std::string bytes;
    for (int i = 0; i < count; ++i) bytes += {static_cast<char>(first + i), '\0'};
    write_file(at / name, bytes);
  };
  const auto header = [&](const std::string& rest) {
    write_file(
        at / "v.nhdr",
        "NRRD0004\ntype: short\ndimension: 3\nsizes: 3 2 4\nspacings: 1 1 2\nendian: little\nencoding: raw\n" + rest);
    return at / "v.nhdr";
  };
  const auto expect_in_order = [&](const fs::path& path) {
    const Image image = load_image(path);
    for (int i = 0; i < 24; ++i) EXPECT_EQ(image.voxels[static_cast<std::size_t>(i)], i);
  };
  const auto expect_refused = [&](const fs::path& path, const std::string& said) {
    try {
      static_cast<void>(load_image(path));
      ADD_FAILURE() << said;
    } catch (const Error& e) {
      EXPECT_NE(std::string(e.what()).find(said), std::string::npos) << e.what();
    }
  };
  for (int k = 0; k < 4; ++k) file("s" + std::to_string(10 - k) + ".raw", 6 * k, 6);
  expect_in_order(header("data file: LIST\ns10.raw\ns9.raw\ns8.raw\ns7.raw\n"));
  expect_in_order(header("data file: s%d.raw 10 7 -1\n"));
  for (int k = 0; k < 2; ++k) file("pair-00" + std::to_string(3 + 2 * k) + ".raw", 12 * k, 12);
  expect_in_order(header("data file: pair-%03d.raw 3 5 2 3\n"));
  expect_in_order(header("data file: LIST 3\npair-003.raw\npair-005.raw\n"));
  expect_refused(header("data file: LIST\ns10.raw\ns9.raw\ns8.raw\n"), "s10.raw");  // eight voxels each are wanted
  expect_refused(header("data file: LIST\ns10.raw\ns9.raw\ns8.raw\nnone.raw\n"), "none.raw");
  expect_refused(header("data file: LIST\n"), "empty");
  expect_refused(header("data file: s%s.raw 1 4 1\n"), "are not like");
  expect_refused(header("data file: s%d.raw 1 4 0\n"), "are not like");
  expect_refused(header("byte skip: 4\ndata file: s%d.raw 7 10 1\n"), "byte skip");
}

TEST(Nrrd, ShearIsRefused) {
  const auto path = folder() / "shear.nrrd";
  std::ofstream(path, std::ios::binary)
      << "NRRD0004\ntype: uchar\ndimension: 3\nspace: left-posterior-superior\nsizes: 1 1 1\n"
         "space directions: (1,0,0) (0,1,0) (0,0.3,1)\nencoding: raw\nspace origin: (0,0,0)\n\nx";
  EXPECT_THROW(static_cast<void>(load_labels(path)), Error);
}

TEST(Labels, CtIsNotTakenForLabels) {
  const auto path = folder() / "ct.nrrd";
  save_image(oblique(false), path);
  EXPECT_THROW(static_cast<void>(load_labels(path)), Error);
}

// A .ply of our own is read without VTK: as VTK reads it, which a second comment makes it do.
TEST(Surface, OwnPlyIsReadAsByVtk) {
  TriMesh mesh;
  mesh.points_mm = {{-1.5F, 2, 3}, {4, 5.25F, 6}, {7, 8, 9.125F}, {0, 0, 1}};
  mesh.triangles = {{0, 1, 2}, {3, 2, 0}};
  for (const bool normals : {false, true}) {
    if (normals) mesh.normals.assign(4, {0, 0, 1});
    const auto own = folder() / "own.ply", other = folder() / "other.ply";
    save_surface(mesh, own);
    const std::string text = read_text(own);
    std::string changed = text;
    changed.insert(changed.find("comment"), "comment another line\n");
    write_file(other, changed);
    for (const auto& path : {own, other}) {
      const auto back = load_surface(path);
      EXPECT_EQ(back->points_mm, mesh.points_mm) << path;
      EXPECT_EQ(back->triangles, mesh.triangles) << path;
      EXPECT_TRUE(back->normals.empty()) << path;
    }
    write_file(own, text.substr(0, text.size() - 5));
    EXPECT_THROW(static_cast<void>(load_surface(own)), Error);
    std::string beyond = text;
    beyond[text.size() - 2] = 1;  // the last triangle names a point that is not there
    write_file(own, beyond);
    EXPECT_THROW(static_cast<void>(load_surface(own)), Error);
  }
}

// The header is VTK's, what follows ours; packed, the same bytes.
TEST(Nifti, IsHeaderAndVoxels) {
  const Image image = oblique(false);
  save_image(image, folder() / "plain.nii");
  save_image(image, folder() / "packed.nii.gz");
  const std::string plain = read_text(folder() / "plain.nii"), packed = read_text(folder() / "packed.nii.gz");
  const std::size_t bytes = image.frame.voxel_count() * sizeof(std::int16_t);
  ASSERT_EQ(plain.size(), 352 + bytes);
  std::int32_t header_bytes = 0;
  float voxels_at = 0;
  std::memcpy(&header_bytes, plain.data(), 4);
  std::memcpy(&voxels_at, plain.data() + 108, 4);
  EXPECT_EQ(header_bytes, 348);
  EXPECT_EQ(voxels_at, 352);
  EXPECT_EQ(plain.substr(344, 8), std::string("n+1\0\0\0\0\0", 8));
  EXPECT_EQ(std::memcmp(plain.data() + 352, image.voxels.get(), bytes), 0);
  const Image back = load_image(folder() / "packed.nii.gz"), again = load_image(folder() / "plain.nii");
  EXPECT_EQ(std::memcmp(back.voxels.get(), image.voxels.get(), bytes), 0);
  EXPECT_EQ(std::memcmp(again.voxels.get(), image.voxels.get(), bytes), 0);
  EXPECT_LT(packed.size(), plain.size());
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

TEST(Tets, ValuesAtPointsSurviveInVtu) {
  TetMesh mesh;
  for (const auto& p : {std::array<float, 3>{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}) mesh.points_mm.push_back(p);
  mesh.tets.push_back({0, 1, 2, 3});
  mesh.values = {1, 20.5F, 1e-3F, 1e6F};
  mesh.values_name = "stiffness_kpa";
  save_tets(mesh, folder() / "values.vtu");
  const Tets back = load_tets(folder() / "values.vtu");
  EXPECT_EQ(back->values, mesh.values);
  EXPECT_EQ(back->values_name, mesh.values_name);
  mesh.values.clear();
  save_tets(mesh, folder() / "plain.vtu");
  EXPECT_TRUE(load_tets(folder() / "plain.vtu")->values.empty());
}

}  // namespace
}  // namespace osteo
