// The hard list of CT import: what the values of pixels mean.
#include <cmath>

#include "edit.h"
#include "hard_case.h"
#include "osteo/imaging/dicom/import.h"
#include "osteo/imaging/io/volume_io.h"
#include "reference.h"

namespace osteo {
namespace {

using test::data;
using test::load;
using test::put;
using test::refusal;
using test::Series;
using test::slices;

// Each pixel stored again as word(HU), with the tags that say how.
void store_as(Series& s, const std::function<Uint16(int hu, std::size_t at)>& word, int bits_stored, int high_bit,
              bool is_signed, int intercept) {
  s.edit_all([&](DcmDataset& d, int) {
    const Uint16* read = nullptr;
    unsigned long count = 0;
    ASSERT_TRUE(d.findAndGetUint16Array(DCM_PixelData, read, &count).good());
    Float64 offset = 0;
    d.findAndGetFloat64(DCM_RescaleIntercept, offset);
    Uint16 was_signed = 0;
    d.findAndGetUint16(DCM_PixelRepresentation, was_signed);
    std::vector<Uint16> pixels(count);
    for (std::size_t i = 0; i < count; ++i) {
      const int stored = was_signed != 0 ? static_cast<std::int16_t>(read[i]) : static_cast<int>(read[i]);
      pixels[i] = word(std::max(-1024, stored + static_cast<int>(offset)), i);
    }
    ASSERT_TRUE(d.putAndInsertUint16Array(DCM_PixelData, pixels.data(), count).good());
    d.putAndInsertUint16(DCM_PixelRepresentation, is_signed ? 1 : 0);
    d.putAndInsertUint16(DCM_BitsStored, static_cast<Uint16>(bits_stored));
    d.putAndInsertUint16(DCM_HighBit, static_cast<Uint16>(high_bit));
    d.findAndDeleteElement(DCM_PixelPaddingValue);
    put(d, DCM_RescaleIntercept, std::to_string(intercept));
    put(d, DCM_RescaleSlope, "1");
  });
}

void expect_same_voxels(const Image& a, const Image& b) {
  ASSERT_EQ(a.frame.voxel_count(), b.frame.voxel_count());
  std::size_t other = 0;
  for (std::size_t i = 0; i < a.frame.voxel_count(); ++i) other += a.voxels[i] != b.voxels[i] ? 1 : 0;
  EXPECT_EQ(other, 0u);
}

TEST(HardCase, C25_SignedPixelsWithoutTheirSignExtended) {
  const auto low = [](int hu) { return std::min(hu, 2047); };
  Series plain("c25-plain", slices(0, 12)), bare("c25", slices(0, 12)), padded("c25-padded", slices(0, 12));
  store_as(
      plain, [&](int hu, std::size_t) { return static_cast<Uint16>(low(hu)); }, 12, 11, true, 0);
  store_as(
      bare, [&](int hu, std::size_t) { return static_cast<Uint16>(low(hu) & 0xFFF); }, 12, 11, true, 0);
  const Imported wanted = load(plain.folder), got = load(bare.folder);
  EXPECT_FALSE(wanted.verdict.has(code::sign_not_extended));
  EXPECT_TRUE(got.verdict.has(code::sign_not_extended));
  EXPECT_LT(got.verdict.values.hu_min, -900);
  EXPECT_TRUE(got.verdict.values.plausible);
  expect_same_voxels(wanted.image, got.image);
  // Its padding is given in the same way, and as a number that 12 bits do not hold.
  for (const int padding : {-2000, -3024}) {
    store_as(
        padded,
        [&](int hu, std::size_t i) {
          return static_cast<Uint16>(i < 5000 ? (padding == -2000 ? padding & 0xFFF : padding) : low(hu));
        },
        12, 11, true, 0);
    padded.edit_all([&](DcmDataset& d, int) {
      d.putAndInsertSint16(DcmTag(DCM_PixelPaddingValue, EVR_SS),
                           static_cast<Sint16>(padding == -2000 ? padding & 0xFFF : padding));
    });
    const Imported p = load(padded.folder);
    EXPECT_TRUE(p.verdict.has(code::padding_tag)) << padding;
    EXPECT_EQ(p.verdict.values.padding_hu, padding);
    EXPECT_EQ(p.image.voxels[100], -1024);
    EXPECT_EQ(p.image.voxels[5001], got.image.voxels[5001]);
  }
  // No tag names it: negative numbers of more than 12 bits are still that, and no bone of 1072 HU.
  padded.edit_all([](DcmDataset& d, int) { d.findAndDeleteElement(DCM_PixelPaddingValue); });
  const Imported untold = load(padded.folder);
  EXPECT_TRUE(untold.verdict.has(code::bits_stored_wrong));
  EXPECT_EQ(untold.image.voxels[100], -1024);
}

TEST(HardCase, C26_OtherBitsAroundThoseOfThePixel) {
  Series plain("c26-plain", slices(0, 12)), above("c26-above", slices(0, 12)), left("c26-left", slices(0, 12)),
      wrong("c26-wrong", slices(0, 12)), metal("c26-metal", slices(0, 12));
  const auto word = [](int hu) { return std::min(hu + 1024, 4095); };
  const auto columns = static_cast<std::size_t>(load(plain.folder).image.frame.dims[0]);
  store_as(
      plain, [&](int hu, std::size_t) { return static_cast<Uint16>(word(hu)); }, 12, 11, false, -1024);
  const Imported wanted = load(plain.folder);
  // Garbage above HighBit.
  store_as(
      above,
      [&](int hu, std::size_t i) { return static_cast<Uint16>(word(hu) | ((i * 2654435761U >> 7 & 15U) << 12)); }, 12,
      11, false, -1024);
  const Imported cleared = load(above.folder);
  EXPECT_TRUE(cleared.verdict.has(code::bits_foreign));
  expect_same_voxels(wanted.image, cleared.image);
  // The pixel in the upper bits of its word.
  store_as(
      left, [&](int hu, std::size_t) { return static_cast<Uint16>(word(hu) << 4); }, 12, 15, false, -1024);
  expect_same_voxels(wanted.image, load(left.folder).image);
  // A HighBit that is wrong.
  store_as(
      wrong, [&](int hu, std::size_t) { return static_cast<Uint16>(word(hu)); }, 12, 15, false, -1024);
  const Imported guessed = load(wrong.folder);
  EXPECT_TRUE(guessed.verdict.has(code::high_bit_wrong));
  expect_same_voxels(wanted.image, guessed.image);
  // A BitsStored that metal exceeds, with edges as blurred as a scanner's: 5600 and not 1504.
  store_as(
      metal,
      [&](int hu, std::size_t i) {
        return static_cast<Uint16>(std::max(word(hu), 5600 - 200 * std::abs(int(i % columns) - 20)));
      },
      12, 11, false, -1024);
  const Imported kept = load(metal.folder);
  EXPECT_TRUE(kept.verdict.has(code::bits_stored_wrong));
  EXPECT_EQ(kept.image.voxels[20], 4576);
}

// Unsigned pixels that lack their intercept: everything 1024 HU too high, bone from fat on. Rejected, with the offset
// that mends it.
TEST(HardCase, C28_WithoutTheOffset) {
  for (const bool thorough : {true, false}) {
    PhantomParams p;
    p.spacing_mm = 3;
    const fs::path folder = test::scratch("c28") / "series";
    save_dicom_series(make_phantom(p).ct, folder);
    const Imported wanted = load(folder);
    Series s("c28-shifted", test::files_in(folder));
    s.edit_all([&](DcmDataset& d, int) {
      const Uint16* read = nullptr;
      unsigned long count = 0;
      ASSERT_TRUE(d.findAndGetUint16Array(DCM_PixelData, read, &count).good());
      std::vector<Uint16> pixels(read, read + count);
      for (auto& v : pixels) v = static_cast<Uint16>(static_cast<std::int16_t>(v) + 1024);
      ASSERT_TRUE(d.putAndInsertUint16Array(DCM_PixelData, pixels.data(), count).good());
      d.putAndInsertUint16(DCM_PixelRepresentation, 0);
      d.findAndDeleteElement(DCM_PixelPaddingValue);
      // The one leaves the tag out, the other says 0.
      thorough ? put(d, DCM_RescaleIntercept, "0") : static_cast<void>(d.findAndDeleteElement(DCM_RescaleIntercept));
    });
    const Verdict v = refusal(s.folder, code::hu_shifted, "-1024 HU added to each would put them right");
    EXPECT_TRUE(v.has(code::bone_implausible));
    ImportParams params;
    params.hu_offset = -1024;
    const Imported mended = load(s.folder, params);
    EXPECT_TRUE(mended.verdict.has(code::hu_offset));
    EXPECT_TRUE(mended.verdict.values.plausible);
    EXPECT_FALSE(mended.verdict.has(code::bone_implausible));
    expect_same_voxels(wanted.image, mended.image);
    // As a volume file alike.
    ImportParams any;
    any.any_modality = true;
    const fs::path file = test::scratch("c28-file") / "ct.nrrd";
    save_image(load(s.folder, any).image, file);
    refusal(file, code::hu_shifted, "-1024 HU");
    expect_same_voxels(wanted.image, load(file, params).image);
  }
}

TEST(HardCase, C29_ProjectionsAndSlabs) {
  const auto made = [](const char* name, const std::function<void(DcmDataset&)>& change) {
    auto s = std::make_unique<Series>(name, slices(0, 20));
    s->edit_all([&](DcmDataset& d, int) { change(d); });
    return s;
  };
  const auto by_type = made("c29-type", [](DcmDataset& d) {
    put(d, DCM_ImageType, "DERIVED\\SECONDARY\\MIP");
    put(d, DCM_SliceThickness, "10");
  });
  refusal(by_type->folder, code::projection, "slab of 10 mm");
  ImportParams any;
  any.any_modality = true;
  EXPECT_TRUE(load(by_type->folder, any).verdict.has(code::projection));
  refusal(made("c29-name", [](DcmDataset& d) { put(d, DCM_SeriesDescription, "AX Thin MIP_10mm"); })->folder,
          code::projection);
  EXPECT_FALSE(load(made("c29-other", [](DcmDataset& d) { put(d, DCM_SeriesDescription, "Mipham temporal"); })->folder)
                   .verdict.has(code::projection));
  const auto by_far = made("c29-slab", [](DcmDataset& d) { put(d, DCM_SliceThickness, "10"); });
  const Verdict slab = load(by_far->folder).verdict;
  EXPECT_TRUE(slab.has(code::slices_overlap));
  EXPECT_EQ(slab.status(), "repaired");
  const auto half = made("c29-half", [](DcmDataset& d) { put(d, DCM_SliceThickness, "2"); });
  const Verdict overlap = load(half->folder).verdict;
  EXPECT_TRUE(overlap.has(code::slices_overlap));
  EXPECT_EQ(overlap.status(), "good");
}

TEST(HardCase, C30_ValuesThatAreNoHounsfieldUnits) {
  for (const char* type : {"Z_EFF", "ED", "MGML", "PCT"}) {
    Series s("c30", slices(0, 12));
    s.edit_all([&](DcmDataset& d, int) { put(d, DCM_RescaleType, type); });
    refusal(s.folder, code::rescale_type, type);
  }
  Series modified("c30-modified", slices(0, 12)), unspecified("c30-us", slices(0, 12));
  modified.edit_all([&](DcmDataset& d, int) { put(d, DCM_RescaleType, "HU_MOD"); });
  EXPECT_TRUE(load(modified.folder).verdict.has(code::rescale_type));
  unspecified.edit_all([&](DcmDataset& d, int) { put(d, DCM_RescaleType, "US"); });
  EXPECT_FALSE(load(unspecified.folder).verdict.has(code::rescale_type));
}

// Dark streaks beside metal are measured; a value that marks what was not measured is not.
TEST(HardCase, C31_BelowAirIsKept) {
  Series s("c31", slices(0, 12));
  store_as(
      s,
      [](int hu, std::size_t i) {
        if (i < 2000) return static_cast<Uint16>(-2000);
        return static_cast<Uint16>(i > 20000 && i < 20100 ? -1100 - static_cast<int>(i % 97) * 7 : hu);
      },
      16, 15, true, 0);
  const Imported r = load(s.folder);
  EXPECT_EQ(r.image.voxels[0], -1024);
  EXPECT_TRUE(r.verdict.has(code::padding_found));
  EXPECT_TRUE(r.verdict.has(code::below_air));
  for (int i = 20001; i < 20100; ++i) EXPECT_EQ(r.image.voxels[static_cast<std::size_t>(i)], -1100 - i % 97 * 7);
}

// Around a round picture some scanners write their brightest value: no bone, whether a tag names it, or a range, or
// none. A clip of the same value inside stays.
TEST(HardCase, ARingOfTheBrightestValueIsPadding) {
  const std::int16_t clip = 3071;
  const auto make = [&](const char* name, int tags) {
    Series s(name, slices(0, 12));
    s.edit_all([&](DcmDataset& d, int i) {
      Uint16 rows = 0, columns = 0;
      Float64 slope = 1, intercept = 0;
      d.findAndGetUint16(DCM_Rows, rows);
      d.findAndGetUint16(DCM_Columns, columns);
      d.findAndGetFloat64(DCM_RescaleSlope, slope);
      d.findAndGetFloat64(DCM_RescaleIntercept, intercept);
      const auto bright = static_cast<Uint16>((clip - intercept) / slope);
      Uint16* pixels = nullptr;
      ASSERT_TRUE(d.findAndGetUint16Array(DCM_PixelData, const_cast<const Uint16*&>(pixels)).good());
      for (int y = 0; y < rows; ++y)
        for (int x = 0; x < columns; ++x)
          if (std::hypot(2.0 * x / columns - 1, 2.0 * y / rows - 1) > 1) pixels[y * columns + x] = bright;
      if (i == 6) pixels[rows / 2 * columns + columns / 2] = bright;
      if (tags > 0) {
        ASSERT_TRUE(d.putAndInsertUint16(DCM_PixelPaddingValue, bright).good());
      }
      if (tags > 1) {
        ASSERT_TRUE(d.putAndInsertUint16(DCM_PixelPaddingRangeLimit, static_cast<Uint16>(bright - 5)).good());
      }
    });
    return load(s.folder);
  };
  for (int tags = 0; tags < 3; ++tags) {
    const Imported r = make(("ring" + std::to_string(tags)).c_str(), tags);
    EXPECT_TRUE(r.verdict.has(code::padding_found)) << tags;
    EXPECT_FALSE(r.verdict.has(code::bone_implausible)) << tags;
    EXPECT_FALSE(r.verdict.has(code::padding_tag_wrong) && tags < 2) << tags;
    EXPECT_GT(r.verdict.values.padding_share, 0.2);
    const Frame& f = r.image.frame;
    EXPECT_LT(r.image.at(0, 0, 0), -900) << tags;
    EXPECT_LT(r.image.at(f.dims[0] - 1, f.dims[1] - 1, 5), -900) << tags;
    std::int16_t most = -32768;
    for (std::size_t i = 0; i < f.voxel_count(); ++i) most = std::max(most, r.image.voxels[i]);
    EXPECT_GE(most, 3070) << "the clip stays";
  }
}

}  // namespace
}  // namespace osteo
