// Label maps as DICOM SEG, segments in bits or numbers of segments (LABELMAP).
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>
#include <dcmtk/dcmfg/fgderimg.h>
#include <dcmtk/dcmfg/fgfracon.h>
#include <dcmtk/dcmfg/fgpixmsr.h>
#include <dcmtk/dcmfg/fgplanor.h>
#include <dcmtk/dcmfg/fgplanpo.h>
#include <dcmtk/dcmseg/segdoc.h>
#include <dcmtk/dcmseg/segment.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "dcmtk_tools.h"
#include "labelmap.h"
#include "object_identity.h"
#include "osteo/core/base/param.h"
#include "osteo/imaging/dicom/objects.h"
#include "segment_codes.h"

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

// In the order of their values; a value that has voxels and no name is a segment too.
std::vector<Structure> structures_of(const Labels& labels) {
  std::array<bool, 256> there{};
  for (const auto v : labels.span()) there[v] = true;
  std::vector<Structure> list = labels.structures;
  for (const Structure& s : list) there[s.value] = false;
  for (std::size_t v = 1; v < 256; ++v) {
    if (there[v])
      list.push_back({static_cast<std::uint8_t>(v), v == 1 ? "Bone" : "Structure " + std::to_string(v), {}});
  }
  std::stable_sort(list.begin(), list.end(), [](const auto& a, const auto& b) { return a.value < b.value; });
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

// `named`: what the segments are called and what drew them.
void take_over_identity(DcmSegmentation& seg, const DicomObjectOptions& o, const std::string& content,
                        const std::string& named, const fs::path& path, const Context& context) {
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
  // The same voxels in another form, under other names or in another study are another object, in the same space: a
  // PACS keeps the first of two that have one UID.
  OFString study;
  static_cast<void>(seg.getStudy().getStudyInstanceUID(study));
  const std::string own = content + named + study.c_str() + enum_names(o.form)[static_cast<std::size_t>(o.form)].data();
  require(seg.getSeries().setSeriesInstanceUID(dicom::uid_of(hash_text(own + "series")).c_str()), path);
  require(seg.getSOPCommon().setSOPInstanceUID(dicom::uid_of(hash_text(own + "instance")).c_str()), path);
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

std::string content_of(const Stack& stack) {
  Hasher hasher;
  const std::array<int, 2> size{stack.columns, stack.rows};
  hasher.add(size.data(), sizeof size);
  const std::array<double, 3> mm{stack.column_mm, stack.row_mm, stack.thickness_mm};
  hasher.add(mm.data(), sizeof mm);
  hasher.add(&stack.along_row, sizeof stack.along_row);
  hasher.add(&stack.along_column, sizeof stack.along_column);
  for (const Plane& p : stack.planes) {
    hasher.add(&p.position, sizeof p.position);
    hasher.add(p.labels.data(), p.labels.size());
  }
  return hasher.hex();
}

// One object, step by step. Its frames are made by DCMTK as those of a binary segmentation of one segment: it refuses
// more segments than frames, which a stack of few slices may have. What is otherwise is put in its place afterwards,
// a label map too, which DCMTK before 3.7 does not know.
class SegmentationWriter {
 public:
  SegmentationWriter(const Stack& stack, const std::vector<Structure>& structures, const fs::path& path,
                     const DicomObjectOptions& o)
      : stack_(stack), structures_(structures), path_(path), o_(o), map_(o.form != SegmentationForm::binary) {}

  void write(const Context& context) {
    make(context);
    add_segment();
    add_shared();
    map_ ? add_planes() : add_planes_of_segments();
    DcmFileFormat file;
    DcmDataset& d = *file.getDataset();
    require(seg_->writeDataset(d), path_);
    require(d.putAndInsertString(DCM_SegmentsOverlap, "NO"), path_);
    put_more_segments(d);
    std::string names = o_.description;
    for (const Structure& s : structures_) names += s.name + s.origin + s.doubt;
    dicom::speak_utf8(d, names);
    for (const DcmTagKey& tag : {DCM_SeriesDescription, DCM_ContentDescription})
      dicom::put(d, tag, dicom::lo_text(o_.description), path_);
    for (std::size_t s = 0; s < structures_.size(); ++s) {
      DcmItem& segment = *item(d, DCM_SegmentSequence, s);
      dicom::put(segment, DCM_SegmentLabel, dicom::segment_label(structures_[s].name), path_);
      dicom::put_algorithm(segment, structures_[s].origin, path_);
      dicom::put_certainty(segment, structures_[s], path_);
    }
    map_ ? put_map(d) : put_bits(d);
    write_atomically(path_, [&](const fs::path& temporary) {
      require(file.saveFile(temporary.c_str(), EXS_LittleEndianExplicit), path_);
    });
  }

 private:
  DcmItem* item(DcmItem& in, const DcmTagKey& sequence, std::size_t number) const {
    DcmItem* found = nullptr;
    require(in.findAndGetSequenceItem(sequence, found, static_cast<long>(number)), path_);
    return found;
  }

  void make(const Context& context) {
    DcmSegmentation* made = nullptr;
    const IODGeneralEquipmentModule::EquipmentInfo equipment("Osteotome", "osteo", "0", "0.1");
    const ContentIdentificationMacro identity("1", "BONE", "", "");  // described in write()
    require(DcmSegmentation::createBinarySegmentation(made, static_cast<Uint16>(stack_.rows),
                                                      static_cast<Uint16>(stack_.columns), equipment, identity),
            path_);
    seg_.reset(made);
    content_ = content_of(stack_);
    std::string named;
    for (const Structure& s : structures_) named += std::to_string(s.value) + " " + s.name + "\n" + s.origin + "\n";
    take_over_identity(*seg_, o_, content_, named, path_, context);
    if (o_.source != nullptr) refer_to_series(*seg_, *o_.source);
  }

  // The first; those behind it are put in by put_more_segments.
  void add_segment() {
    const dicom::SegmentCode type = dicom::code_of(structures_.front().name, structures_.size() == 1);
    const CodeSequenceMacro category("123037004", "SCT", "Anatomical Structure"),
        code(std::string(type.code).c_str(), "SCT", std::string(type.meaning).c_str());
    DcmSegment* segment = nullptr;
    // Its name and what drew it are put in later.
    require(DcmSegment::create(segment, "-", category, code, DcmSegTypes::SAT_SEMIAUTOMATIC, "-"), path_);
    Uint16 number = 0;
    require(seg_->addSegment(segment, number), path_);
  }

  void put_more_segments(DcmDataset& d) const {
    DcmSequenceOfItems* segments = nullptr;
    require(d.findAndGetSequence(DCM_SegmentSequence, segments), path_);
    for (std::size_t s = segments->card(); s < structures_.size(); ++s) {
      auto segment = std::make_unique<DcmItem>(*segments->getItem(0));
      const dicom::SegmentCode type = dicom::code_of(structures_[s].name, false);
      dicom::put_code(*segment, DCM_SegmentedPropertyTypeCodeSequence, type, "SCT", path_);
      require(segment->putAndInsertUint16(DCM_SegmentNumber, static_cast<Uint16>(s + 1)), path_);
      require(segments->append(segment.get()), path_);
      static_cast<void>(segment.release());  // the sequence's
    }
  }

  static OFString text(double v) { return decimal(v).c_str(); }

  void add_shared() {
    FGPixelMeasures measures;
    measures.setPixelSpacing((decimal(stack_.row_mm) + "\\" + decimal(stack_.column_mm)).c_str());
    measures.setSliceThickness(text(stack_.thickness_mm));
    measures.setSpacingBetweenSlices(text(stack_.thickness_mm));
    require(seg_->addForAllFrames(measures), path_);
    const Vec3 u = stack_.along_row, v = stack_.along_column;
    const std::unique_ptr<FGPlaneOrientationPatient> orientation(
        FGPlaneOrientationPatient::createMinimal(text(u.x), text(u.y), text(u.z), text(v.x), text(v.y), text(v.z)));
    require(seg_->addForAllFrames(*orientation), path_);
    const std::string organization = dicom::uid_of(hash_text(content_ + "dimensions"));
    require(seg_->getDimensions().addDimensionIndex(DCM_ReferencedSegmentNumber, organization.c_str(),
                                                    DCM_SegmentIdentificationSequence, "Segment"),
            path_);
    require(seg_->getDimensions().addDimensionIndex(DCM_ImagePositionPatient, organization.c_str(),
                                                    DCM_PlanePositionSequence, "Position"),
            path_);
  }

  void refer_to_source(const Plane& plane, FGDerivationImage& derivation) const {
    DerivationImageItem* derived = nullptr;
    require(derivation.addDerivationImageItem(CodeSequenceMacro("113076", "DCM", "Segmentation"), "", derived), path_);
    for (const std::size_t index : plane.source_headers) {
      const DicomHeader& h = o_.source->headers[index];
      DcmDataset reference;
      reference.putAndInsertString(DCM_SOPClassUID, h.sop_class.c_str());
      reference.putAndInsertString(DCM_SOPInstanceUID, dicom::valid_uid(h.sop_uid).c_str());
      SourceImageItem* image = nullptr;
      const CodeSequenceMacro purpose("121322", "DCM", "Source image for image processing operation");
      require(derived->addSourceImageItem(&reference, purpose, image), path_);
    }
  }

  // A frame: `pixels` with a byte each, 0 or 1.
  void add_frame(std::size_t plane_number, std::size_t segment, std::vector<Uint8>& pixels) {
    const Plane& plane = stack_.planes[plane_number];
    FGFrameContent where;
    where.setDimensionIndexValues(static_cast<Uint32>(segment + 1), 0);
    where.setDimensionIndexValues(static_cast<Uint32>(plane_number + 1), 1);
    const std::unique_ptr<FGPlanePosPatient> position(
        FGPlanePosPatient::createMinimal(text(plane.position.x), text(plane.position.y), text(plane.position.z)));
    OFVector<FGBase*> groups;
    groups.push_back(&where);
    groups.push_back(position.get());
    FGDerivationImage derivation;
    if (!plane.source_headers.empty()) {
      refer_to_source(plane, derivation);
      groups.push_back(&derivation);
    }
    require(seg_->addFrame(pixels.data(), 1, groups), path_);
    segments_.push_back(static_cast<Uint16>(segment + 1));
  }

  void add_planes_of_segments() {
    std::vector<Uint8> frame(area());
    for (std::size_t s = 0; s < structures_.size(); ++s) {
      for (std::size_t k = 0; k < stack_.planes.size(); ++k) {
        bool any = false;
        for (std::size_t i = 0; i < frame.size(); ++i) {
          frame[i] = stack_.planes[k].labels[i] == structures_[s].value ? 1 : 0;
          any = any || frame[i] != 0;
        }
        if (!any) continue;
        add_frame(k, s, frame);
        bits_.insert(bits_.end(), frame.begin(), frame.end());
      }
    }
  }

  // Their pixels are put in by put_map.
  void add_planes() {
    std::vector<Uint8> none(area());
    for (std::size_t k = 0; k < stack_.planes.size(); ++k) add_frame(k, 0, none);
  }

  [[nodiscard]] std::size_t area() const {
    return static_cast<std::size_t>(stack_.columns) * static_cast<std::size_t>(stack_.rows);
  }

  void put_bytes(DcmDataset& d, const std::vector<Uint8>& bytes) const {
    require(d.putAndInsertUint8Array(DCM_PixelData, bytes.data(), static_cast<unsigned long>(bytes.size())), path_);
  }

  // DCMTK 3.6.7 shifts frames whose size is no multiple of 8: the bits are packed here, one frame right after the other
  // (PS3.5 8.1.1).
  void put_bits(DcmDataset& d) const {
    for (std::size_t i = 0; i < segments_.size(); ++i) {
      DcmItem& shown = *item(*item(d, DCM_PerFrameFunctionalGroupsSequence, i), DCM_SegmentIdentificationSequence, 0);
      require(shown.putAndInsertUint16(DCM_ReferencedSegmentNumber, segments_[i]), path_);
    }
    std::vector<Uint8> packed((bits_.size() + 15) / 16 * 2);
    for (std::size_t i = 0; i < bits_.size(); ++i)
      packed[i / 8] = static_cast<Uint8>(packed[i / 8] | bits_[i] << (i % 8));
    put_bytes(d, packed);
  }

  // PS3.3 C.8.20.2, C.8.20.4: a pixel is the number of its segment, a frame has no segment, 0 is the background.
  void put_map(DcmDataset& d) const {
    const bool wide = o_.form == SegmentationForm::labelmap16;
    const auto number = [&](const DcmTagKey& tag, Uint16 value) { require(d.putAndInsertUint16(tag, value), path_); };
    require(d.putAndInsertString(DCM_SOPClassUID, std::string(dicom::kLabelMapStorage).c_str()), path_);
    require(d.putAndInsertString(DCM_SegmentationType, "LABELMAP"), path_);
    number(DCM_BitsAllocated, wide ? 16 : 8);
    number(DCM_BitsStored, wide ? 16 : 8);
    number(DCM_HighBit, wide ? 15 : 7);
    number(DCM_PixelPaddingValue, 0);
    DcmSequenceOfItems* dimensions = nullptr;
    require(d.findAndGetSequence(DCM_DimensionIndexSequence, dimensions), path_);
    delete dimensions->remove(0UL);
    for (std::size_t k = 0; k < stack_.planes.size(); ++k) {
      DcmItem& frame = *item(d, DCM_PerFrameFunctionalGroupsSequence, k);
      frame.findAndDeleteElement(DCM_SegmentIdentificationSequence);
      require(item(frame, DCM_FrameContentSequence, 0)
                  ->putAndInsertUint32(DCM_DimensionIndexValues, static_cast<Uint32>(k + 1)),
              path_);
    }
    put_segment_numbers(d);
    std::vector<Uint8> pixels;
    for (const Plane& plane : stack_.planes) pixels.insert(pixels.end(), plane.labels.begin(), plane.labels.end());
    if (wide) {
      const std::vector<Uint16> words(pixels.begin(), pixels.end());
      require(d.putAndInsertUint16Array(DCM_PixelData, words.data(), static_cast<unsigned long>(words.size())), path_);
      return;
    }
    if (pixels.size() % 2 != 0) pixels.push_back(0);
    put_bytes(d, pixels);
  }

  void put_segment_numbers(DcmDataset& d) const {
    for (std::size_t s = 0; s < structures_.size(); ++s)
      require(item(d, DCM_SegmentSequence, s)->putAndInsertUint16(DCM_SegmentNumber, structures_[s].value), path_);
    DcmSequenceOfItems* segments = nullptr;
    require(d.findAndGetSequence(DCM_SegmentSequence, segments), path_);
    auto background = std::make_unique<DcmItem>();
    require(background->putAndInsertUint16(DCM_SegmentNumber, 0), path_);
    require(background->putAndInsertString(DCM_SegmentLabel, "Background"), path_);
    for (const DcmTagKey& tag : {DCM_SegmentedPropertyCategoryCodeSequence, DCM_SegmentedPropertyTypeCodeSequence})
      dicom::put_code(*background, tag, {"125040", "Background"}, "DCM", path_);
    require(background->putAndInsertString(DCM_SegmentAlgorithmType, "AUTOMATIC"), path_);
    require(background->putAndInsertString(DCM_SegmentAlgorithmName, "background"), path_);
    require(segments->prepend(background.get()), path_);
    static_cast<void>(background.release());  // the sequence's
  }

  const Stack& stack_;
  const std::vector<Structure>& structures_;
  const fs::path& path_;
  const DicomObjectOptions& o_;
  const bool map_;
  std::unique_ptr<DcmSegmentation> seg_;
  std::string content_;
  std::vector<Uint8> bits_;       // of all frames, a byte each
  std::vector<Uint16> segments_;  // which each frame shows
};

void write_segmentation(const Stack& stack, const std::vector<Structure>& structures, const fs::path& path,
                        const DicomObjectOptions& o, const Context& context) {
  if (stack.planes.empty())
    throw Error(ExitCode::usage, "the label map is empty: there is nothing to write to '" + path.string() + "'");
  dicom::quiet_dcmtk();
  SegmentationWriter(stack, structures, path, o).write(context);
}

}  // namespace

void save_segmentation(const Labels& labels, const fs::path& path, const DicomObjectOptions& options,
                       const Context& context) {
  write_segmentation(stack_of(labels, options.source), structures_of(labels), path, options, context);
}

void save_segmentation_on_source(const Labels& labels, const fs::path& path, const DicomObjectOptions& options,
                                 const Context& context) {
  if (options.source == nullptr)
    throw Error(ExitCode::usage, "a segmentation on the slices of its source needs the source series");
  write_segmentation(stack_on_source(labels, *options.source), structures_of(labels), path, options, context);
}

}  // namespace osteo::inline imaging
