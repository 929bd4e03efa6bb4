#include <cmath>

#include "edit.h"
#include "oblique.h"
#include "osteo/core/base/error.h"
#include "osteo/imaging/dicom/import.h"
#include "osteo/imaging/dicom/volume.h"
#include "osteo/imaging/io/volume_io.h"

namespace osteo {
namespace {

using test::data;
using test::expect_same_world;
using test::oblique;
using test::put;
using test::scratch;
using test::Series;
using test::straight_series;

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

// The codecs run in several threads at once: the same voxels as one thread gives, time after time.
TEST(Dicom, DecodingInParallelGivesTheSameVoxels) {
  const auto folder = data("dicom_transfer_syntaxes");
  if (!fs::exists(folder)) GTEST_SKIP() << "no " << folder;
  for (const char* kind :
       {"JPEG2000LosslessOnly", "JPEGLSLossless", "JPEGProcess14SV1", "JPEGProcess2_4", "RLELossless"}) {
    SCOPED_TRACE(kind);
    fs::path file;
    for (const auto& f : test::files_in(folder)) {
      if (f.filename().string().find(kind) != std::string::npos) file = f;
    }
    ASSERT_FALSE(file.empty());
    Series s("parallel", {file});
    for (int i = 1; i < 16; ++i) {
      s.edit(
          file.filename().string(),
          [&](DcmDataset& d) {
            const Vec3 p = test::position_of(d);
            put(d, DCM_ImagePositionPatient, test::text({p.x, p.y, p.z + i}));
            put(d, DCM_SOPInstanceUID, "1.2.3." + std::to_string(i));
          },
          "copy-" + std::to_string(i));
    }
    Context one;
    one.threads = 1;
    const Image reference = import_ct(s.folder, {}, one).image;
    for (int n = 0; n < 4; ++n) {
      const Image again = import_ct(s.folder, {}).image;
      ASSERT_TRUE(std::equal(reference.span().begin(), reference.span().end(), again.span().begin()));
    }
  }
}

TEST(Dicom, OneSliceStandsForItsSeries) {
  const auto folder = scratch("one");
  PhantomParams p;
  p.region = PhantomRegion::temporal;
  p.spacing_mm = 4;
  save_dicom_series(make_phantom(p).ct, folder / "a");
  p.spacing_mm = 3;
  save_dicom_series(make_phantom(p).ct, folder / "b");
  const auto a = test::files_in(folder / "a"), b = test::files_in(folder / "b");
  for (const auto& f : a) fs::rename(f, folder / "b" / ("a" + f.filename().string()));
  const Imported r = import_ct(folder / "b" / ("a" + a[3].filename().string()), {});
  EXPECT_EQ(r.verdict.slices.size(), a.size());
  EXPECT_EQ(r.verdict.slices[0].file[0], 'a');
  EXPECT_TRUE(r.verdict.set_aside.empty());
}

TEST(Dicom, ADicomdirLeadsToItsFiles) {
  const auto folder = scratch("index");
  PhantomParams p;
  p.region = PhantomRegion::temporal;
  p.spacing_mm = 4;
  save_dicom_series(make_phantom(p).ct, folder / "SLICES");
  DcmFileFormat index;
  DcmDataset& d = *index.getDataset();
  put(d, DCM_FileSetID, "TEST");
  const auto files = test::files_in(folder / "SLICES");
  for (const auto& f : files) {
    DcmItem* record = nullptr;
    ASSERT_TRUE(d.findOrCreateSequenceItem(DCM_DirectoryRecordSequence, record, -2).good());
    put(*record, DCM_DirectoryRecordType, "IMAGE");
    put(*record, DCM_ReferencedFileID, "SLICES\\" + f.filename().string());
  }
  index.getMetaInfo()->putAndInsertString(DCM_MediaStorageSOPClassUID, UID_MediaStorageDirectoryStorage);
  put(d, DCM_SOPClassUID, UID_MediaStorageDirectoryStorage);
  put(d, DCM_SOPInstanceUID, "1.2.3.4");
  ASSERT_TRUE(index.saveFile((folder / "DICOMDIR").c_str(), EXS_LittleEndianExplicit).good());
  write_file(folder / "SLICES" / "stray.txt", "not in the index");
  const Imported whole = import_ct(folder / "DICOMDIR", {});
  EXPECT_EQ(whole.verdict.slices.size(), files.size());
  EXPECT_TRUE(whole.verdict.set_aside.empty());
  // A file that the index names but that is not there is told.
  fs::remove(files.back());
  const Imported less = import_ct(folder / "DICOMDIR", {});
  ASSERT_EQ(less.verdict.set_aside.size(), 1u);
  EXPECT_EQ(less.verdict.set_aside[0].code, code::missing_file);
}

TEST(Verdict, ComesBackFromItsJson) {
  Verdict v;
  v.add(code::tilted, Severity::info, "leans", "", {});
  v.add(code::slices_missing, Severity::warning, "a hole", "copy again", {"a", "b"});
  const VerdictSummary back = read_verdict(to_json(v));
  EXPECT_EQ(back.status, "repaired");
  ASSERT_EQ(back.findings.size(), 2u);
  EXPECT_EQ(back.findings[1].code, code::slices_missing);
  EXPECT_EQ(back.findings[1].severity, Severity::warning);
  EXPECT_EQ(back.findings[1].files, (std::vector<std::string>{"a", "b"}));
  for (const char* bad : {"", "{", "[]", "{}", "{\"osteotome_verdict\":2}",
                          "{\"osteotome_verdict\":1,\"status\":\"good\",\"findings\":[1]}"}) {
    EXPECT_THROW(static_cast<void>(read_verdict(bad)), Error) << bad;
  }
}

TEST(Values, WrongScalesAreCaught) {
  PhantomParams p;
  p.region = PhantomRegion::head;
  p.spacing_mm = 3;
  const Image ct = make_phantom(p).ct;
  const auto judged = [&](auto change, ImportParams params = {}) -> Verdict {
    const auto v = make_voxels<std::int16_t>(ct.frame.voxel_count());
    for (std::size_t i = 0; i < ct.frame.voxel_count(); ++i)
      v[i] = static_cast<std::int16_t>(std::clamp<double>(change(double(ct.voxels[i])), -32768, 32767));
    const auto file = scratch("values") / "ct.nrrd";
    save_image({ct.frame, v}, file);
    try {
      return import_ct(file, params).verdict;
    } catch (const Refused& e) {
      return e.verdict();
    }
  };
  EXPECT_TRUE(judged([](double v) { return v; }).values.plausible);
  EXPECT_TRUE(judged([](double v) { return -v; }).has(code::hu_wrong_sign));
  EXPECT_TRUE(judged([](double v) { return v + 1024; }).has(code::hu_shifted));
  EXPECT_FALSE(judged([](double v) { return v * 0.5 + 200; }).values.plausible);
  EXPECT_FALSE(judged([](double v) { return v * 3; }).values.plausible);
}

}  // namespace
}  // namespace osteo
