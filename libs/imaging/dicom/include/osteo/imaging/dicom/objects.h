// What goes back into a PACS: label maps as DICOM SEG, surfaces as encapsulated STL, reports as encapsulated PDF.
#pragma once
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/data/tri_mesh.h"
#include "osteo/core/data/volume.h"
#include "osteo/imaging/dicom/scan.h"

namespace osteo::inline imaging {

/// How a label map is written: segments in bits, a frame each (what every viewer reads), or one frame a slice whose
/// pixels are the numbers of segments, of 8 or of 16 bits (SOP class of 2024, smaller, and values stay).
enum class SegmentationForm : int { binary, labelmap, labelmap16 };
constexpr std::array<std::string_view, 3> enum_names(SegmentationForm) {
  return {"binary", "labelmap", "labelmap16"};
}

struct DicomObjectOptions {
  /// The series it was made from. Patient, study and frame of reference are taken over from it, and its slices are
  /// referred to. Without one the object has a made-up identity ("OSTEOTOME^ANONYMOUS") and names nobody. Values that
  /// DICOM does not allow, as careless anonymisation leaves them, are not taken over: an invalid UID becomes a valid
  /// one made from it (the same for all files), any other such value is left empty; a warning names them.
  const DicomSeries* source = nullptr;
  std::string description = "Bone";
  SegmentationForm form = SegmentationForm::binary;  ///< of a label map
};

/// DICOM SEG (PS3.3 A.51), a segment a structure, a frame a slice that holds any of it (as LABELMAP: of any), with
/// codes of SNOMED CT by its name and the algorithm by its origin. Frames lie on the slices of `labels`: after tilt
/// repair an upright stack of its own, in the frame of reference of the source. A frame refers to the source slice it
/// lies on, or to the two it lies between at its centre. Atomic. Errors: usage for a label map without a voxel,
/// cannot_write.
void save_segmentation(const Labels& labels, const std::filesystem::path& path, const DicomObjectOptions& options = {},
                       const Context& context = {});

/// The label map on the slices of the series as they are (tilted, uneven), nearest voxel: for viewers that show a
/// segmentation only on the pictures it was made from.
void save_segmentation_on_source(const Labels& labels, const std::filesystem::path& path,
                                 const DicomObjectOptions& options, const Context& context = {});

/// A DICOM SEG (bits, fractions cut at half, or a LABELMAP of 8 or 16 bits) as a label map on its own slices, plain,
/// deflated, or compressed by RLE, JPEG-LS, JPEG or JPEG 2000. Slices that hold nothing may be absent from the file,
/// and frames may stand in any order: layers lie SpacingBetweenSlices apart where all frames fit that, and the layers
/// of absent frames are empty. Where the file states no such distance, the frames' own decides, or the file is rejected
/// when the thickness of its slices says that frames may be absent. Where segments overlap, the later one stays (a
/// warning says how much). A LABELMAP keeps the numbers of its segments where all are at most 255; else they are
/// numbered from 1 (a warning). Errors: corrupt for what is no SEG, has no even, parallel frames, more than 255
/// segments or pixels of none of them.
[[nodiscard]] Labels load_segmentation(const std::filesystem::path& path, const Context& context = {});

/// True when the file says it is a DICOM SEG.
[[nodiscard]] bool is_segmentation(const std::filesystem::path& path);

/// Encapsulated STL (PS3.3 A.85.1): the surface as binary STL in LPS mm inside a DICOM file. Atomic.
void save_encapsulated_stl(const TriMesh& mesh, const std::filesystem::path& path,
                           const DicomObjectOptions& options = {}, const Context& context = {});

/// Encapsulated PDF (PS3.3 A.45.1): the bytes of a PDF, in a series of its own of the source's study, modality DOC, not
/// verified. `title` names the document. It has no frame of reference. Atomic. Same pages, same study: same UIDs.
/// Errors: usage for what does not begin as a PDF or is over 4 GB, cannot_write.
void save_encapsulated_pdf(std::string_view pdf, const std::string& title, const std::filesystem::path& path,
                           const DicomObjectOptions& options = {}, const Context& context = {});

/// What a report in DICOM says in numbers of one structure of a case.
struct MeasuredStructure {
  std::string name, origin;  ///< as in Structure
  double volume_mm3 = 0;
  double length_mm = 0;  ///< 0: not measured
};
struct MeasuredGap {
  std::string a, b;  ///< names of structures
  double mm = 0;
};
/// What was measured of a rehearsal as a whole, near one structure, or by one instrument.
struct ScoredGroup {
  struct Number {
    std::string name;  ///< its code in the scheme 99OSTEOTOME, and with spaces for "_" its meaning
    double value = 0;
    std::string unit;  ///< "mm", "mm2", "mm3", "mm3/s", "s", "1/s", "min", "N", "N s", "mJ", "C", "1", or a word
  };
  struct Verdict {
    std::string name;
    bool passed = false;
  };
  std::string name;       ///< what the report calls it
  std::string structure;  ///< name of the structure that it is about; empty: none
  std::vector<Number> numbers;
  std::vector<Verdict> verdicts;
};
struct MeasuresReport {
  std::string program;   ///< version of what measured
  std::string code;      ///< that the case is called by
  double bone_mm3 = -1;  ///< below 0: not known
  std::optional<double> bone_lower_hu;
  std::vector<MeasuredStructure> structures;
  std::vector<MeasuredGap> gaps;
  std::vector<ScoredGroup> scores;
  std::vector<std::string> remarks;  ///< what limits the numbers, a sentence each
  /// DICOM SEG of these structures that the report refers to; empty: to none.
  std::filesystem::path segmentation;
};

/// Structured report (PS3.16 TID 1500 in a Comprehensive SR, PS3.3 A.35.3): a measurement group for each structure (TID
/// 1411 where a segment is referred to, else 1501), for the distance between two, for the bone, and for each group of a
/// score, with the slices of the source and the segmentation as evidence. Verdicts are "Yes" and
/// "No", and remarks are comments in the qualitative evaluations. Modality SR,
/// not verified, of the source's study. Atomic. Same numbers, same study: same UIDs. Errors: usage where the
/// segmentation is of another study, has no segment of such a name, or one whose volume is another by more than half a
/// percent; corrupt for what is no SEG; cannot_write.
void save_measures_report(const MeasuresReport& report, const std::filesystem::path& path,
                          const DicomObjectOptions& options = {}, const Context& context = {});

/// Markdown for the conformance statement: encodings that are read, classes and attributes that are written. Writes
/// small objects into a temporary folder, to list what they hold. Errors: cannot_write.
[[nodiscard]] std::string objects_conformance();

}  // namespace osteo::inline imaging
