#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>
#include <dcmtk/dcmfg/fgderimg.h>
#include <dcmtk/dcmfg/fgfracon.h>
#include <dcmtk/dcmfg/fgpixmsr.h>
#include <dcmtk/dcmfg/fgplanor.h>
#include <dcmtk/dcmfg/fgplanpo.h>
#include <dcmtk/dcmfg/fgseg.h>
#include <dcmtk/dcmseg/segdoc.h>
#include <dcmtk/dcmseg/segment.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "dcmtk_tools.h"
#include "decode.h"
#include "labelmap.h"
#include "osteo/core/base/param.h"
#include "osteo/imaging/dicom/objects.h"
#include "pixels.h"
#include "seg_layers.h"

namespace osteo::inline imaging {
namespace {

using dicom::decimal;
using dicom::require;

// One slice of the segmentation to be: where it lies, and which labels its pixels have.
struct Plane {
  Vec3 position;
  std::vector<std::uint8_t> labels;
  std::vector<std::size_t> source_headers;  // the slices of the source it lies on, or between
};

struct Stack {
  int columns = 0, rows = 0;
  Vec3 along_row, along_column;
  double column_mm = 1, row_mm = 1, thickness_mm = 1;
  std::vector<Plane> planes;
};

std::vector<Structure> structures_of(const Labels& labels) {
  if (!labels.structures.empty()) return labels.structures;
  std::array<bool, 256> there{};
  for (const auto v : labels.span()) there[v] = true;
  std::vector<Structure> list;
  for (std::size_t v = 1; v < 256; ++v) {
    if (there[v])
      list.push_back({static_cast<std::uint8_t>(v), v == 1 ? "Bone" : "Structure " + std::to_string(v), {}});
  }
  return list;
}

// The slice of the source that a point lies on, or the two that it lies between.
std::vector<std::size_t> slices_around(const DicomSeries& source, Vec3 point) {
  constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  std::size_t below = kNone, above = kNone;
  double under = -1e30, over = 1e30;
  for (std::size_t h = 0; h < source.headers.size(); ++h) {
    const DicomHeader& header = source.headers[h];
    if (!header.usable() || header.frames.size() != 1) continue;
    const DicomFrame& f = header.frames.front();
    const double d = dot(f.position_mm - point, cross(f.along_row, f.along_column));
    if (d <= kSamePlaceMm && d > under) under = d, below = h;
    if (d >= -kSamePlaceMm && d < over) over = d, above = h;
  }
  std::vector<std::size_t> found;
  if (below != kNone) found.push_back(below);
  if (above != kNone && above != below && (below == kNone || under < -kSamePlaceMm)) found.push_back(above);
  return found;
}

Stack stack_of(const Labels& labels, const DicomSeries* source) {
  const Frame& f = labels.frame;
  Stack s{f.dims[0],      f.dims[1],      f.direction.column[0], f.direction.column[1],
          f.spacing_mm.x, f.spacing_mm.y, f.spacing_mm.z,        {}};
  const std::size_t area = static_cast<std::size_t>(s.columns) * static_cast<std::size_t>(s.rows);
  for (int k = 0; k < f.dims[2]; ++k) {
    const std::uint8_t* const p = labels.voxels.get() + static_cast<std::size_t>(k) * area;
    if (std::all_of(p, p + area, [](std::uint8_t v) { return v == 0; })) continue;
    Plane plane{f.world_from_index({0, 0, static_cast<double>(k)}), {p, p + area}, {}};
    if (source != nullptr) {
      plane.source_headers = slices_around(
          *source, f.world_from_index({(s.columns - 1) / 2.0, (s.rows - 1) / 2.0, static_cast<double>(k)}));
    }
    s.planes.push_back(std::move(plane));
  }
  return s;
}

Stack stack_on_source(const Labels& labels, const DicomSeries& source) {
  const Placement p = place_slices(source.headers, {.max_gap_mm = 1e9, .max_hole_mm = 1e9});
  if (p.slices.size() < 2)
    throw Error(ExitCode::corrupt, "the source series is no volume", "'osteo import --list' shows what it is");
  Stack s{p.verdict.columns, p.verdict.rows,         p.along_row, p.along_column, p.column_spacing_mm,
          p.row_spacing_mm,  p.verdict.gap_usual_mm, {}};
  const Frame& f = labels.frame;
  for (std::size_t k = 0; k < p.slices.size(); ++k) {
    Plane plane{p.verdict.slices[k].position_mm, {}, {p.slices[k].header}};
    plane.labels.resize(static_cast<std::size_t>(s.columns) * static_cast<std::size_t>(s.rows));
    bool any = false;
    for (int j = 0; j < s.rows; ++j) {
      for (int i = 0; i < s.columns; ++i) {
        const Vec3 at =
            f.index_from_world(plane.position + s.along_row * (i * s.column_mm) + s.along_column * (j * s.row_mm));
        const int x = static_cast<int>(std::lround(at.x)), y = static_cast<int>(std::lround(at.y)),
                  z = static_cast<int>(std::lround(at.z));
        if (x < 0 || y < 0 || z < 0 || x >= f.dims[0] || y >= f.dims[1] || z >= f.dims[2]) continue;
        const std::uint8_t v = labels.at(x, y, z);
        plane.labels[static_cast<std::size_t>(j) * static_cast<std::size_t>(s.columns) + static_cast<std::size_t>(i)] =
            v;
        any = any || v != 0;
      }
    }
    if (any) s.planes.push_back(std::move(plane));
  }
  return s;
}

void take_over_identity(DcmSegmentation& seg, const DicomObjectOptions& o, const std::string& content,
                        const fs::path& path, const Context& context) {
  if (o.source != nullptr) {
    DcmFileFormat source;
    dicom::load_identity(*o.source, source, context);
    require(seg.importFromSourceImage(*source.getDataset()), path);
  } else {
    require(seg.getPatient().setPatientName(dicom::kAnonymousName), path);
    require(seg.getPatient().setPatientID(dicom::kAnonymousId), path);
    require(seg.getStudy().setStudyInstanceUID(dicom::uid_of(hash_text(content + "study")).c_str()), path);
    require(seg.getFrameOfReference().setFrameOfReferenceUID(dicom::uid_of(hash_text(content + "frame")).c_str()),
            path);
  }
  require(seg.getSeries().setSeriesInstanceUID(dicom::uid_of(hash_text(content + "series")).c_str()), path);
  require(seg.getSOPCommon().setSOPInstanceUID(dicom::uid_of(hash_text(content + "instance")).c_str()), path);
  require(seg.getSeries().setSeriesDescription(o.description.substr(0, 64).c_str()), path);
  require(seg.getSeries().setSeriesNumber("9001"), path);
}

void refer_to_series(DcmSegmentation& seg, const DicomSeries& source) {
  auto* const item = new IODSeriesAndInstanceReferenceMacro::ReferencedSeriesItem();
  item->setSeriesInstanceUID(dicom::valid_uid(source.uid).c_str());
  for (const DicomHeader& h : source.headers) {
    if (!h.usable()) continue;
    auto* const instance = new SOPInstanceReferenceMacro();
    instance->setReferencedSOPClassUID(h.sop_class.c_str());
    instance->setReferencedSOPInstanceUID(dicom::valid_uid(h.sop_uid).c_str());
    item->getReferencedInstanceItems().push_back(instance);
  }
  seg.getCommonInstanceReference().getReferencedSeriesItems().push_back(item);
}

// What a structure is, by the words of its name; the first row that fits counts. Bone where it is the only one.
struct StructureCode {
  std::string_view word, code, meaning;
};
constexpr std::array kStructureCodes{
    StructureCode{"facial nerve", "56052001", "Facial nerve"},
    StructureCode{"marrow", "14016003", "Bone marrow"},
    StructureCode{"mandible", "91609006", "Mandible"},
    StructureCode{"maxilla", "70925003", "Maxilla"},
    StructureCode{"tooth", "38199008", "Tooth"},
    StructureCode{"teeth", "38199008", "Tooth"},
    StructureCode{"air cells", "91716001", "Mastoid cells and antra"},
    StructureCode{"labyrinth", "22945000", "Inner ear"},
    StructureCode{"ear canal", "84301002", "External auditory canal"},
    StructureCode{"dura", "18545000", "Dura mater"},
    StructureCode{"carotid", "69105007", "Carotid artery"},
    StructureCode{"temporal bone", "60911003", "Temporal bone"},
    StructureCode{"skull", "89546000", "Skull"},
    StructureCode{"bone", "272673000", "Bone"},
};
CodeSequenceMacro type_of(const std::string& name, bool alone) {
  const std::string lower = lower_case(name);
  for (const StructureCode& c : kStructureCodes) {
    if (lower.find(c.word) != std::string::npos)
      return {std::string(c.code).c_str(), "SCT", std::string(c.meaning).c_str()};
  }
  if (alone) return {"272673000", "SCT", "Bone"};
  return {"85756007", "SCT", "Tissue"};
}

void write(const Stack& stack, const std::vector<Structure>& structures, const fs::path& path,
           const DicomObjectOptions& o, const Context& context) {
  if (stack.planes.empty())
    throw Error(ExitCode::usage, "the label map is empty: there is nothing to write to '" + path.string() + "'");
  dicom::quiet_dcmtk();
  Hasher hasher;
  for (const Plane& p : stack.planes) {
    hasher.add(&p.position, sizeof p.position);
    hasher.add(p.labels.data(), p.labels.size());
  }
  const std::string content = hasher.hex();

  DcmSegmentation* made = nullptr;
  const IODGeneralEquipmentModule::EquipmentInfo equipment("Osteotome", "osteo", "0", "0.1");
  const ContentIdentificationMacro identity("1", "BONE", o.description.substr(0, 64).c_str(), "OSTEOTOME^");
  require(DcmSegmentation::createBinarySegmentation(made, static_cast<Uint16>(stack.rows),
                                                    static_cast<Uint16>(stack.columns), equipment, identity),
          path);
  const std::unique_ptr<DcmSegmentation> seg(made);
  take_over_identity(*seg, o, content, path, context);
  if (o.source != nullptr) refer_to_series(*seg, *o.source);

  for (const Structure& s : structures) {
    const CodeSequenceMacro category("123037004", "SCT", "Anatomical Structure");
    const CodeSequenceMacro type = type_of(s.name, structures.size() == 1);
    DcmSegment* segment = nullptr;
    require(DcmSegment::create(segment, s.name.substr(0, 64).c_str(), category, type, DcmSegTypes::SAT_SEMIAUTOMATIC,
                               "Osteotome threshold"),
            path);
    Uint16 number = 0;
    require(seg->addSegment(segment, number), path);
  }

  const auto text = [](double v) { return OFString(decimal(v).c_str()); };
  FGPixelMeasures measures;
  measures.setPixelSpacing((decimal(stack.row_mm) + "\\" + decimal(stack.column_mm)).c_str());
  measures.setSliceThickness(text(stack.thickness_mm));
  measures.setSpacingBetweenSlices(text(stack.thickness_mm));
  require(seg->addForAllFrames(measures), path);
  const Vec3 u = stack.along_row, v = stack.along_column;
  const std::unique_ptr<FGPlaneOrientationPatient> orientation(
      FGPlaneOrientationPatient::createMinimal(text(u.x), text(u.y), text(u.z), text(v.x), text(v.y), text(v.z)));
  require(seg->addForAllFrames(*orientation), path);
  const std::string organization = dicom::uid_of(hash_text(content + "dimensions"));
  require(seg->getDimensions().addDimensionIndex(DCM_ReferencedSegmentNumber, organization.c_str(),
                                                 DCM_SegmentIdentificationSequence, "Segment"),
          path);
  require(seg->getDimensions().addDimensionIndex(DCM_ImagePositionPatient, organization.c_str(),
                                                 DCM_PlanePositionSequence, "Position"),
          path);

  std::vector<Uint8> bits;  // of all frames, a byte each
  std::vector<Uint8> frame(static_cast<std::size_t>(stack.columns) * static_cast<std::size_t>(stack.rows));
  for (std::size_t s = 0; s < structures.size(); ++s) {
    for (std::size_t k = 0; k < stack.planes.size(); ++k) {
      const Plane& plane = stack.planes[k];
      bool any = false;
      for (std::size_t i = 0; i < frame.size(); ++i) {
        frame[i] = plane.labels[i] == structures[s].value ? 1 : 0;
        any = any || frame[i] != 0;
      }
      if (!any) continue;
      FGFrameContent where;
      where.setDimensionIndexValues(static_cast<Uint32>(s + 1), 0);
      where.setDimensionIndexValues(static_cast<Uint32>(k + 1), 1);
      const std::unique_ptr<FGPlanePosPatient> position(
          FGPlanePosPatient::createMinimal(text(plane.position.x), text(plane.position.y), text(plane.position.z)));
      OFVector<FGBase*> groups;
      groups.push_back(&where);
      groups.push_back(position.get());
      FGDerivationImage derivation;
      if (!plane.source_headers.empty()) {
        DerivationImageItem* derived = nullptr;
        require(derivation.addDerivationImageItem(CodeSequenceMacro("113076", "DCM", "Segmentation"), "", derived),
                path);
        for (const std::size_t index : plane.source_headers) {
          const DicomHeader& h = o.source->headers[index];
          DcmDataset reference;
          reference.putAndInsertString(DCM_SOPClassUID, h.sop_class.c_str());
          reference.putAndInsertString(DCM_SOPInstanceUID, dicom::valid_uid(h.sop_uid).c_str());
          SourceImageItem* image = nullptr;
          const CodeSequenceMacro purpose("121322", "DCM", "Source image for image processing operation");
          require(derived->addSourceImageItem(&reference, purpose, image), path);
        }
        groups.push_back(&derivation);
      }
      require(seg->addFrame(frame.data(), static_cast<Uint16>(s + 1), groups), path);
      bits.insert(bits.end(), frame.begin(), frame.end());
    }
  }
  // DCMTK 3.6.7 shifts frames whose size is no multiple of 8: the bits are packed here, one frame right after the other
  // (PS3.5 8.1.1).
  DcmFileFormat file;
  require(seg->writeDataset(*file.getDataset()), path);
  std::vector<Uint8> packed((bits.size() + 15) / 16 * 2);
  for (std::size_t i = 0; i < bits.size(); ++i) packed[i / 8] = static_cast<Uint8>(packed[i / 8] | bits[i] << (i % 8));
  require(file.getDataset()->putAndInsertUint8Array(DCM_PixelData, packed.data(),
                                                    static_cast<unsigned long>(packed.size())),
          path);
  write_atomically(path, [&](const fs::path& temporary) {
    require(file.saveFile(temporary.c_str(), EXS_LittleEndianExplicit), path);
  });
}

bool read_position(DcmSegmentation& seg, Uint32 frame, Vec3& position) {
  auto* const fg =
      OFstatic_cast(FGPlanePosPatient*, seg.getFunctionalGroups().get(frame, DcmFGTypes::EFG_PLANEPOSPATIENT));
  return fg != nullptr && fg->getImagePositionPatient(position.x, position.y, position.z).good();
}

// Whether a frame has the axes and pixels of the first.
bool lies_as(DcmSegmentation& seg, Uint32 frame, Vec3 along_row, Vec3 along_column, double row_mm, double column_mm) {
  FGInterface& groups = seg.getFunctionalGroups();
  auto* const orientation =
      OFstatic_cast(FGPlaneOrientationPatient*, groups.get(frame, DcmFGTypes::EFG_PLANEORIENTPATIENT));
  auto* const measures = OFstatic_cast(FGPixelMeasures*, groups.get(frame, DcmFGTypes::EFG_PIXELMEASURES));
  Vec3 u, v;
  Float64 row = 0, column = 0;
  if (orientation == nullptr || orientation->getImageOrientationPatient(u.x, u.y, u.z, v.x, v.y, v.z).bad() ||
      measures == nullptr || measures->getPixelSpacing(row, 0).bad() || measures->getPixelSpacing(column, 1).bad())
    return false;
  constexpr double kSame = 1e-3;
  return length(u - along_row) < kSame && length(v - along_column) < kSame && std::abs(row - row_mm) < kSame * row_mm &&
         std::abs(column - column_mm) < kSame * column_mm;
}

// Compressed pixels of a segmentation as they would be uncompressed.
void unpack_pixels(const fs::path& path, DcmDataset& d) {
  const TemporaryFolder scratch;
  DicomHeader h = read_dicom_header(path, scratch.path());
  if (h.frames.empty() || h.columns <= 0 || h.rows <= 0) throw dicom::PixelError("it holds no pixels");
  if (h.bits_allocated != 1 && h.bits_allocated != 8)
    throw dicom::PixelError(std::to_string(h.bits_allocated) + " bits a pixel are no segmentation's");
  const bool bits = h.bits_allocated == 1;
  const dicom::CompressedFrames frames(h);
  const std::size_t area = h.pixels_per_frame();
  std::vector<Uint8> pixels(bits ? (area * h.frames.size() + 15) / 16 * 2 : (area * h.frames.size() + 1) / 2 * 2);
  for (std::size_t f = 0; f < h.frames.size(); ++f) {
    const std::vector<std::uint16_t> values = frames.decode(static_cast<int>(f));
    for (std::size_t i = 0, at = f * area; i < area; ++i, ++at) {
      if (!bits) {
        pixels[at] = static_cast<Uint8>(values[i]);
      } else if (values[i] != 0) {
        pixels[at / 8] = static_cast<Uint8>(pixels[at / 8] | 1U << (at % 8));
      }
    }
  }
  delete d.remove(DCM_PixelData);
  require(d.chooseRepresentation(EXS_LittleEndianExplicit, nullptr), path);
  d.updateOriginalXfer();
  require(d.putAndInsertUint8Array(DCM_PixelData, pixels.data(), static_cast<unsigned long>(pixels.size())), path);
}

// What a file says it is; empty for what is no DICOM file.
std::string class_of(const fs::path& path) {
  dicom::quiet_dcmtk();
  OFString uid;
  DcmFileFormat file;
  if (file.loadFile(path.c_str(), EXS_Unknown, EGL_noChange, 64, ERM_metaOnly).good() &&
      file.getMetaInfo()->findAndGetOFString(DCM_MediaStorageSOPClassUID, uid).good() && !uid.empty())
    return uid.c_str();
  if (file.loadFile(path.c_str(), EXS_Unknown, EGL_noChange, 64, ERM_fileOnly).bad()) return {};
  return file.getDataset()->findAndGetOFString(DCM_SOPClassUID, uid).good() ? std::string(uid.c_str()) : std::string();
}

}  // namespace

void save_segmentation(const Labels& labels, const fs::path& path, const DicomObjectOptions& options,
                       const Context& context) {
  write(stack_of(labels, options.source), structures_of(labels), path, options, context);
}

void save_segmentation_on_source(const Labels& labels, const fs::path& path, const DicomObjectOptions& options,
                                 const Context& context) {
  if (options.source == nullptr)
    throw Error(ExitCode::usage, "a segmentation on the slices of its source needs the source series");
  write(stack_on_source(labels, *options.source), structures_of(labels), path, options, context);
}

bool is_segmentation(const fs::path& path) {
  const std::string uid = class_of(path);
  return uid == UID_SegmentationStorage || uid == dicom::kLabelMapStorage;
}

namespace {

// A segmentation that is read, step by step; errors name its file.
class SegmentationReader {
 public:
  SegmentationReader(const fs::path& path, const Context& context) : path_(path), context_(context) {}
  Labels read() {
    load();
    place_frames();
    read_segments();
    fill_voxels();
    return std::move(labels_);
  }

 private:
  [[nodiscard]] Error fail(const std::string& why) const {
    return Error(ExitCode::corrupt, "'" + path_.string() + "': " + why);
  }

  void load() {
    OFCondition status = file_.loadFile(path_.c_str());
    if (status.bad()) throw fail(std::string("it cannot be read: ") + status.text());
    if (DcmXfer(file_.getDataset()->getOriginalXfer()).isEncapsulated()) {
      try {
        unpack_pixels(path_, *file_.getDataset());
      } catch (const dicom::PixelError& e) {
        throw fail(e.what());
      }
    }
    DcmSegmentation* loaded = nullptr;
    status = DcmSegmentation::loadDataset(*file_.getDataset(), loaded);
    seg_.reset(loaded);
    if (status.bad() || !seg_) throw fail(std::string("it cannot be read as a DICOM segmentation: ") + status.text());
    frames_ = static_cast<Uint32>(seg_->getNumberOfFrames());
    if (frames_ == 0 || seg_->getNumberOfSegments() == 0) throw fail("the segmentation is empty");
    if (seg_->getNumberOfSegments() > 255)
      throw fail("it holds " + std::to_string(seg_->getNumberOfSegments()) + " segments; up to 255 are supported");
    file_.getDataset()->findAndGetUint16(DCM_Rows, rows_);
    file_.getDataset()->findAndGetUint16(DCM_Columns, columns_);
    file_.getDataset()->findAndGetUint8Array(DCM_PixelData, pixels_, &pixel_bytes_);
  }

  // Makes the frame of the volume, and finds each picture's layer in it.
  void place_frames() {
    auto* const orientation = OFstatic_cast(FGPlaneOrientationPatient*,
                                            seg_->getFunctionalGroups().get(0, DcmFGTypes::EFG_PLANEORIENTPATIENT));
    auto* const measures =
        OFstatic_cast(FGPixelMeasures*, seg_->getFunctionalGroups().get(0, DcmFGTypes::EFG_PIXELMEASURES));
    Frame& f = labels_.frame;
    Vec3 &u = f.direction.column[0], &v = f.direction.column[1];
    Float64 row_mm = 0, column_mm = 0;
    if (orientation == nullptr || orientation->getImageOrientationPatient(u.x, u.y, u.z, v.x, v.y, v.z).bad() ||
        measures == nullptr || measures->getPixelSpacing(row_mm, 0).bad() ||
        measures->getPixelSpacing(column_mm, 1).bad()) {
      throw fail("it does not say where its frames lie in the patient");
    }
    const Vec3 along_row = normalized(u), along_column = normalized(v - along_row * dot(v, along_row));
    std::vector<Vec3> at(frames_);
    for (Uint32 i = 0; i < frames_; ++i) {
      if (!read_position(*seg_, i, at[i])) throw fail("frame " + std::to_string(i + 1) + " states no position");
      if (!lies_as(*seg_, i, along_row, along_column, row_mm, column_mm))
        throw fail("frame " + std::to_string(i + 1) +
                   " is turned against the first, or has other pixels: the frames make no one volume");
    }
    Float64 spacing_mm = 0, thickness_mm = 0;
    if (measures->getSpacingBetweenSlices(spacing_mm).bad()) spacing_mm = 0;
    if (measures->getSliceThickness(thickness_mm).bad()) thickness_mm = 0;
    f.spacing_mm = {column_mm, row_mm, 1};
    f.dims = {columns_, rows_, 1};
    auto [frame, layers] = dicom::stack_seg_frames(f, at, spacing_mm, thickness_mm);
    layers_ = std::move(layers);
    if (!layers_.problem.empty()) throw fail(layers_.problem);
    if (!layers_.warning.empty()) context_.warn("'" + path_.string() + "': " + layers_.warning);
    f = frame;
    require_valid(f);
  }

  void read_segments() {
    for (std::size_t s = 1; s <= seg_->getNumberOfSegments(); ++s) {
      const DcmSegment* const segment = seg_->getSegment(s);
      OFString name;
      if (segment != nullptr) const_cast<DcmSegment*>(segment)->getSegmentLabel(name);
      labels_.structures.push_back({static_cast<std::uint8_t>(s),
                                    name.empty() ? "Segment " + std::to_string(s) : std::string(name.c_str()),
                                    {}});
    }
  }

  [[nodiscard]] Uint16 segment_of(Uint32 frame) const {
    auto* const group =
        OFstatic_cast(FGSegmentation*, seg_->getFunctionalGroups().get(frame, DcmFGTypes::EFG_SEGMENTATION));
    Uint16 number = 0;
    if (group == nullptr || group->getReferencedSegmentNumber(number).bad() || number < 1 ||
        number > labels_.structures.size()) {
      throw fail("frame " + std::to_string(frame + 1) + " does not say which segment it shows");
    }
    return number;
  }

  void fill_voxels() {
    Uint16 allocated = 1, full = 255;
    file_.getDataset()->findAndGetUint16(DCM_BitsAllocated, allocated);
    file_.getDataset()->findAndGetUint16(DCM_MaximumFractionalValue, full);
    const bool bits = allocated == 1, binary = seg_->getSegmentationType() == DcmSegTypes::ST_BINARY;
    const int half = binary ? 1 : (full + 1) / 2;
    const std::size_t area = static_cast<std::size_t>(rows_) * columns_;
    const auto voxels = make_voxels<std::uint8_t>(labels_.frame.voxel_count());
    std::fill_n(voxels.get(), labels_.frame.voxel_count(), std::uint8_t{0});
    std::size_t overlap = 0;
    for (Uint32 i = 0; i < frames_; ++i) {
      const Uint16 number = segment_of(i);
      std::uint8_t* const out = voxels.get() + static_cast<std::size_t>(layers_.layer[i]) * area;
      const auto mark = [&](std::size_t p) {
        overlap += out[p] != 0 ? 1 : 0;
        out[p] = static_cast<std::uint8_t>(number);
      };
      if (pixels_ == nullptr || pixel_bytes_ * (bits ? 8 : 1) < (i + 1) * area)
        throw fail("frame " + std::to_string(i + 1) + " is cut short");
      for (std::size_t p = 0, bit = i * area; p < area; ++p, ++bit) {
        if (bits ? (pixels_[bit / 8] >> (bit % 8) & 1) != 0 : pixels_[bit] >= half) mark(p);
      }
    }
    if (overlap > 0)
      context_.warn(std::to_string(overlap) + " voxels belong to several segments; the last one keeps them");
    labels_.voxels = voxels;
  }

  const fs::path& path_;
  const Context& context_;
  DcmFileFormat file_;
  std::unique_ptr<DcmSegmentation> seg_;
  Uint32 frames_ = 0;
  Uint16 rows_ = 0, columns_ = 0;
  const Uint8* pixels_ = nullptr;  // read here: DCMTK 3.6.7 shifts frames of bits that are no multiple of 8
  unsigned long pixel_bytes_ = 0;
  dicom::SegLayers layers_;
  Labels labels_;
};

}  // namespace

Labels load_segmentation(const fs::path& path, const Context& context) {
  require_readable(path);
  dicom::quiet_dcmtk();
  if (class_of(path) == dicom::kLabelMapStorage) return dicom::load_labelmap(path, context);
  return SegmentationReader(path, context).read();
}

}  // namespace osteo::inline imaging
