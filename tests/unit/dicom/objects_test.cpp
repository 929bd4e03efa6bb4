// Segmentations: identities that DICOM does not allow, and every way pixels are packed.
#include <dcmtk/dcmdata/dcpixel.h>
#include <dcmtk/dcmdata/dcpixseq.h>
#include <dcmtk/dcmdata/dcpxitem.h>
#include <dcmtk/dcmdata/dcrleerg.h>
#include <dcmtk/dcmdata/dcrlerp.h>
#include <dcmtk/dcmjpls/djencode.h>
#include <gdcmImageChangeTransferSyntax.h>
#include <gdcmImageReader.h>
#include <gdcmImageWriter.h>

#include <functional>
#include <limits>
#include <set>

#include "edit.h"
#include "osteo/core/base/error.h"
#include "osteo/imaging/dicom/objects.h"
#include "osteo/imaging/dicom/volume.h"

namespace osteo {
namespace {

using test::put;
using test::scratch;
using test::Series;
using test::straight_series;

std::vector<fs::path> slices(int begin, int end) {
  const auto& all = straight_series();
  return {all.begin() + begin, all.begin() + end};
}

Labels bone_of(const Image& ct) {
  const auto mask = make_voxels<std::uint8_t>(ct.frame.voxel_count());
  for (std::size_t i = 0; i < ct.frame.voxel_count(); ++i) mask[i] = ct.voxels[i] > 300 ? 1 : 0;
  return {{ct.frame, mask}, {}};
}

void expect_same_mask(const Labels& a, const Labels& b) {
  // Slices without bone are not in the file.
  std::size_t other = 0, bone = 0;
  for (int k = 0; k < b.frame.dims[2]; ++k) {
    for (int j = 0; j < b.frame.dims[1]; ++j) {
      for (int i = 0; i < b.frame.dims[0]; ++i) {
        const Vec3 at = a.frame.index_from_world(b.frame.world_from_index({double(i), double(j), double(k)}));
        other += a.at(int(std::lround(at.x)), int(std::lround(at.y)), int(std::lround(at.z))) != b.at(i, j, k) ? 1 : 0;
        bone += b.at(i, j, k);
      }
    }
  }
  EXPECT_EQ(other, 0u);
  EXPECT_EQ(bone, static_cast<std::size_t>(std::count(a.span().begin(), a.span().end(), 1)));
}

std::string text_of(const fs::path& file, const DcmTagKey& tag) {
  DcmFileFormat f;
  EXPECT_TRUE(f.loadFile(file.c_str()).good());
  OFString value;
  f.getDataset()->findAndGetOFString(tag, value);
  return value.c_str();
}

// The segments that the groups of a report refer to, each under a tracking UID of its own.
std::vector<int> tracked(const fs::path& report) {
  DcmFileFormat f;
  EXPECT_TRUE(f.loadFile(report.c_str()).good());
  std::vector<int> segments;
  std::set<std::string> uids;
  DcmStack stack;
  while (f.getDataset()->search(DCM_ReferencedSegmentNumber, stack, ESM_afterStackTop, true).good()) {
    Uint16 number = 0;
    static_cast<DcmElement*>(stack.top())->getUint16(number);
    segments.push_back(number);
  }
  std::size_t groups = 0;
  stack.clear();
  while (f.getDataset()->search(DCM_ContentSequence, stack, ESM_afterStackTop, true).good()) {
    auto* const items = static_cast<DcmSequenceOfItems*>(stack.top());
    for (unsigned long i = 0; i < items->card(); ++i) {
      OFString meaning, uid;
      items->getItem(i)->findAndGetOFString(DCM_CodeMeaning, meaning, 0, true);
      if (meaning != "Tracking Unique Identifier") continue;
      items->getItem(i)->findAndGetOFString(DCM_UID, uid);
      uids.insert(uid.c_str());
      ++groups;
    }
  }
  EXPECT_EQ(uids.size(), groups);
  EXPECT_EQ(groups, segments.size());
  return segments;
}

// Each structure says in SNOMED what it is, where its name tells.
TEST(Objects, StructuresHaveTheirCodes) {
  Frame f;
  f.dims = {9, 7, 4};
  const auto v = make_voxels<std::uint8_t>(f.voxel_count());
  for (std::size_t i = 0; i < f.voxel_count(); ++i) v[i] = static_cast<std::uint8_t>(1 + i % 3);
  const fs::path file = scratch("codes") / "a.dcm";
  save_segmentation({{f, v}, {{1, "Facial nerve, left", {}}, {2, "mandible", {}}, {3, "left marker", {}}}}, file);
  DcmFileFormat read;
  ASSERT_TRUE(read.loadFile(file.c_str()).good());
  const std::vector<std::string> wanted{"56052001", "91609006", "85756007"};
  for (std::size_t s = 0; s < wanted.size(); ++s) {
    DcmItem *segment = nullptr, *code = nullptr;
    OFString value;
    ASSERT_TRUE(read.getDataset()->findAndGetSequenceItem(DCM_SegmentSequence, segment, static_cast<long>(s)).good());
    ASSERT_TRUE(segment->findAndGetSequenceItem(DCM_SegmentedPropertyTypeCodeSequence, code).good());
    ASSERT_TRUE(code->findAndGetOFString(DCM_CodeValue, value).good());
    EXPECT_EQ(value, wanted[s].c_str());
  }
}

// A label map keeps its numbers; names, colours aside, and what drew each come back from every form. highdicom reads
// the same files in readers.dicom_objects.
TEST(Objects, SegmentationsKeepNamesNumbersAndOrigins) {
  Frame f;
  f.dims = {9, 7, 4};
  const auto v = make_voxels<std::uint8_t>(f.voxel_count());
  const std::array<std::uint8_t, 6> values{0, 3, 7, 90, 200, 255};
  for (std::size_t i = 0; i < f.voxel_count(); ++i) v[i] = values[i % 6];
  const std::vector<Structure> given{{3, "Nervus facialis, gr\u00f6\u00dfter Teil", {}, "tube, version 2", 0.6},
                                     {7,
                                      "air cells",
                                      {},
                                      "find-structures, version 2, corrected by hand",
                                      std::numeric_limits<double>::infinity(),
                                      "60 mm3, less than 83"},
                                     {90, "drawn", {}, "by hand"},
                                     {200, "of somebody", {}, ""}};
  for (const auto form : {SegmentationForm::binary, SegmentationForm::labelmap, SegmentationForm::labelmap16}) {
    SCOPED_TRACE(static_cast<int>(form));
    const fs::path file = scratch("origins") / "a.dcm";
    save_segmentation({{f, v}, given}, file, {nullptr, "Bone", form});
    const Labels back = load_segmentation(file);
    ASSERT_EQ(back.structures.size(), 5u) << "a value without a name is a segment too";
    for (std::size_t s = 0; s < back.structures.size(); ++s) {
      EXPECT_EQ(back.structures[s].value, form == SegmentationForm::binary ? s + 1 : values[s + 1]);
      EXPECT_EQ(back.structures[s].name, s < 4 ? given[s].name : "Structure 255");
      EXPECT_EQ(back.structures[s].origin, s < 4 ? given[s].origin : "");
      EXPECT_EQ(back.structures[s].within_mm, s < 4 ? given[s].within_mm : 0);
      EXPECT_EQ(back.structures[s].doubt, s < 4 ? given[s].doubt : "");
    }
    for (std::size_t i = 0; i < f.voxel_count(); ++i)
      ASSERT_EQ(back.voxels[i], form == SegmentationForm::binary ? i % 6 : values[i % 6]) << i;
    EXPECT_EQ(text_of(file, DCM_SegmentationType), form == SegmentationForm::binary ? "BINARY" : "LABELMAP");
    EXPECT_EQ(text_of(file, DCM_SpecificCharacterSet), "ISO_IR 192");
  }
}

// A segment for each structure, whether it has voxels or not, and however few frames there are.
TEST(Objects, SegmentsMayBeEmptyOrMoreThanFrames) {
  Frame f;
  f.dims = {9, 7, 1};
  const auto v = make_voxels<std::uint8_t>(f.voxel_count());
  for (std::size_t i = 0; i < f.voxel_count(); ++i) v[i] = static_cast<std::uint8_t>(i % 3 == 0 ? 40 : 0);
  std::vector<Structure> given;
  for (int n = 1; n <= 12; ++n) given.push_back({static_cast<std::uint8_t>(10 * n), "part " + std::to_string(n), {}});
  for (const auto form : {SegmentationForm::binary, SegmentationForm::labelmap}) {
    SCOPED_TRACE(static_cast<int>(form));
    const bool bits = form == SegmentationForm::binary;
    const fs::path file = scratch("empty-segments") / "a.dcm";
    save_segmentation({{f, v}, given}, file, {nullptr, "Bone", form});
    const Labels back = load_segmentation(file);
    ASSERT_EQ(back.structures.size(), given.size());
    for (std::size_t s = 0; s < given.size(); ++s) {
      EXPECT_EQ(back.structures[s].name, given[s].name);
      EXPECT_EQ(back.structures[s].value, bits ? s + 1 : given[s].value);
    }
    for (std::size_t i = 0; i < f.voxel_count(); ++i) ASSERT_EQ(back.voxels[i], i % 3 == 0 ? (bits ? 4 : 40) : 0) << i;
  }
}

// Labels hold 64 characters: of longer names the label is their begin, their end and what tells them apart.
TEST(Objects, LongNamesStayApart) {
  Frame f;
  f.dims = {9, 7, 4};
  const auto v = make_voxels<std::uint8_t>(f.voxel_count());
  for (std::size_t i = 0; i < f.voxel_count(); ++i) v[i] = static_cast<std::uint8_t>(i % 4);
  const std::string long_name = "vessel of the skull base that a person drew on the scan \u00e4 in steps, ";
  const std::vector<Structure> given{{1, long_name + "left", {}}, {2, long_name + "right", {}}, {3, "nerve", {}}};
  const fs::path folder = scratch("long-names"), file = folder / "seg.dcm", measures = folder / "measures.dcm";
  save_segmentation({{f, v}, given}, file);
  const Labels back = load_segmentation(file);
  ASSERT_EQ(back.structures.size(), 3u);
  EXPECT_NE(back.structures[0].name, back.structures[1].name);
  EXPECT_TRUE(back.structures[0].name.starts_with("vessel of the skull base")) << back.structures[0].name;
  EXPECT_NE(back.structures[0].name.find(", left "), std::string::npos) << back.structures[0].name;
  EXPECT_EQ(back.structures[2].name, "nerve");

  // The report's groups refer to their own segments; two of one name are two things that are tracked.
  MeasuresReport report;
  report.segmentation = file;
  const auto volume = [&](std::uint8_t value) {
    return static_cast<double>(std::count(v.get(), v.get() + f.voxel_count(), value)) * f.voxel_volume_mm3();
  };
  for (const Structure& s : given) report.structures.push_back({s.name, "", volume(s.value), 0});
  save_measures_report(report, measures);
  EXPECT_EQ(tracked(measures), (std::vector<int>{1, 2, 3}));

  save_segmentation({{f, v}, {{1, "same", {}}, {2, "same", {}}, {3, "nerve", {}}}}, file);
  for (std::size_t s : {0U, 1U}) report.structures[s].name = "same";
  save_measures_report(report, measures);
  EXPECT_EQ(tracked(measures), (std::vector<int>{1, 2, 3}));
}

// Careless anonymisation leaves hashes where dates and UIDs belong: what is not allowed is not taken over, by name.
TEST(Objects, TagsOfTheSourceThatDicomDoesNotAllow) {
  Series s("bad-tags", slices(0, 12));
  s.edit_all([](DcmDataset& d, int i) {
    put(d, DCM_StudyDate, "a8f3c9e177");
    put(d, DCM_StudyTime, "hash77x");
    put(d, DCM_PatientBirthDate, "REMOVED");
    put(d, DCM_PatientSex, "unknown sex of a person");
    put(d, DCM_StudyInstanceUID, "anon-study-77");
    put(d, DCM_FrameOfReferenceUID, "1.2.FOR.xyz");
    put(d, DCM_SeriesInstanceUID, "hash-series");
    put(d, DCM_SOPInstanceUID, "hash-" + std::to_string(i));
    put(d, DCM_PatientID, "P 77");
  });
  const DicomScan scan = scan_dicom(s.folder);
  ASSERT_EQ(scan.series.size(), 1u);
  const Image ct = load_dicom_series(scan.series[0]).image;
  const Labels bone = bone_of(ct);
  std::string said;
  Context context;
  context.on_log([&](LogLevel level, std::string_view text) {
    if (level == LogLevel::warning) said += text;
  });
  const fs::path out = scratch("bad-tags-out");
  for (const bool on_source : {false, true}) {
    SCOPED_TRACE(on_source);
    said.clear();
    const fs::path file = out / (on_source ? "source.dcm" : "stack.dcm");
    const DicomObjectOptions options{&scan.series[0], "Bone"};
    on_source ? save_segmentation_on_source(bone, file, options, context)
              : save_segmentation(bone, file, options, context);
    for (const char* name :
         {"StudyDate", "StudyTime", "PatientBirthDate", "PatientSex", "StudyInstanceUID", "FrameOfReferenceUID"})
      EXPECT_NE(said.find(name), std::string::npos) << said;
    EXPECT_EQ(said.find("a8f3c9e177"), std::string::npos) << "values are not shown";
    expect_same_mask(bone, load_segmentation(file));
    EXPECT_EQ(text_of(file, DCM_StudyDate), "");
    EXPECT_EQ(text_of(file, DCM_PatientID), "P 77");
    EXPECT_EQ(text_of(file, DCM_StudyInstanceUID).substr(0, 5), "2.25.");
  }
  // The same invalid UID, the same valid one: both objects belong to one study.
  EXPECT_EQ(text_of(out / "stack.dcm", DCM_StudyInstanceUID), text_of(out / "source.dcm", DCM_StudyInstanceUID));
  TriMesh mesh;
  mesh.points_mm = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  save_encapsulated_stl(mesh, out / "stl.dcm", {&scan.series[0], "Bone"}, context);
  EXPECT_EQ(text_of(out / "stl.dcm", DCM_StudyInstanceUID), text_of(out / "stack.dcm", DCM_StudyInstanceUID));
  EXPECT_EQ(text_of(out / "stl.dcm", DCM_StudyDate), "");
}

// PS3.3 A.45.1; pydicom and dciodvfy read it in pacs.doors.
TEST(EncapsulatedPdf, HoldsThePagesAndBelongsToTheStudy) {
  const fs::path out = fs::path(testing::TempDir()) / "encapsulated-pdf";
  fs::remove_all(out);
  fs::create_directories(out);
  const std::string pages = "%PDF-1.5 odd";  // of an even number of bytes, then of an odd one
  for (const std::string& pdf : {pages, pages + "!"}) {
    save_encapsulated_pdf(pdf, "Words", out / "a.dcm");
    DcmFileFormat file;
    ASSERT_TRUE(file.loadFile((out / "a.dcm").c_str()).good());
    const Uint8* bytes = nullptr;
    Uint32 length = 0;
    unsigned long stored = 0;
    ASSERT_TRUE(file.getDataset()->findAndGetUint8Array(DCM_EncapsulatedDocument, bytes, &stored).good());
    ASSERT_TRUE(file.getDataset()->findAndGetUint32(DCM_EncapsulatedDocumentLength, length).good());
    EXPECT_EQ(length, pdf.size());
    EXPECT_EQ(stored % 2, 0U);
    EXPECT_EQ(std::string(reinterpret_cast<const char*>(bytes), length), pdf);
    EXPECT_EQ(text_of(out / "a.dcm", DCM_PatientName), "OSTEOTOME^ANONYMOUS");
    EXPECT_FALSE(file.getDataset()->tagExists(DCM_FrameOfReferenceUID));
  }
  // Same pages, same UIDs; in another study, or other pages: others.
  const auto ids = [&](const std::string& pdf) {
    save_encapsulated_pdf(pdf, "Words", out / "b.dcm");
    return text_of(out / "b.dcm", DCM_SOPInstanceUID) + " " + text_of(out / "b.dcm", DCM_SeriesInstanceUID);
  };
  EXPECT_EQ(ids(pages), ids(pages));
  EXPECT_NE(ids(pages), ids(pages + "!"));
  EXPECT_THROW(save_encapsulated_pdf("<html>", "Words", out / "c.dcm"), Error);
  EXPECT_FALSE(fs::exists(out / "c.dcm"));
}

// Bits as bytes of 0 and 255, a fractional segmentation.
void make_fractional(const fs::path& from, const fs::path& to) {
  DcmFileFormat file;
  ASSERT_TRUE(file.loadFile(from.c_str()).good());
  DcmDataset& d = *file.getDataset();
  Uint16 rows = 0, columns = 0;
  Sint32 frames = 0;
  d.findAndGetUint16(DCM_Rows, rows);
  d.findAndGetUint16(DCM_Columns, columns);
  d.findAndGetSint32(DCM_NumberOfFrames, frames);
  const Uint8* bits = nullptr;
  ASSERT_TRUE(d.findAndGetUint8Array(DCM_PixelData, bits).good());
  std::vector<Uint8> bytes(static_cast<std::size_t>(rows) * columns * static_cast<std::size_t>(frames));
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = (bits[i / 8] >> (i % 8) & 1) != 0 ? 255 : 0;
  d.putAndInsertUint16(DCM_BitsAllocated, 8);
  d.putAndInsertUint16(DCM_BitsStored, 8);
  d.putAndInsertUint16(DCM_HighBit, 7);
  put(d, DCM_SegmentationType, "FRACTIONAL");
  put(d, DCM_SegmentationFractionalType, "OCCUPANCY");
  d.putAndInsertUint16(DCM_MaximumFractionalValue, 255);
  ASSERT_TRUE(d.putAndInsertUint8Array(DCM_PixelData, bytes.data(), bytes.size()).good());
  ASSERT_TRUE(file.saveFile(to.c_str(), EXS_LittleEndianExplicit).good());
}

// PackBits, literal runs only (PS3.5 G), of one segment.
std::vector<Uint8> run_length(const std::vector<Uint8>& bytes) {
  std::vector<Uint8> out(64, 0);
  out[0] = 1;
  out[4] = 64;
  for (std::size_t at = 0; at < bytes.size(); at += 128) {
    const std::size_t n = std::min<std::size_t>(128, bytes.size() - at);
    out.push_back(static_cast<Uint8>(n - 1));
    out.insert(out.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at),
               bytes.begin() + static_cast<std::ptrdiff_t>(at + n));
  }
  if (out.size() % 2 != 0) out.push_back(0);
  return out;
}

std::string box(const std::string& type, const std::string& holds) {
  const std::size_t n = holds.size() + 8;
  std::string b;
  for (const int shift : {24, 16, 8, 0}) b += static_cast<char>(n >> shift & 255U);
  return b + type + holds;
}

// Each frame in a fragment of its own, as `change` makes it.
void rewrite_frames(const fs::path& from, const fs::path& to,
                    const std::function<std::string(const std::string&)>& change) {
  DcmFileFormat file;
  ASSERT_TRUE(file.loadFile(from.c_str()).good());
  DcmElement* pixels = nullptr;
  ASSERT_TRUE(file.getDataset()->findAndGetElement(DCM_PixelData, pixels).good());
  DcmPixelSequence* frames = nullptr;
  const DcmRepresentationParameter* parameter = nullptr;
  ASSERT_TRUE(static_cast<DcmPixelData*>(pixels)
                  ->getEncapsulatedRepresentation(EXS_JPEG2000LosslessOnly, parameter, frames)
                  .good());
  DcmPixelItem* item = nullptr;
  ASSERT_TRUE(frames->getItem(item, 0).good());
  ASSERT_TRUE(item->putUint8Array(nullptr, 0).good());  // no table of offsets, which would be wrong
  for (unsigned long f = 1; f < frames->card(); ++f) {
    ASSERT_TRUE(frames->getItem(item, f).good());
    Uint8* bytes = nullptr;
    ASSERT_TRUE(item->getUint8Array(bytes).good());
    std::string made = change({reinterpret_cast<const char*>(bytes), item->getLength()});
    if (made.size() % 2 != 0) made += '\0';
    ASSERT_TRUE(
        item->putUint8Array(reinterpret_cast<const Uint8*>(made.data()), static_cast<unsigned long>(made.size()))
            .good());
  }
  ASSERT_TRUE(file.saveFile(to.c_str(), EXS_JPEG2000LosslessOnly).good());
}

TEST(Objects, SegmentationsAreReadHoweverTheyArePacked) {
  const Series s("packed", slices(0, 8));
  const Labels bone = bone_of(load_dicom_series(scan_dicom(s.folder).series.at(0)).image);
  const fs::path out = scratch("packed-out"), plain = out / "plain.dcm", fractional = out / "fractional.dcm";
  save_segmentation(bone, plain);
  const auto expect_read = [&](const fs::path& file) {
    SCOPED_TRACE(file.filename().string());
    ASSERT_TRUE(is_segmentation(file));
    expect_same_mask(bone, load_segmentation(file));
  };
  expect_read(plain);
  make_fractional(plain, fractional);
  expect_read(fractional);

  DcmFileFormat file;
  ASSERT_TRUE(file.loadFile(plain.c_str()).good());
  ASSERT_TRUE(file.saveFile((out / "deflated.dcm").c_str(), EXS_DeflatedLittleEndianExplicit).good());
  expect_read(out / "deflated.dcm");

  DcmRLEEncoderRegistration::registerCodecs();
  ASSERT_TRUE(file.loadFile(fractional.c_str()).good());
  ASSERT_TRUE(file.getDataset()->chooseRepresentation(EXS_RLELossless, nullptr).good());
  ASSERT_TRUE(file.saveFile((out / "rle.dcm").c_str(), EXS_RLELossless).good());
  expect_read(out / "rle.dcm");

  DJLSEncoderRegistration::registerCodecs();
  ASSERT_TRUE(file.loadFile(fractional.c_str()).good());
  ASSERT_TRUE(file.getDataset()->chooseRepresentation(EXS_JPEGLSLossless, nullptr).good());
  ASSERT_TRUE(file.saveFile((out / "jpeg-ls.dcm").c_str(), EXS_JPEGLSLossless).good());
  expect_read(out / "jpeg-ls.dcm");

  gdcm::ImageReader reader;
  reader.SetFileName(fractional.c_str());
  ASSERT_TRUE(reader.Read());
  gdcm::ImageChangeTransferSyntax change;
  change.SetTransferSyntax(gdcm::TransferSyntax::JPEG2000Lossless);
  change.SetInput(reader.GetImage());
  ASSERT_TRUE(change.Change());
  gdcm::ImageWriter writer;
  writer.SetFileName((out / "j2k.dcm").c_str());
  writer.SetFile(reader.GetFile());
  writer.SetImage(change.GetOutput());
  ASSERT_TRUE(writer.Write());
  expect_read(out / "j2k.dcm");

  // A codestream in a JP2 file, behind a box that holds the head of another; and one of more bits than there is room
  // for, which GDCM 3.0.21 would write beyond it.
  rewrite_frames(out / "j2k.dcm", out / "jp2.dcm", [](const std::string& codestream) {
    std::string other = codestream.substr(0, 64);
    other[11] = static_cast<char>(other[11] ^ 1);  // columns
    return box("jP  ", "\r\n\x87\n") + box("ftyp", "jp2 " + std::string(4, '\0') + "jp2 ") +
           box("uuid", std::string(16, 'u') + other) +
           box("jp2h",
               box("ihdr", codestream.substr(12, 4) + codestream.substr(8, 4) + std::string("\0\1\7\7\1\0", 6)) +
                   box("colr", std::string("\1\0\0\0\0\0\x11", 7))) +
           box("jp2c", codestream);
  });
  expect_read(out / "jp2.dcm");
  rewrite_frames(out / "j2k.dcm", out / "wide.dcm", [](std::string codestream) {
    codestream[42] = 15;
    return codestream;
  });
  const auto said = [&] {
    try {
      static_cast<void>(load_segmentation(out / "wide.dcm"));
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string();
  }();
  EXPECT_NE(said.find("they have 16 bits, the header says 8"), std::string::npos) << said;

  // Bits in run lengths: the packed bytes of each frame are what is encoded.
  ASSERT_TRUE(file.loadFile(plain.c_str()).good());
  DcmDataset& d = *file.getDataset();
  const Uint8* bits = nullptr;
  ASSERT_TRUE(d.findAndGetUint8Array(DCM_PixelData, bits).good());
  Sint32 frames = 0;
  d.findAndGetSint32(DCM_NumberOfFrames, frames);
  const std::size_t area = static_cast<std::size_t>(bone.frame.dims[0]) * static_cast<std::size_t>(bone.frame.dims[1]);
  auto* const sequence = new DcmPixelSequence(DcmTag(DCM_PixelData, EVR_OB));
  sequence->insert(new DcmPixelItem(DcmTag(DCM_Item, EVR_OB)));
  for (std::size_t f = 0; f < static_cast<std::size_t>(frames); ++f) {
    std::vector<Uint8> packed((area + 7) / 8);
    for (std::size_t i = 0, at = f * area; i < area; ++i, ++at)
      packed[i / 8] = static_cast<Uint8>(packed[i / 8] | (bits[at / 8] >> (at % 8) & 1) << (i % 8));
    const std::vector<Uint8> coded = run_length(packed);
    auto* const item = new DcmPixelItem(DcmTag(DCM_Item, EVR_OB));
    item->putUint8Array(coded.data(), static_cast<unsigned long>(coded.size()));
    sequence->insert(item);
  }
  auto* const pixels = new DcmPixelData(DcmTag(DCM_PixelData, EVR_OB));
  const DcmRLERepresentationParameter rle;  // copied
  pixels->putOriginalRepresentation(EXS_RLELossless, &rle, sequence);
  d.insert(pixels, OFTrue);
  ASSERT_TRUE(file.saveFile((out / "bits-rle.dcm").c_str(), EXS_RLELossless).good());
  expect_read(out / "bits-rle.dcm");

  // Damaged: rejected, with the reason.
  fs::resize_file(out / "j2k.dcm", fs::file_size(out / "j2k.dcm") * 2 / 3);
  EXPECT_THROW(static_cast<void>(load_segmentation(out / "j2k.dcm")), Error);
}

}  // namespace
}  // namespace osteo
