#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>
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
#include "segment_codes.h"

namespace osteo::inline imaging {
namespace {

using dicom::require;

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
                                    {},
                                    origin_of(s - 1)});
      DcmItem* item = nullptr;
      OFString description;
      if (file_.getDataset()->findAndGetSequenceItem(DCM_SegmentSequence, item, static_cast<long>(s - 1)).good() &&
          item->findAndGetOFStringArray(DCM_SegmentDescription, description).good())
        dicom::read_certainty(description.c_str(), labels_.structures.back());
    }
  }

  [[nodiscard]] std::string origin_of(std::size_t segment) {
    DcmItem *item = nullptr, *algorithm = nullptr;
    if (file_.getDataset()->findAndGetSequenceItem(DCM_SegmentSequence, item, static_cast<long>(segment)).bad())
      return {};
    OFString type, name, version;
    item->findAndGetOFString(DCM_SegmentAlgorithmType, type);
    item->findAndGetOFString(DCM_SegmentAlgorithmName, name);
    if (item->findAndGetSequenceItem(DCM_SegmentationAlgorithmIdentificationSequence, algorithm).good())
      algorithm->findAndGetOFString(DCM_AlgorithmVersion, version);
    return dicom::origin_from(type.c_str(), name.c_str(), version.c_str());
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
