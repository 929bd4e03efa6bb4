// Pixels in the encodings of 2024 to 2026: testdata/make_encodings.py says by which encoders.
#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "folders.h"
#include "osteo/core/base/error.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/dicom/import.h"
#include "osteo/imaging/dicom/objects.h"
#include "osteo/imaging/dicom/scan.h"
#include "osteo/imaging/dicom/volume.h"

namespace osteo {
namespace {

fs::path encoded(const std::string& name) {
  return source_folder() / "testdata/encodings" / (name + ".dcm");
}

Imported load(const fs::path& file) {
  Context context;
  context.threads = 1;
  return import_ct(file, {}, context);
}

// Left out where the build has no codec for it: the refusal then says which library is missing.
bool has_codec(const std::string& name) {
  try {
    static_cast<void>(load(encoded(name)));
  } catch (const Error& e) {
    return std::string(e.what()).find("it was made without") == std::string::npos;
  }
  return true;
}

TEST(Encodings, EachIsReadBitForBit) {
  const std::vector<std::pair<std::string, std::vector<std::string>>> alike{
      {"plain",
       {"htj2k", "htj2k-signed", "htj2k-rpcl", "jpeg-xl", "jpeg-xl-12", "jpeg-xl-any", "deflated", "encapsulated"}},
      {"plain-8", {"jpeg-xl-8", "deflated-8", "encapsulated-8"}},
      {"jpeg", {"jpeg-in-jpeg-xl"}}};
  for (const auto& [plain, names] : alike) {
    const Image truth = load(encoded(plain)).image;
    EXPECT_GT(*std::max_element(truth.span().begin(), truth.span().end()), 300);
    for (const std::string& name : names) {
      SCOPED_TRACE(name);
      if (!has_codec(name)) continue;
      const Imported r = load(encoded(name));
      EXPECT_FALSE(r.verdict.has(code::pixels_damaged));
      EXPECT_EQ(r.verdict.has(code::lossy), plain == "jpeg");
      EXPECT_TRUE(r.image.frame == truth.frame);
      EXPECT_TRUE(std::equal(truth.span().begin(), truth.span().end(), r.image.span().begin(), r.image.span().end()));
    }
  }
}

TEST(Encodings, WithLossIsNearTheTruth) {
  if (!has_codec("htj2k-lossy")) GTEST_SKIP();
  const Image truth = load(encoded("plain")).image, got = load(encoded("htj2k-lossy")).image;
  int most = 0;
  for (std::size_t i = 0; i < truth.span().size(); ++i)
    most = std::max(most, std::abs(truth.span()[i] - got.span()[i]));
  EXPECT_GT(most, 0);
  EXPECT_LT(most, 40);
}

TEST(Encodings, OneThatIsNotReadIsNamedAndNotRecommended) {
  try {
    static_cast<void>(load(encoded("unread")));
    ADD_FAILURE();
  } catch (const Refused& e) {
    EXPECT_TRUE(e.verdict().has(code::unsupported_encoding));
    EXPECT_NE(std::string(e.what()).find("JPEG 2000 Part 2 Multi-component Lossless"), std::string::npos) << e.what();
  }
  const DicomScan scan = scan_dicom(encoded("unread"));
  ASSERT_EQ(scan.series.size(), 1u);
  EXPECT_FALSE(scan.series[0].usable);
  EXPECT_FALSE(scan.series[0].recommended);
}

// Whatever a damaged picture decodes to, it does so without harm, and most are noticed.
TEST(Encodings, DamagedPicturesAreRefused) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "a.dcm";
  for (const std::string name : {"htj2k", "htj2k-rpcl", "jpeg-xl", "jpeg-in-jpeg-xl", "deflated", "encapsulated"}) {
    SCOPED_TRACE(name);
    if (!has_codec(name)) continue;
    const std::string whole = read_text(encoded(name));
    const std::size_t pixels = whole.rfind(std::string("\xE0\x7F\x10\x00OB\0\0", 8));
    ASSERT_NE(pixels, std::string::npos);
    std::mt19937 random(11);
    int refused = 0;
    constexpr int kTimes = 30;
    for (int i = 0; i < kTimes; ++i) {
      std::string damaged = whole;
      if (i % 3 == 0) {
        damaged.resize(pixels + random() % (whole.size() - pixels));
      } else {
        for (int k = 0; k < 1 + i % 5; ++k)
          damaged[pixels + 12 + random() % (whole.size() - pixels - 12)] = static_cast<char>(random());
      }
      std::ofstream(file, std::ios::binary) << damaged;
      try {
        static_cast<void>(load(file));
      } catch (const Error&) {
        ++refused;
      }
    }
    EXPECT_GE(refused, kTimes / 3);
  }
}

// What make_encodings.py painted: two parts in slices 1, 2 and 4; the first layer here is slice 1.
int painted(int i, int j, int layer) {
  const int k = layer + 1;
  if (k == 3 || j <= 2 + k) return 0;
  return i < 9 ? 1 : i > 15 ? 2 : 0;
}

void expect_painted(const std::string& name, const std::vector<std::string>& labels) {
  SCOPED_TRACE(name);
  ASSERT_TRUE(is_segmentation(encoded(name)));
  const Labels l = load_segmentation(encoded(name));
  ASSERT_EQ(l.structures.size(), 2u);
  for (std::size_t s = 0; s < 2; ++s) {
    EXPECT_EQ(l.structures[s].value, s + 1);
    EXPECT_EQ(l.structures[s].name, labels[s]);
  }
  const Image ct = load(encoded("plain")).image;
  EXPECT_LT(length(l.frame.origin_mm - ct.frame.origin_mm - Vec3{0, 0, 1}), 1e-6);
  ASSERT_EQ(l.frame.dims, (std::array{25, 17, 4}));
  EXPECT_NEAR(l.frame.spacing_mm.z, 1, 1e-9);
  for (int k = 0; k < 4; ++k)
    for (int j = 0; j < 17; ++j)
      for (int i = 0; i < 25; ++i) ASSERT_EQ(l.at(i, j, k), painted(i, j, k)) << i << ' ' << j << ' ' << k;
}

TEST(Encodings, SegmentationsAreReadToThePixel) {
  expect_painted("seg-bits", {"part 1", "part 2"});
  expect_painted("seg-labelmap-8", {"part 1", "part 2"});
  expect_painted("seg-labelmap-16", {"part 1", "part 300"});
}

TEST(Encodings, ANumberThatNoSegmentHasIsRefused) {
  const TemporaryFolder folder;
  std::string bytes = read_text(encoded("seg-labelmap-8"));
  bytes[bytes.size() - 20] = 7;
  std::ofstream(folder.path() / "a.dcm", std::ios::binary) << bytes;
  try {
    static_cast<void>(load_segmentation(folder.path() / "a.dcm"));
    ADD_FAILURE();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("the number 7"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace osteo
