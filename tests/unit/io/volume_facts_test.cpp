// What volume files say besides voxels: byte order, units, axes, how many volumes; written here byte by byte.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <fstream>

#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/io/volume_io.h"

namespace osteo {
namespace {

fs::path file(const std::string& name) {
  static const TemporaryFolder folder;
  return folder.path() / name;
}

using What = VolumeFinding::What;

constexpr int kVoxels = 4 * 3 * 2;
std::int16_t value(int i) {
  return static_cast<std::int16_t>(i * 100 - 1024);
}

void write(const fs::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}
std::string voxels(bool big, int volumes = 1) {
  std::string bytes;
  for (int n = 0; n < kVoxels * volumes; ++n) {
    const auto v = static_cast<std::uint16_t>(value(n % kVoxels));
    const char low = static_cast<char>(v & 255), high = static_cast<char>(v >> 8);
    bytes += big ? std::string{high, low} : std::string{low, high};
  }
  return bytes;
}

struct Loaded {
  Image image;
  std::vector<VolumeFinding> findings;
  [[nodiscard]] bool has(What what) const {
    return std::any_of(findings.begin(), findings.end(), [&](const VolumeFinding& f) { return f.what == what; });
  }
};
Loaded load(const fs::path& path) {
  Loaded l;
  l.image = load_image(path, {}, &l.findings);
  return l;
}
std::string refusal(const fs::path& path) {
  try {
    static_cast<void>(load_image(path));
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ExitCode::corrupt);
    return std::string(e.what()) + e.advice();
  }
  return {};
}
void expect_values(const Image& image) {
  ASSERT_EQ(image.frame.dims, (std::array<int, 3>{4, 3, 2}));
  for (int i = 0; i < kVoxels; ++i) ASSERT_EQ(image.voxels[i], value(i)) << i;
}

std::string meta_header(const std::string& more, const std::string& data = "LOCAL") {
  return "ObjectType = Image\nNDims = 3\nBinaryData = True\n" + more +
         "TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 10 20 30\nElementSpacing = 2 3 4\nDimSize = 4 3 2\nElementType "
         "= MET_SHORT\n"
         "ElementDataFile = " +
         data + "\n";
}

TEST(MetaImage, BytesAreReadInTheOrderThatTheHeaderStates) {
  for (const bool big : {false, true}) {
    SCOPED_TRACE(big);
    const std::string order = std::string("BinaryDataByteOrderMSB = ") + (big ? "True\n" : "False\n");
    write(file("a.mha"), meta_header(order) + voxels(big));
    expect_values(load(file("a.mha")).image);
    write(file("a.mhd"), meta_header(order, "a.raw"));
    write(file("a.raw"), voxels(big));
    expect_values(load(file("a.mhd")).image);
  }
}

TEST(MetaImage, NumbersWrittenAsTextHaveNoByteOrder) {
  std::string header = meta_header("BinaryDataByteOrderMSB = True\n"), text;
  header.replace(header.find("BinaryData = True"), 17, "BinaryData = False");
  for (int i = 0; i < kVoxels; ++i) text += std::to_string(value(i)) + " ";
  write(file("text.mha"), header + text);
  expect_values(load(file("text.mha")).image);
}

TEST(MetaImage, UnitsAreConverted) {
  for (const auto& [unit, mm] : {std::pair{"um", 1e-3}, {"mm", 1.0}, {"cm", 10.0}}) {
    SCOPED_TRACE(unit);
    write(file("unit.mha"), meta_header(std::string("DistanceUnits = ") + unit + "\n") + voxels(false));
    const Loaded l = load(file("unit.mha"));
    EXPECT_NEAR(length(l.image.frame.spacing_mm - Vec3{2, 3, 4} * mm), 0, 1e-9);
    EXPECT_NEAR(length(l.image.frame.origin_mm - Vec3{10, 20, 30} * mm), 0, 1e-9);
    EXPECT_EQ(l.has(What::lengths_converted), mm != 1);
  }
}

TEST(MetaImage, SeveralVolumesAreRefusedForWhatTheyAre) {
  write(file("four.mha"),
        "ObjectType = Image\nNDims = 4\nBinaryData = True\nBinaryDataByteOrderMSB = False\nElementSpacing = 1 1 1 "
        "1\nDimSize = 4 3 2 3\n"
        "ElementType = MET_SHORT\nElementDataFile = LOCAL\n" +
            voxels(false, 3));
  const std::string said = refusal(file("four.mha"));
  EXPECT_NE(said.find("4 axes"), std::string::npos) << said;
  EXPECT_EQ(said.find("cut short"), std::string::npos) << said;
}

// A NIfTI-1 header, in this machine's order.
struct Nifti {
  std::array<char, 352> bytes{};
  template <class T>
  void put(std::size_t at, T v) {
    std::memcpy(bytes.data() + at, &v, sizeof v);
  }
  Nifti() {
    put<std::int32_t>(0, 348);
    const std::array<std::int16_t, 8> dim{3, 4, 3, 2, 1, 1, 1, 1};
    for (std::size_t i = 0; i < 8; ++i) put(40 + 2 * i, dim[i]);
    put<std::int16_t>(70, 4);   // short
    put<std::int16_t>(72, 16);  // bits
    const std::array<float, 4> pixdim{1, 2, 3, 4};
    for (std::size_t i = 0; i < 4; ++i) put(76 + 4 * i, pixdim[i]);
    put<float>(108, 352);
    put<float>(112, 1);  // slope
    put<char>(123, 2);   // mm
    std::memcpy(bytes.data() + 344, "n+1", 4);
    sform({{{-2, 0, 0, -10}, {0, -3, 0, -20}, {0, 0, 4, 30}}});
  }
  void sform(const std::array<std::array<float, 4>, 3>& rows) {
    put<std::int16_t>(254, 1);
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 4; ++c) put(280 + 16 * r + 4 * c, rows[r][c]);
  }
  // Turned about z, from RAS axes that point to the left and back.
  void qform(double degrees, float qfac = 1) {
    put<std::int16_t>(252, 1);
    put<float>(76, qfac);
    const double half = (180 + degrees) / 2 * 3.14159265358979 / 180;
    put<float>(256, 0);
    put<float>(260, 0);
    put<float>(264, static_cast<float>(std::sin(half)));
    put<float>(268, -10);
    put<float>(272, -20);
    put<float>(276, 30);
  }
  void volumes(int n) {
    put<std::int16_t>(40, 4);
    put<std::int16_t>(48, static_cast<std::int16_t>(n));
  }
  void save(const fs::path& path, int volumes = 1) const {
    write(path, std::string(bytes.data(), bytes.size()) + voxels(false, volumes));
  }
};

TEST(Nifti, UnitsAreConverted) {
  for (const auto& [unit, mm] : {std::pair{0, 1.0}, {1, 1000.0}, {2, 1.0}, {3, 1e-3}}) {
    for (const int time : {0, 8}) {  // seconds, beside it
      SCOPED_TRACE(unit);
      Nifti n;
      n.put<char>(123, static_cast<char>(unit | time));
      const auto in_file = [&m = mm](double v) { return static_cast<float>(v / m); };
      for (std::size_t a = 0; a < 3; ++a) n.put<float>(80 + 4 * a, in_file(2.0 + static_cast<double>(a)));
      n.sform(
          {{{in_file(-2), 0, 0, in_file(-10)}, {0, in_file(-3), 0, in_file(-20)}, {0, 0, in_file(4), in_file(30)}}});
      n.save(file("unit.nii"));
      const Loaded l = load(file("unit.nii"));
      expect_values(l.image);
      EXPECT_NEAR(length(l.image.frame.spacing_mm - Vec3{2, 3, 4}), 0, 1e-5);
      EXPECT_NEAR(length(l.image.frame.origin_mm - Vec3{10, 20, 30}), 0, 1e-5);
      EXPECT_EQ(l.has(What::lengths_converted), mm != 1);
    }
  }
}

TEST(Nifti, SeveralVolumesAreRefused) {
  Nifti n;
  n.volumes(3);
  n.save(file("four.nii"), 3);
  EXPECT_NE(refusal(file("four.nii")).find("3 volumes"), std::string::npos);
  n.volumes(1);  // a fourth axis of one
  n.save(file("one.nii"));
  expect_values(load(file("one.nii")).image);
}

TEST(Nifti, FormsThatDisagreeAreTold) {
  for (const auto& [degrees, reported] : {std::pair{0.0, false}, {0.5, false}, {25.0, true}, {-90.0, true}}) {
    SCOPED_TRACE(degrees);
    Nifti n;
    n.qform(degrees);
    n.save(file("forms.nii"));
    const Loaded l = load(file("forms.nii"));
    EXPECT_EQ(l.has(What::places_disagree), reported);
    EXPECT_NEAR(length(l.image.frame.origin_mm - Vec3{10, 20, 30}), 0, 1e-4);
  }
  Nifti mirrored;
  mirrored.qform(0, -1);
  mirrored.save(file("mirror.nii"));
  const std::string said = refusal(file("mirror.nii"));
  EXPECT_NE(said.find("mirror images"), std::string::npos) << said;
  EXPECT_EQ(said.find("cut short"), std::string::npos) << said;
}

std::string nrrd(const std::string& more) {
  return "NRRD0004\ntype: short\ndimension: 3\nsizes: 4 3 2\n" + more + "endian: little\nencoding: raw\n\n" +
         voxels(false);
}
const std::string kDirections = "space directions: (2,0,0) (0,3,0) (0,0,4)\nspace origin: (10,20,30)\n";

TEST(Nrrd, WithoutAnAnatomicalSpaceItsSidesAreNotKnown) {
  for (const auto& [space, reported] : {std::pair{"space dimension: 3\n", true},
                                        {"space: scanner-xyz\n", true},
                                        {"space: 3D-right-handed\n", true},
                                        {"space: left-posterior-superior\n", false},
                                        {"space: RAS\n", false},
                                        {"space: LAS\n", false}}) {
    SCOPED_TRACE(space);
    write(file("space.nrrd"), nrrd(space + kDirections));
    EXPECT_EQ(load(file("space.nrrd")).has(What::axes_not_stated), reported);
  }
  write(file("bare.nrrd"), nrrd("spacings: 2 3 4\n"));
  EXPECT_TRUE(load(file("bare.nrrd")).has(What::axes_not_stated));
}

TEST(Nrrd, UnitsAreConverted) {
  const auto units = [](const std::string& u) { return "\"" + u + "\" \"" + u + "\" \"" + u + "\"\n"; };
  for (const auto& [unit, mm] :
       {std::pair{"mm", 1.0}, {"cm", 10.0}, {"m", 1000.0}, {"um", 1e-3}, {"micron", 1e-3}, {"", 1.0}}) {
    SCOPED_TRACE(unit);
    const auto in_file = [&m = mm](double v) { return std::to_string(v / m); };
    write(file("unit.nrrd"), nrrd("space: LPS\nspace directions: (" + in_file(2) + ",0,0) (0," + in_file(3) +
                                  ",0) (0,0," + in_file(4) + ")\nspace origin: (" + in_file(10) + "," + in_file(20) +
                                  "," + in_file(30) + ")\nspace units: " + units(unit)));
    const Loaded l = load(file("unit.nrrd"));
    EXPECT_NEAR(length(l.image.frame.spacing_mm - Vec3{2, 3, 4}), 0, 1e-9);
    EXPECT_NEAR(length(l.image.frame.origin_mm - Vec3{10, 20, 30}), 0, 1e-9);
    EXPECT_EQ(l.has(What::lengths_converted), mm != 1);
  }
  write(file("unit.nrrd"), nrrd("spacings: 2 3 4\nunits: " + units("cm")));
  EXPECT_NEAR(load(file("unit.nrrd")).image.frame.spacing_mm.y, 30, 1e-9);
  write(file("unit.nrrd"), nrrd("space: LPS\n" + kDirections + "space units: " + units("furlong")));
  EXPECT_NE(refusal(file("unit.nrrd")).find("furlong"), std::string::npos);
  write(file("unit.nrrd"), nrrd("space: LPS\n" + kDirections + "space units: \"mm\" \"mm\" \"cm\"\n"));
  EXPECT_NE(refusal(file("unit.nrrd")).find("different units"), std::string::npos);
}

// A header that states more than the file can hold is told before memory is asked for.
TEST(VolumeFile, AHeaderThatStatesTooMuchIsRefused) {
  write(file("big.nrrd"),
        "NRRD0004\ntype: short\ndimension: 3\nspace: LPS\nsizes: 30000 30000 30000\nencoding: gzip\n\nxyz");
  write(file("big.mha"),
        "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nElementSpacing = 1 1 "
        "1\nDimSize = 30000 30000 "
        "30000\nElementType = MET_SHORT\nElementDataFile = LOCAL\nxyz");
  Nifti n;
  for (std::size_t a = 1; a <= 3; ++a) n.put<std::int16_t>(40 + 2 * a, 30000);
  n.save(file("big.nii"));
  for (const char* const name : {"big.nrrd", "big.mha", "big.nii"})
    EXPECT_NE(refusal(file(name)).find("cannot hold"), std::string::npos) << name << ": " << refusal(file(name));
}

TEST(VolumeFile, ValuesThatAreNoNumbersAreRefusedWithAHint) {
  const float nan = std::nanf("");
  std::string bytes(sizeof(float) * kVoxels, '\0');
  std::memcpy(bytes.data() + 8, &nan, sizeof nan);
  write(file("nan.nrrd"), "NRRD0004\ntype: float\ndimension: 3\nspace: LPS\nsizes: 4 3 2\n" + kDirections +
                              "endian: little\nencoding: raw\n\n" + bytes);
  EXPECT_NE(refusal(file("nan.nrrd")).find("-1024"), std::string::npos);
}

}  // namespace
}  // namespace osteo
