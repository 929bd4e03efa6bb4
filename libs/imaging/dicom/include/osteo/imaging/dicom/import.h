// From whatever a CT comes in to one volume in HU with its frame.
#pragma once
#include <filesystem>

#include "osteo/core/base/context.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/volume.h"
#include "osteo/imaging/dicom/detail/place.h"

namespace osteo::inline imaging {

struct ImportParams {
  std::string series;
  int stack = 0;
  double max_gap_mm = 8;
  double max_hole_mm = 3;
  bool any_modality = false;
  double hu_offset = 0;
  std::string axes;
};

[[nodiscard]] inline PlaceOptions place_options(const ImportParams& p) {
  return {.max_gap_mm = p.max_gap_mm,
          .max_hole_mm = p.max_hole_mm,
          .stack = p.stack,
          .any_modality = p.any_modality,
          .hu_offset = p.hu_offset};
}

struct Imported {
  Image image;
  Verdict verdict;
};

/// A DICOM folder, DICOMDIR, file or archive, or a volume file.
/// Throws Rejected (with the verdict) for a series that cannot be placed rightly; else errors as of scan_dicom,
/// choose_series and load_image.
[[nodiscard]] Imported import_ct(const std::filesystem::path& source, const ImportParams& params,
                                 const Context& context = {});

/// Warnings and facts of a verdict to log and report.
void report_verdict(const Verdict& verdict, const Context& context);

}  // namespace osteo::inline imaging
