// Series that hold more than one scan, and values that are no Hounsfield units by what their header says (42 to 71 of
// docs/validation/hard-cases.md).
#include <cmath>

#include "edit.h"
#include "osteo/imaging/dicom/import.h"
#include "osteo/imaging/dicom/volume.h"
#include "reference.h"

namespace osteo {
namespace {

using test::put;
using test::Series;

std::vector<fs::path> slices(int begin, int end) {
  const auto& all = test::straight_series();
  return {all.begin() + begin, all.begin() + end};
}

Imported load(const fs::path& folder, int stack = 0) {
  ImportParams params;
  params.stack = stack;
  return import_ct(folder, params);
}

void expect_refused(const fs::path& folder, std::string_view code, const std::string& said) {
  try {
    static_cast<void>(load(folder));
    ADD_FAILURE() << "not refused: " << code;
  } catch (const Refused& e) {
    EXPECT_TRUE(e.verdict().has(code)) << e.what();
    EXPECT_NE(std::string(e.what()).find(said), std::string::npos) << e.what();
  }
}

std::string message_of(const Verdict& v, std::string_view code) {
  for (const Finding& f : v.findings) {
    if (f.code == code) return f.message;
  }
  return {};
}

// Pixels of its own, so that it is no duplicate.
void other_picture(DcmDataset& d, Uint16 bits = 3) {
  Uint16* pixels = nullptr;
  ASSERT_TRUE(d.findAndGetUint16Array(DCM_PixelData, const_cast<const Uint16*&>(pixels)).good());
  for (int i = 0; i < 5000; ++i) pixels[100000 + i] = static_cast<Uint16>(pixels[100000 + i] ^ bits);
}

// Doubles a series: a second picture for each slice, changed by `change`.
void second_scan(Series& s, const std::function<void(DcmDataset&, int)>& change) {
  int i = 0;
  for (const auto& f : test::files_in(s.folder)) {
    const std::string name = f.filename().string();
    s.edit(
        name,
        [&](DcmDataset& d) {
          put(d, DCM_SOPInstanceUID, "1.2.3.4.5." + std::to_string(i));
          other_picture(d);
          change(d, i);
        },
        "b" + name);
    ++i;
  }
}

void move(DcmDataset& d, Vec3 by) {
  put(d, DCM_ImagePositionPatient, test::text(test::position_of(d) + by));
}

// Each half is a whole scan, and it is said which is taken.
void expect_two_stacks(const fs::path& folder, std::size_t first, std::size_t second, const std::string& said) {
  const Imported one = load(folder), two = load(folder, 2);
  EXPECT_EQ(one.verdict.slices.size(), first);
  EXPECT_EQ(two.verdict.slices.size(), second);
  EXPECT_NE(message_of(one.verdict, code::several_stacks).find(said), std::string::npos)
      << message_of(one.verdict, code::several_stacks);
  for (const Imported* r : {&one, &two}) {
    const bool of_b = r->verdict.slices.front().file.starts_with("b");
    for (const SliceRecord& s : r->verdict.slices) EXPECT_EQ(s.file.starts_with("b"), of_b) << s.file;
  }
}

TEST(MixedSeries, C42_PositionsRoundedToTheSamePlace) {
  Series s("c42", slices(0, 16));
  s.edit_all([](DcmDataset& d, int i) {
    const Vec3 p = test::position_of(d);
    put(d, DCM_ImagePositionPatient, test::text({p.x, p.y, std::round(0.0625 * i * 10) / 10}));
  });
  expect_refused(s.folder, code::slices_at_one_place, "show different pictures");
}

TEST(MixedSeries, C43_AcquisitionsThatOverlapAreNotJoined) {
  Series s("c43", slices(0, 20));
  for (int i = 12; i < 20; ++i) {
    const std::string name = test::files_in(s.folder)[static_cast<std::size_t>(i)].filename().string();
    s.edit(
        name,
        [&](DcmDataset& d) {
          put(d, DCM_SOPInstanceUID, "1.2.3.4.5." + std::to_string(i));
          put(d, DCM_AcquisitionNumber, "9");
          other_picture(d);
        },
        "b" + name);
  }
  expect_two_stacks(s.folder, 20, 8, "acquisition 9");
}

TEST(MixedSeries, C46_SpacingThatIsNone) {
  for (const char* spacing : {"0\\0", "-0.5\\0.5"}) {
    Series s("c46", slices(0, 12));
    s.edit_all([&](DcmDataset& d, int) { put(d, DCM_PixelSpacing, spacing); });
    expect_refused(s.folder, code::spacing_missing, "no pixel spacing");
  }
  // The distance of pixels on the detector is no distance in the patient.
  Series s("c48", slices(0, 12));
  s.edit_all([](DcmDataset& d, int) {
    d.findAndDeleteElement(DCM_PixelSpacing);
    put(d, DCM_ImagerPixelSpacing, "0.9\\0.9");
  });
  expect_refused(s.folder, code::spacing_missing, "no pixel spacing");
}

TEST(MixedSeries, C53_TimesAndTubeVoltages) {
  Series time("c53", slices(0, 12));
  time.edit_all([](DcmDataset& d, int) { put(d, DCM_TemporalPositionIdentifier, "1"); });
  second_scan(time, [](DcmDataset& d, int) { put(d, DCM_TemporalPositionIdentifier, "2"); });
  expect_two_stacks(time.folder, 12, 12, "time 2");

  Series energy("c54", slices(0, 12));
  energy.edit_all([](DcmDataset& d, int) { put(d, DCM_KVP, "80"); });
  second_scan(energy, [](DcmDataset& d, int) { put(d, DCM_KVP, "140"); });
  expect_two_stacks(energy.folder, 12, 12, "140 kV");

  // Two energies of two kernels each: no one of them tells all four apart.
  Series four("c54-four", slices(0, 12));
  four.edit_all([](DcmDataset& d, int) { put(d, DCM_KVP, "80"), put(d, DCM_ConvolutionKernel, "D"); });
  int i = 0;
  for (const auto& f : test::files_in(four.folder)) {
    for (const auto& [kv, kernel] : {std::pair{"140", "D"}, {"80", "B"}, {"140", "B"}}) {
      const std::string name = f.filename().string();
      four.edit(
          name,
          [&, kv = kv, kernel = kernel](DcmDataset& d) {
            put(d, DCM_SOPInstanceUID, "1.2.3.4.5." + std::to_string(i++));
            put(d, DCM_KVP, kv);
            put(d, DCM_ConvolutionKernel, kernel);
            other_picture(d, static_cast<Uint16>(1 + i % 3));
          },
          kv + std::string(kernel) + name);
    }
  }
  EXPECT_EQ(load(four.folder).verdict.stacks, 4);
  EXPECT_EQ(load(four.folder, 4).verdict.slices.size(), 12u);
}

TEST(MixedSeries, C58_NumbersThatAreNoValues) {
  Series palette("c58", slices(0, 12));
  palette.edit_all([](DcmDataset& d, int) { put(d, DCM_PhotometricInterpretation, "PALETTE COLOR"); });
  expect_refused(palette.folder, code::colour, "palette");

  Series table("c59", slices(0, 12));
  table.edit_all([](DcmDataset& d, int) {
    d.findAndDeleteElement(DCM_RescaleSlope);
    d.findAndDeleteElement(DCM_RescaleIntercept);
    DcmItem* item = nullptr;
    ASSERT_TRUE(d.findOrCreateSequenceItem(DCM_ModalityLUTSequence, item, 0).good());
    put(*item, DCM_ModalityLUTType, "US");
  });
  expect_refused(table.folder, code::slope_invalid, "Modality LUT");

  Series numbers("c64", slices(0, 12));
  numbers.edit_all([](DcmDataset& d, int) {
    for (const DcmTagKey& tag : {DCM_BitsStored, DCM_HighBit, DCM_PixelRepresentation, DCM_PixelData})
      d.findAndDeleteElement(tag);
    d.putAndInsertUint16(DCM_BitsAllocated, 32);
    const std::vector<Float32> pixels(512 * 512, 40.0F);
    d.putAndInsertFloat32Array(DCM_FloatPixelData, pixels.data(), pixels.size());
  });
  expect_refused(numbers.folder, code::no_pixels, "no whole numbers");
}

// Reconstructions whose slices lie between each other would make an even series of twice as many.
TEST(MixedSeries, C69_SlicesOfAnotherReconstructionInTurn) {
  Series kernels("c70", slices(0, 12));
  kernels.edit_all([](DcmDataset& d, int) { put(d, DCM_ConvolutionKernel, "D"); });
  second_scan(kernels, [](DcmDataset& d, int) {
    put(d, DCM_ConvolutionKernel, "B");
    move(d, {0, 0, 0.5});
  });
  expect_two_stacks(kernels.folder, 12, 12, "kernel B");

  Series thick("c69", slices(0, 24));
  thick.edit_all([](DcmDataset& d, int) { put(d, DCM_SliceThickness, "1"); });
  for (int i = 0; i < 6; ++i) {
    const std::string name = test::files_in(thick.folder)[static_cast<std::size_t>(4 * i)].filename().string();
    thick.edit(
        name,
        [&](DcmDataset& d) {
          put(d, DCM_SOPInstanceUID, "1.2.3.4.5." + std::to_string(i));
          put(d, DCM_SliceThickness, "5");
          move(d, {0, 0, 2.5});
        },
        "z" + name);
  }
  const Imported thin = load(thick.folder);
  EXPECT_EQ(thin.verdict.slices.size(), 24u);
  EXPECT_TRUE(thin.verdict.has(code::several_stacks));
  EXPECT_EQ(load(thick.folder, 2).verdict.slices.size(), 6u);

  // A plan that goes from thin to thick and back is one scan.
  Series plan("c69-plan", slices(0, 24));
  plan.edit_all([](DcmDataset& d, int i) { put(d, DCM_SliceThickness, i < 10 || i >= 20 ? "1" : "2"); });
  EXPECT_EQ(load(plan.folder).verdict.slices.size(), 24u);
  // And a thickness that is written in two ways is one.
  Series written("c69-written", slices(0, 24));
  written.edit_all([](DcmDataset& d, int i) { put(d, DCM_SliceThickness, i % 2 == 0 ? "0.6" : "0.625"); });
  EXPECT_EQ(load(written.folder).verdict.slices.size(), 24u);
}

TEST(MixedSeries, C71_BothEarsSideBySide) {
  for (const double up : {0.0, 0.5}) {
    Series s("c71", slices(0, 12));
    second_scan(s, [&](DcmDataset& d, int) { move(d, {80, 0, up}); });
    expect_two_stacks(s.folder, 12, 12, "to the left");
  }
  // Slices that shift by as much, but not in turn, are one scan whose table moved.
  Series moved("c71-moved", slices(0, 24));
  moved.edit_all([](DcmDataset& d, int i) {
    if (i >= 12) move(d, {8, 0, 0});
  });
  const Imported r = load(moved.folder);
  EXPECT_EQ(r.verdict.slices.size(), 24u);
  EXPECT_TRUE(r.verdict.has(code::shifted_sideways));
}

// By its description, a word at a time.
TEST(MixedSeries, WhichKernelIsBones) {
  for (const auto& [description, bone] : {std::pair{"CARDIAC 1.0", false},
                                          {"sacroiliac", false},
                                          {"wedge", false},
                                          {"IAC 0.6", true},
                                          {"Mastoid L", true},
                                          {"EDGE+", true},
                                          {"soft", false}}) {
    Series s("kernel", slices(0, 12));
    s.edit_all([&, text = description](DcmDataset& d, int) {
      put(d, DCM_SeriesDescription, text);
      put(d, DCM_ConvolutionKernel, "B");
    });
    const DicomScan scan = scan_dicom(s.folder);
    ASSERT_EQ(scan.series.size(), 1u);
    EXPECT_EQ(scan.series[0].why.find("bone kernel") != std::string::npos, bone) << description;
  }
}

// What a refusal for the scale of the values shows.
TEST(MixedSeries, C28_ThePictureOfARefusal) {
  Series s("c28-picture", slices(0, 20));
  EXPECT_EQ(picture_of(load(s.folder).verdict), "");
  s.edit_all([](DcmDataset& d, int) {
    Uint16* pixels = nullptr;
    ASSERT_TRUE(d.findAndGetUint16Array(DCM_PixelData, const_cast<const Uint16*&>(pixels)).good());
    double slope = 1, intercept = 0;
    d.findAndGetFloat64(DCM_RescaleSlope, slope);
    d.findAndGetFloat64(DCM_RescaleIntercept, intercept);
    for (int i = 0; i < 512 * 512; ++i)
      pixels[i] = static_cast<Uint16>(std::max(0.0, pixels[i] * slope + intercept + 1024));
    put(d, DCM_RescaleIntercept, "0");
    put(d, DCM_RescaleSlope, "1");
  });
  try {
    static_cast<void>(load(s.folder));
    ADD_FAILURE() << "not refused";
  } catch (const Refused& e) {
    EXPECT_TRUE(e.verdict().has(code::hu_shifted));
    const std::string svg = picture_of(e.verdict());
    EXPECT_NE(svg.find("--hu-offset -1024"), std::string::npos);
    EXPECT_TRUE(svg.starts_with("<svg") && svg.ends_with("</svg>\n"));
  }
}

// Resampled layers reach as far as the slices do.
TEST(MixedSeries, TheLastSliceIsInTheVolume) {
  Series s("last", slices(0, 24));
  s.edit_all([](DcmDataset& d, int i) {
    put(d, DCM_PixelSpacing, "0.9\\0.9");
    move(d, {0, 0.25 * i, 0});
  });
  const Imported r = load(s.folder);
  ASSERT_TRUE(r.verdict.resampled);
  EXPECT_LE(r.verdict.slices.back().output_index, r.image.frame.dims[2] - 0.5);
  test::expect_every_slice_in_its_place(r.image, s.folder);
}

// Two times at each place, and no tag that says so.
TEST(MixedSeries, ASeriesOverTimeIsCalledOne) {
  Series s("over-time", slices(0, 12));
  second_scan(s, [](DcmDataset&, int) {});
  expect_refused(s.folder, code::slices_at_one_place, "each of 12 places is shown 2 times");
}

}  // namespace
}  // namespace osteo
