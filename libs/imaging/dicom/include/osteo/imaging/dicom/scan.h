// What lies in a folder, some files, a DICOMDIR or an archive: each file's header read once, grouped into series.
#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/base/files.h"
#include "osteo/imaging/dicom/detail/header.h"
#include "osteo/imaging/dicom/detail/place.h"

namespace osteo::inline imaging {

/// What a person needs to choose a series.
struct DicomSeries {
  int number = 0;   ///< SeriesNumber as the scanner gave it
  std::string uid;  ///< to ask for it by; never written to a file
  /// Which patient (A, B, ...), which of their studies (1, 2, ...) and which frame of reference in it (a, b, ...):
  /// "A1a". Series of different scans do not lie in one space.
  std::string scan;
  std::string study_date, study_description;  ///< can identify a person: shown on request only
  std::string modality, kernel;
  std::string description;  ///< the scanner's free text, without what identifies the patient
  int columns = 0, rows = 0, images = 0;
  double pixel_mm = 0, thickness_mm = 0, gap_mm = 0;
  std::string what;     ///< "axial, 140 slices", "localizer", "rejected: GAP_TOO_WIDE", ...
  std::string problem;  ///< the first error, as a sentence; empty when usable
  bool usable = false;
  bool recommended = false;  ///< the best of its scan: taken when nothing is asked for and there is no other scan
  std::string why;           ///< why it is recommended
  std::vector<DicomHeader> headers;
  std::shared_ptr<const std::vector<FileSetAside>>
      strays;  ///< the scan's set_aside: part of every verdict on it; may be null
  std::vector<std::string>
      foreign;  ///< slices under the same series UID that are of another patient, study or frame of reference
};

struct DicomScan {
  std::vector<DicomSeries> series;      ///< by number
  std::vector<FileSetAside> set_aside;  ///< files that belong to no series of pictures
  std::size_t files = 0;
  std::shared_ptr<TemporaryFolder> scratch;  ///< keeps unpacked and rewritten files until the pixels are read
};

/// `source`: a folder (any depth), a DICOMDIR, a DICOM file (one slice stands for its series: the
/// files beside it that belong to it), or an archive
/// (zip, tar, 7z; unpacked into the system's temporary folder). Headers are read in parallel, each once, no pixels.
/// `options.hu_offset` is added to each intercept.
/// A series whose files are of several patients, studies or frames of reference becomes several.
/// Names shown hold no value that identifies the patient: such a folder becomes "*",
/// such a file "file-000012".
/// Errors: no_input when there is no DICOM image at all, cannot_read, resources when an archive does not fit the disk.
[[nodiscard]] DicomScan scan_dicom(const std::filesystem::path& source, const PlaceOptions& options = {},
                                   const Context& context = {});

/// The recommended series, or the one asked for by number, UID, scan ("A1a": the recommended one of it) or both
/// ("A1a:203"). Errors, each with a list of what there is: corrupt when nothing is asked for but there are several
/// scans, usage, no_input.
[[nodiscard]] const DicomSeries& choose_series(const DicomScan& scan, const std::string& wanted,
                                               const std::string& source_name);

/// True by name or by first bytes.
[[nodiscard]] bool is_archive(const std::filesystem::path& file);

}  // namespace osteo::inline imaging
