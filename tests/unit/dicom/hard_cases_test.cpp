// The hard list of CT import, one test a case, with the verdict each must get: slices and what belongs together. Beside
// it: hard_encodings_test.cpp, hard_values_test.cpp.
#include <cmath>
#include <optional>

#include "edit.h"
#include "hard_case.h"
#include "osteo/imaging/dicom/import.h"
#include "osteo/imaging/dicom/scan.h"
#include "osteo/imaging/io/volume_io.h"
#include "reference.h"

namespace osteo {
namespace {

using test::data;
using test::expect_every_slice_in_its_place;
using test::load;
using test::only_gap;
using test::put;
using test::Reference;
using test::refusal;
using test::Series;
using test::slices;
using test::straight_series;

TEST(HardCase, C01_TiltAndUnevenGaps) {
  const auto folder = data("dicom_ct_head_tilt_gaps");
  NEEDS(folder);
  const Imported r = load(folder);
  for (const auto code : {code::tilted, code::gaps_uneven, code::padding_tag}) EXPECT_TRUE(r.verdict.has(code)) << code;
  EXPECT_EQ(r.verdict.status(), "repaired");
  EXPECT_NEAR(r.verdict.tilt_deg, 18.5, 0.01);
  EXPECT_LE(r.verdict.position_error_mm, 0.01);
  EXPECT_EQ(r.verdict.slices.size(), 28u);
  EXPECT_NEAR(r.verdict.values.padding_hu, -1500, 0);
  expect_every_slice_in_its_place(r.image, folder);
}

TEST(HardCase, C02_TiltWithoutItsTag) {
  const auto folder = data("dicom_hard_geometry") / "gantrytilting" / "001";
  NEEDS(folder);
  const Imported r = load(folder);
  EXPECT_TRUE(r.verdict.has(code::tilted));
  EXPECT_NEAR(r.verdict.tilt_deg, 14.0, 0.05);
  // The pixels are a ramp, not a CT: the HU check must say so.
  EXPECT_FALSE(r.verdict.values.plausible);
  const Reference reference(folder);
  for (const Vec3 index : {Vec3{100, 200, 1}, Vec3{300, 260, 3}, Vec3{256, 300, 7}}) {
    const double wanted = reference.at(r.image.frame.world_from_index(index));
    EXPECT_NEAR(r.image.at(int(index.x), int(index.y), int(index.z)), std::max(wanted, -1024.0), 1.0);
  }
}

TEST(HardCase, C03_TiltWithIndexFilesInTheFolder) {
  const auto folder = data("dicom_ct_skull_phantom") / "S21610" / "S2010";
  NEEDS(folder);
  const Imported r = load(folder);
  EXPECT_TRUE(r.verdict.has(code::tilted));
  EXPECT_NEAR(r.verdict.tilt_deg, 18.5, 0.01);
  EXPECT_EQ(r.verdict.set_aside.size(), 1u);
  expect_every_slice_in_its_place(r.image, folder);
}

TEST(HardCase, C04_OneThickSliceMissing) {
  const auto& all = straight_series();
  const Series s("c04", {all[0], all[5], all[10], all[20]});
  const Verdict v = refusal(s.folder, code::hole_too_wide, "10 mm apart instead of 5 mm");
  EXPECT_EQ(only_gap(v).missing, 1);
  EXPECT_EQ(only_gap(v).after, "010");
  EXPECT_EQ(only_gap(v).before, "020");
}

// Thin and tilted by moving the slices of the straight series.
void lean(Series& s, double gap, double shear) {
  s.edit_all([&](DcmDataset& d, int) {
    const Vec3 p = test::position_of(d);
    put(d, DCM_ImagePositionPatient, test::text({p.x, p.y + shear * p.z * gap, p.z * gap}));
  });
}

TEST(HardCase, C05_OneThinTiltedSliceMissing) {
  Series s("c05", slices(0, 12));
  lean(s, 0.75, std::tan(15.5 * 3.14159265358979 / 180));
  s.drop("005");
  const Imported r = load(s.folder);
  EXPECT_TRUE(r.verdict.has(code::tilted));
  EXPECT_TRUE(r.verdict.has(code::slices_missing));
  EXPECT_NEAR(r.verdict.tilt_deg, 15.5, 0.01);
  EXPECT_NEAR(only_gap(r.verdict).gap_mm, 1.5, 1e-6);
  EXPECT_TRUE(only_gap(r.verdict).filled);
  expect_every_slice_in_its_place(r.image, s.folder);
}

// From a twentieth of a degree on they are resampled upright and it is told; below, nothing moves by as much as anyone
// could see.
TEST(HardCase, C05_TheLeastTiltThatIsTold) {
  constexpr double kPerDegree = 3.14159265358979 / 180;
  Series leaning("c05-least", slices(0, 12)), straight("c05-less", slices(0, 12));
  lean(leaning, 0.75, std::tan(0.06 * kPerDegree));
  lean(straight, 0.75, std::tan(0.04 * kPerDegree));
  EXPECT_TRUE(load(leaning.folder).verdict.has(code::tilted));
  EXPECT_FALSE(load(straight.folder).verdict.has(code::tilted));
}

// A table that moved sideways between slices as far apart as ever: that, and not uneven gaps.
TEST(HardCase, C05_SlicesShiftedSideways) {
  Series s("c05-sideways", slices(0, 12));
  s.edit_all([](DcmDataset& d, int i) {
    const Vec3 p = test::position_of(d);
    put(d, DCM_ImagePositionPatient, test::text({p.x + (i % 3 == 0 ? 0.4 : 0), p.y, p.z}));
  });
  const Imported r = load(s.folder);
  EXPECT_TRUE(r.verdict.has(code::shifted_sideways));
  EXPECT_FALSE(r.verdict.has(code::gaps_uneven));
  expect_every_slice_in_its_place(r.image, s.folder);
}

// Where a finer run lies between wider slices, a skipped number tells a missing slice that distances alone would not.
TEST(HardCase, C06_MissingByItsNumberInAFinerRun) {
  Series s("c06-number", slices(0, 24));
  double z = 0;
  s.edit_all([&](DcmDataset& d, int i) {
    const Vec3 p = test::position_of(d);
    put(d, DCM_ImagePositionPatient, test::text({p.x, p.y, z}));
    put(d, DCM_InstanceNumber, std::to_string(i + 1));
    z += i >= 10 && i < 14 ? 1 : 2;
  });
  EXPECT_FALSE(load(s.folder).verdict.has(code::slices_missing));
  s.drop("012");
  const Imported r = load(s.folder);
  EXPECT_TRUE(r.verdict.has(code::slices_missing));
  EXPECT_EQ(only_gap(r.verdict).after, "011");
}

TEST(HardCase, C06_OneOfSixtyMissing) {
  Series s("c06", slices(0, 60));
  s.drop("030");
  const Imported r = load(s.folder);
  EXPECT_EQ(r.verdict.status(), "repaired");
  EXPECT_TRUE(r.verdict.has(code::slices_missing));
  EXPECT_EQ(only_gap(r.verdict).after, "029");
  EXPECT_EQ(r.image.frame.dims[2], 60);
  EXPECT_NEAR(r.verdict.slices[30].output_index, 31, 1e-6);
  expect_every_slice_in_its_place(r.image, s.folder);
}

TEST(HardCase, C07_FiveOfSixtyMissing) {
  Series together("c07a", slices(0, 60));
  for (const char* name : {"030", "031", "032", "033", "034"}) together.drop(name);
  const Verdict v = refusal(together.folder, code::hole_too_wide, "'029' and '035'");
  EXPECT_EQ(only_gap(v).missing, 5);
  ImportParams wide;
  wide.max_hole_mm = 6;
  EXPECT_TRUE(load(together.folder, wide).verdict.has(code::slices_missing));

  Series scattered("c07b", slices(0, 60));
  for (const char* name : {"010", "020", "022", "040", "050"}) scattered.drop(name);
  const Imported r = load(scattered.folder);
  EXPECT_EQ(r.verdict.gaps.size(), 5u);
  EXPECT_EQ(r.image.frame.dims[2], 60);
  expect_every_slice_in_its_place(r.image, scattered.folder);
}

TEST(HardCase, C08_FourSlicesAtOnePlace) {
  Series s("c08", slices(20, 24));
  s.edit_all([](DcmDataset& d, int) { put(d, DCM_ImagePositionPatient, "0\\0\\0"); });
  refusal(s.folder, code::not_a_volume, "one place");
}

TEST(HardCase, C09_TwoOrientationsInOneSeries) {
  Series s("c09", slices(0, 60));
  s.edit_all([](DcmDataset& d, int i) {
    if (i < 40) return;
    put(d, DCM_ImageOrientationPatient, "0\\1\\0\\0\\0\\-1");
    put(d, DCM_ImagePositionPatient, test::text({double(i), 0, 0}));
  });
  const Imported r = load(s.folder);
  EXPECT_TRUE(r.verdict.has(code::several_stacks));
  EXPECT_TRUE(r.verdict.has(code::other_orientation));
  EXPECT_EQ(r.verdict.slices.size(), 40u);
  EXPECT_EQ(r.verdict.set_aside.size(), 20u);
  EXPECT_EQ(orientation_code(r.image.frame), "LPS");
  ImportParams second;
  second.stack = 2;
  const Imported other = load(s.folder, second);
  EXPECT_EQ(other.verdict.slices.size(), 20u);
  EXPECT_EQ(orientation_code(other.image.frame), "PIR");
  ImportParams third;
  third.stack = 3;
  refusal(s.folder, code::not_a_volume, "no stack 3", third);
}

TEST(HardCase, C10_ScaleOfItsOwnForEachSliceAndOblongPixels) {
  Series s("c10", slices(0, 20));
  s.edit_all([](DcmDataset& d, int i) {
    put(d, DCM_RescaleSlope, std::to_string(1 + 0.03125 * i));
    put(d, DCM_RescaleIntercept, std::to_string(-1024 + i * 1.5));
    put(d, DCM_PixelSpacing, "0.8\\0.5");
  });
  const Imported r = load(s.folder);
  EXPECT_NEAR(r.image.frame.spacing_mm.x, 0.5, 1e-9);
  EXPECT_NEAR(r.image.frame.spacing_mm.y, 0.8, 1e-9);
  EXPECT_TRUE(r.verdict.has(code::values_rounded));
  expect_every_slice_in_its_place(r.image, s.folder);
  const auto real = data("dicom_hard_geometry") / "slope_per_slice_nonsquare";
  if (!fs::exists(real)) return;
  refusal(real, code::not_ct, "MR");
  ImportParams any;
  any.any_modality = true;
  const Imported mr = load(real, any);
  EXPECT_NEAR(mr.image.frame.spacing_mm.y / mr.image.frame.spacing_mm.x, 4.0 / 6.4, 0.01);
}

std::optional<Severity> severity_of(const Verdict& v, std::string_view code) {
  for (const Finding& f : v.findings) {
    if (f.code == code) return f.severity;
  }
  return std::nullopt;
}

TEST(HardCase, C11_TwoPicturesAtOnePlace) {
  Series s("c11", slices(0, 20));
  s.edit(
      "010",
      [](DcmDataset& d) {
        put(d, DCM_SOPInstanceUID, "1.2.3.4.5");
        Uint16* pixels = nullptr;
        unsigned long count = 0;
        const Uint16* read = nullptr;
        ASSERT_TRUE(d.findAndGetUint16Array(DCM_PixelData, read, &count).good());
        std::vector<Uint16> copy(read, read + count);
        pixels = copy.data();
        pixels[1000] = static_cast<Uint16>(pixels[1000] + 1);
        ASSERT_TRUE(d.putAndInsertUint16Array(DCM_PixelData, pixels, count).good());
      },
      "010-other");
  refusal(s.folder, code::slices_at_one_place, "'010' and '010-other'");
  // The same with a number of its own acquisition: two stacks, the larger is taken.
  s.edit("010-other", [](DcmDataset& d) { put(d, DCM_AcquisitionNumber, "99"); });
  const Imported r = load(s.folder);
  EXPECT_EQ(r.verdict.slices.size(), 20u);
  // One slice alone may have been a slice of this scan: a warning. A whole stack of its own is reported by
  // several_stacks.
  EXPECT_EQ(severity_of(r.verdict, code::other_acquisition), Severity::warning);
}

TEST(HardCase, C11_SamePictureUnderAnotherName) {
  Series s("c11b", slices(0, 20));
  s.edit(
      "010", [](DcmDataset& d) { put(d, DCM_SOPInstanceUID, "1.2.3.4.5"); }, "010-again");
  const Imported r = load(s.folder);
  EXPECT_EQ(r.verdict.slices.size(), 20u);
  ASSERT_EQ(r.verdict.set_aside.size(), 1u);
  EXPECT_EQ(r.verdict.set_aside[0].code, code::duplicate_slice);
}

TEST(HardCase, C11_TwoAcquisitionsOfTheSamePlaces) {
  Series s("c11c", slices(0, 20));
  for (int i = 0; i < 12; ++i) {
    s.edit(
        straight_series()[static_cast<std::size_t>(i)].filename().string(),
        [&](DcmDataset& d) {
          put(d, DCM_SOPInstanceUID, "1.2.3.4." + std::to_string(i));
          put(d, DCM_AcquisitionNumber, "7");
          put(d, DCM_RescaleIntercept, "-1000");
        },
        "second-" + std::to_string(i));
  }
  const Imported r = load(s.folder);
  EXPECT_TRUE(r.verdict.has(code::several_stacks));
  EXPECT_EQ(r.verdict.slices.size(), 20u);
  EXPECT_EQ(severity_of(r.verdict, code::other_acquisition), Severity::info);
}

TEST(HardCase, C12_TheSameFileTwice) {
  Series s("c12", slices(0, 20));
  fs::copy_file(fs::canonical(s.folder / "010"), s.folder / "copy of 010");
  const Imported r = load(s.folder);
  EXPECT_EQ(r.verdict.status(), "good");
  ASSERT_EQ(r.verdict.set_aside.size(), 1u);
  EXPECT_EQ(r.verdict.set_aside[0].code, code::duplicate_file);
  EXPECT_EQ(r.image.frame.dims[2], 20);
}

TEST(HardCase, C13_AllOfOneNumber) {
  Series s("c13", slices(0, 20));
  s.edit_all([](DcmDataset& d, int) { put(d, DCM_InstanceNumber, "1"); });
  const Imported r = load(s.folder);
  EXPECT_EQ(r.verdict.status(), "good");
  expect_every_slice_in_its_place(r.image, s.folder);
}

TEST(HardCase, C14_OneSliceWithoutPosition) {
  Series s("c14", slices(0, 60));
  s.edit("030", [](DcmDataset& d) { d.findAndDeleteElement(DCM_ImagePositionPatient); });
  const Imported r = load(s.folder);
  EXPECT_EQ(r.verdict.status(), "repaired");
  EXPECT_TRUE(r.verdict.has(code::position_missing));
  EXPECT_TRUE(r.verdict.has(code::slices_missing));
  ASSERT_EQ(r.verdict.set_aside.size(), 1u);
  EXPECT_EQ(r.verdict.set_aside[0].file, "030");
  EXPECT_EQ(r.image.frame.dims[2], 60);
  s.drop("030");
  expect_every_slice_in_its_place(r.image, s.folder);
}

TEST(HardCase, C15_OneFileCutShort) {
  Series s("c15", slices(0, 60));
  const fs::path file = s.folder / "030";
  const fs::path original = fs::canonical(file);
  fs::remove(file);
  fs::copy_file(original, file);
  fs::resize_file(file, fs::file_size(file) / 2);
  Imported r = load(s.folder);
  EXPECT_TRUE(r.verdict.has(code::pixels_damaged));
  EXPECT_TRUE(r.verdict.has(code::slices_missing));
  EXPECT_EQ(r.verdict.set_aside.at(0).file, "030");
  EXPECT_EQ(r.image.frame.dims[2], 60);
  // Cut inside the header, and to nothing.
  fs::resize_file(file, 700);
  r = load(s.folder);
  EXPECT_TRUE(r.verdict.has(code::slices_missing));
  ASSERT_FALSE(r.verdict.set_aside.empty());
  fs::resize_file(file, 0);
  EXPECT_TRUE(load(s.folder).verdict.has(code::slices_missing));
}

TEST(HardCase, C16_OneSliceOfAnotherSize) {
  Series s("c16", slices(0, 60));
  s.edit("030", [](DcmDataset& d) {
    d.putAndInsertUint16(DCM_Rows, 32);
    d.putAndInsertUint16(DCM_Columns, 32);
    const std::vector<Uint16> pixels(32 * 32, 1000);
    ASSERT_TRUE(d.putAndInsertUint16Array(DCM_PixelData, pixels.data(), pixels.size()).good());
  });
  const Imported r = load(s.folder);
  EXPECT_TRUE(r.verdict.has(code::other_size));
  EXPECT_TRUE(r.verdict.has(code::slices_missing));
  EXPECT_EQ(r.verdict.set_aside.at(0).file, "030");
  s.drop("030");
  expect_every_slice_in_its_place(r.image, s.folder);
}

TEST(HardCase, C17_LocalizerIndexAndTextInTheFolder) {
  Series s("c17", slices(0, 20));
  s.edit(
      "000",
      [](DcmDataset& d) {
        put(d, DCM_ImageType, "ORIGINAL\\PRIMARY\\LOCALIZER");
        put(d, DCM_ImageOrientationPatient, "0\\1\\0\\0\\0\\-1");
        put(d, DCM_SOPInstanceUID, "1.2.3");
      },
      "scout");
  write_file(s.folder / "readme.txt", "Exported by hand.\n");
  if (fs::exists(data("dicom_ct_skull_phantom") / "DICOMDIR"))
    fs::create_symlink(data("dicom_ct_skull_phantom") / "DICOMDIR", s.folder / "DICOMDIR");
  const Imported r = load(s.folder);
  EXPECT_EQ(r.verdict.status(), "good");
  EXPECT_EQ(r.verdict.slices.size(), 20u);
  std::vector<std::string> codes;
  for (const auto& f : r.verdict.set_aside) codes.push_back(f.file + " " + f.code);
  EXPECT_NE(std::find(codes.begin(), codes.end(), "scout LOCALIZER"), codes.end());
  EXPECT_NE(std::find(codes.begin(), codes.end(), "readme.txt NOT_DICOM"), codes.end());
}

std::string asked(const fs::path& folder, const std::string& series = {}) {
  ImportParams params;
  params.series = series;
  try {
    return "taken " + std::to_string(load(folder, params).verdict.slices.size());
  } catch (const Error& e) {
    return std::to_string(static_cast<int>(e.code())) + " " + e.what() + " " + e.advice();
  }
}

void of_another(DcmDataset& d, const DcmTagKey& tag, const char* value) {
  put(d, tag, value);
  OFString uid;
  d.findAndGetOFString(DCM_SOPInstanceUID, uid);
  put(d, DCM_SOPInstanceUID, std::string(uid.c_str()) + ".7");
}

// Two patients, studies or frames of reference, each under its own series UID or under one: never one of them without a
// word.
TEST(HardCase, C27_ScansThatDoNotBelongTogether) {
  for (const bool one_series : {false, true}) {
    for (const auto& [tag, value, said, scans] :
         {std::tuple{DCM_PatientID, "SOMEBODY ELSE", "2 patients", std::pair{"A1a", "B1a"}},
          std::tuple{DCM_StudyInstanceUID, "1.2.3.99", "2 studies", std::pair{"A1a", "A2a"}},
          std::tuple{DCM_FrameOfReferenceUID, "1.2.3.98", "different frames of reference", std::pair{"A1a", "A1b"}}}) {
      SCOPED_TRACE(std::string(said) + (one_series ? " in one series" : ""));
      Series s("c27", slices(0, 32));
      s.edit_all([&](DcmDataset& d, int i) {
        if (i < 20) return;
        of_another(d, tag, value);
        if (!one_series) put(d, DCM_SeriesInstanceUID, "1.2.3.97");
      });
      const std::string no_choice = asked(s.folder);
      EXPECT_EQ(no_choice.substr(0, 2), "4 ") << no_choice;
      EXPECT_NE(no_choice.find(said), std::string::npos) << no_choice;
      EXPECT_EQ(no_choice.find("SOMEBODY"), std::string::npos) << no_choice;
      EXPECT_EQ(asked(s.folder, scans.first), "taken 20");
      EXPECT_EQ(asked(s.folder, scans.second), "taken 12");
      const DicomScan scan = scan_dicom(s.folder);
      EXPECT_EQ(scan.series.size(), 2u);
      EXPECT_EQ(asked(s.folder, std::string(scans.second) + ":" + std::to_string(scan.series[1].number)), "taken 12");
      EXPECT_EQ(asked(s.folder, std::to_string(scan.series[1].number)).substr(0, 2), "2 ");
      ImportParams first;
      first.series = scans.first;
      const Verdict v = load(s.folder, first).verdict;
      EXPECT_EQ(v.has(code::several_scans), one_series);
      EXPECT_EQ(std::count_if(v.set_aside.begin(), v.set_aside.end(),
                              [](const auto& f) { return f.code == code::several_scans; }),
                one_series ? 12 : 0);
    }
  }
  // One slice of somebody else makes no scan: it is left out, by name.
  Series stray("c27-stray", slices(0, 20));
  stray.edit("010", [](DcmDataset& d) { of_another(d, DCM_PatientID, "SOMEBODY ELSE"); });
  const Verdict v = load(stray.folder).verdict;
  EXPECT_TRUE(v.has(code::several_scans));
  EXPECT_TRUE(v.has(code::slices_missing));
  EXPECT_EQ(v.slices.size(), 19u);
}

// What only looks like several scans: a name spelled differently, a frame of reference for each slice, or none in some.
TEST(HardCase, C27_OneScanThatLooksLikeSeveral) {
  Series spelled("c27-spelled", slices(0, 20));
  spelled.edit_all([](DcmDataset& d, int i) { put(d, DCM_PatientName, i % 2 == 0 ? "Doe^Jane" : "DOE^JANE^^"); });
  EXPECT_EQ(asked(spelled.folder), "taken 20");
  Series bare("c27-bare", slices(0, 20));
  bare.edit_all([](DcmDataset& d, int i) {
    if (i % 3 == 0) d.findAndDeleteElement(DCM_FrameOfReferenceUID);
  });
  EXPECT_EQ(load(bare.folder).verdict.status(), "good");
  Series careless("c27-careless", slices(0, 20));
  careless.edit_all([](DcmDataset& d, int i) { put(d, DCM_FrameOfReferenceUID, "1.2.3." + std::to_string(i)); });
  const Imported r = load(careless.folder);
  EXPECT_TRUE(r.verdict.has(code::frame_of_reference_wrong));
  EXPECT_EQ(r.verdict.slices.size(), 20u);
}

// Words that are true.
TEST(HardCase, C32_OneShiftedSliceIsNoTilt) {
  Series s("c32", slices(0, 20));
  const auto shift = [](DcmDataset& d, double by) {
    const Vec3 p = test::position_of(d);
    put(d, DCM_ImagePositionPatient, test::text({p.x, p.y + by, p.z}));
  };
  s.edit("019", [&](DcmDataset& d) { shift(d, 9); });
  const Verdict v = load(s.folder).verdict;
  EXPECT_FALSE(v.has(code::tilted));
  EXPECT_EQ(v.tilt_deg, 0);
  const auto it = std::find_if(v.findings.begin(), v.findings.end(),
                               [](const auto& f) { return f.code == code::shifted_sideways; });
  ASSERT_NE(it, v.findings.end());
  EXPECT_NE(it->message.find("one slice ('019') is shifted sideways by 9 mm"), std::string::npos) << it->message;
  // The table moved half-way: a step, and no tilt either.
  Series half("c32-half", slices(0, 20));
  half.edit_all([&](DcmDataset& d, int i) { shift(d, i < 10 ? 0 : 6); });
  const Verdict step = load(half.folder).verdict;
  EXPECT_FALSE(step.has(code::tilted));
  EXPECT_TRUE(step.has(code::shifted_sideways));
  // Positions rounded to tenths of a millimetre on a tilted series are still a tilt, and no shift.
  Series rounded("c32-rounded", slices(0, 20));
  rounded.edit_all([&](DcmDataset& d, int) {
    const Vec3 p = test::position_of(d);
    put(d, DCM_ImagePositionPatient, test::text({p.x, std::round((p.y + 0.13 * p.z) * 10) / 10, p.z}));
  });
  const Verdict tilted = load(rounded.folder).verdict;
  EXPECT_TRUE(tilted.has(code::tilted));
  EXPECT_FALSE(tilted.has(code::shifted_sideways));
  EXPECT_NEAR(tilted.tilt_deg, 7.4, 0.3);
}

TEST(HardCase, C32_DuplicatesLeaveTheSeriesComplete) {
  Series s("c32-twice", slices(0, 20));
  fs::copy_file(fs::canonical(s.folder / "010"), s.folder / "copy of 010");
  s.edit(
      "011", [](DcmDataset& d) { put(d, DCM_SOPInstanceUID, "1.2.3.4.5"); }, "011 again");
  const DicomScan scan = scan_dicom(s.folder);
  ASSERT_EQ(scan.series.size(), 1u);
  EXPECT_TRUE(scan.series[0].usable);
  EXPECT_NE(scan.series[0].why.find(", complete"), std::string::npos) << scan.series[0].why;
}

TEST(HardCase, C32_ACroppedThoraxIsOnTheScale) {
  // Lungs of -850 HU with airways, muscle and bone: no air around the body, as in a scan cut to the heart.
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 15);
  Frame f;
  f.dims = {96, 96, 40};
  f.spacing_mm = {2, 2, 2};
  const auto voxels = make_voxels<std::int16_t>(f.voxel_count());
  const auto make = [&](double scale) {
    for (std::size_t i = 0; i < f.voxel_count(); ++i) {
      const std::size_t x = i % 96;
      const double hu = x < 40 ? (i % 50 == 0 ? -990 : -850) : x < 85 ? 50 : x < 88 ? 700 : -100;
      voxels[i] = static_cast<std::int16_t>(std::lround(scale * hu + noise(random)));
    }
    const fs::path file = test::scratch("c32-thorax") / "ct.nrrd";
    save_image({f, voxels}, file);
    return load(file).verdict;
  };
  const Verdict v = make(1);
  EXPECT_FALSE(v.has(code::hu_scaled));
  EXPECT_TRUE(v.values.plausible);
  EXPECT_EQ(v.status(), "good");
  // The same on another scale is found out.
  EXPECT_FALSE(make(0.85).values.plausible);
}

TEST(HardCase, C32_PicturesOfOneFileAreToldApart) {
  const auto& all = straight_series();
  Series s("c32-frames", {all[0]});
  s.edit("000", [&](DcmDataset& d) {
    const Uint16* read = nullptr;
    unsigned long n = 0;
    ASSERT_TRUE(d.findAndGetUint16Array(DCM_PixelData, read, &n).good());
    std::vector<Uint16> pixels;
    OFString spacing, orientation;
    d.findAndGetOFStringArray(DCM_PixelSpacing, spacing);
    for (int i = 0; i < 11; ++i) {
      pixels.insert(pixels.end(), read, read + n);
      DcmItem *frame = nullptr, *group = nullptr;
      ASSERT_TRUE(d.findOrCreateSequenceItem(DCM_PerFrameFunctionalGroupsSequence, frame, i).good());
      ASSERT_TRUE(frame->findOrCreateSequenceItem(DCM_PlanePositionSequence, group, 0).good());
      put(*group, DCM_ImagePositionPatient, test::text({0, 0, i < 6 ? double(i) : i + 6.0}));
    }
    d.findAndDeleteElement(DCM_ImagePositionPatient);
    put(d, DCM_NumberOfFrames, "11");
    put(d, DCM_SOPClassUID, UID_EnhancedCTImageStorage);
    ASSERT_TRUE(d.putAndInsertUint16Array(DCM_PixelData, pixels.data(), pixels.size()).good());
  });
  refusal(s.folder, code::hole_too_wide, "between '000 (picture 6)' and '000 (picture 7)'");
}

// Half of the slices at half the size: as many of each, so the finer ones are taken.
TEST(HardCase, OfStacksOfAsManySlicesTheFinerIsTaken) {
  Series s("coarse-half", slices(0, 24));
  Uint16 full = 0;
  s.edit_all([&](DcmDataset& d, int i) {
    if (i % 2 != 0) return;
    Uint16 rows = 0, columns = 0;
    d.findAndGetUint16(DCM_Rows, rows);
    d.findAndGetUint16(DCM_Columns, columns);
    full = std::max(full, columns);
    const Uint16* read = nullptr;
    ASSERT_TRUE(d.findAndGetUint16Array(DCM_PixelData, read).good());
    std::vector<Uint16> half;
    for (int y = 0; y < rows / 2; ++y)
      for (int x = 0; x < columns / 2; ++x) half.push_back(read[2 * y * columns + 2 * x]);
    Float64 mm = 1;
    d.findAndGetFloat64(DCM_PixelSpacing, mm);
    put(d, DCM_PixelSpacing, std::to_string(2 * mm) + "\\" + std::to_string(2 * mm));
    ASSERT_TRUE(d.putAndInsertUint16(DCM_Rows, static_cast<Uint16>(rows / 2)).good());
    ASSERT_TRUE(d.putAndInsertUint16(DCM_Columns, static_cast<Uint16>(columns / 2)).good());
    ASSERT_TRUE(d.putAndInsertUint16Array(DCM_PixelData, half.data(), half.size()).good());
  });
  const Imported r = load(s.folder);
  EXPECT_TRUE(r.verdict.has(code::several_stacks));
  EXPECT_EQ(r.image.frame.dims[0], full);
}

}  // namespace
}  // namespace osteo
