// DICOM CT series: what is in a folder, one series as a volume, a volume as a series.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "osteo/base/context.h"
#include "osteo/data/volume.h"

namespace osteo {

/// What a person needs to choose a series. Holds nothing that names the patient.
struct DicomSeries {
  int number = 0;  ///< SeriesNumber as the scanner gave it
  std::string uid;
  std::string modality;     ///< "CT", ...
  std::string description;  ///< SeriesDescription; free text of the scanner
  std::string kernel;       ///< ConvolutionKernel
  int columns = 0, rows = 0, images = 0;
  double pixel_mm = 0, thickness_mm = 0;
  std::string what;          ///< "axial volume", "localizer", "no image position", "secondary capture", ...
  bool usable = false;       ///< can be asked for
  bool recommended = false;  ///< taken when nothing is asked for
  std::vector<std::filesystem::path> files;
};

/// Reads the header of each file below `folder` (or of the one file), groups them into series. Files that are not DICOM are
/// left aside. Error(no_input) when there is no DICOM image.
[[nodiscard]] std::vector<DicomSeries> scan_dicom(const std::filesystem::path& folder, const Context& context = {});

/// The series as a volume in LPS mm. Slices are placed by their own position and orientation. Evenly spaced slices that
/// stand straight above each other come out voxel for voxel; a tilted gantry or uneven gaps are resampled (linear in the
/// slice and between slices) onto straight, even slices. Values below -1024 HU are padding and become air before that.
/// Errors: corrupt (with the file) for damaged pixels, slices of another size or orientation, no position, several slices at
/// one place; failed when a gap is wider than `max_gap_mm`.
[[nodiscard]] Image load_dicom_series(const DicomSeries& series, double max_gap_mm, const Context& context = {});

/// A CT series in a new folder, one file a slice, with made-up identity "OSTEOTOME^PHANTOM". Atomic.
void save_dicom_series(const Image& image, const std::filesystem::path& folder, const Context& context = {});

}  // namespace osteo
