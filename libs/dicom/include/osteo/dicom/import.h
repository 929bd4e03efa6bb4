// From whatever a CT comes in to one volume in HU with its frame.
#pragma once
#include <filesystem>

#include "osteo/data/volume.h"
#include "osteo/dicom/place.h"
#include "osteo/stage/stage.h"

namespace osteo {

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
  return {
      .max_gap_mm = p.max_gap_mm, .max_hole_mm = p.max_hole_mm, .stack = p.stack, .any_modality = p.any_modality, .hu_offset = p.hu_offset};
}

struct Imported {
  Image image;
  Verdict verdict;
};

/// A DICOM folder, DICOMDIR, file or archive, or a volume file.
/// Throws Refused (with the verdict) for a series that cannot be placed rightly; else errors as of scan_dicom, choose_series and
/// load_image.
[[nodiscard]] Imported import_ct(const std::filesystem::path& source, const ImportParams& params, const Context& context = {});

/// Warnings and facts of a verdict to log and report.
void tell_verdict(const Verdict& verdict, const Context& context);

struct ImportStage {
  using Params = ImportParams;
  static void describe(Params& p, auto& visit) {
    visit({"series", "DICOM series to take, by number, UID, or scan as --list shows it, like A1a or A1a:203 (empty: the recommended one)"},
          p.series);
    visit({"stack", "which stack of a series that holds several (0: the best)", "", 0, 1000}, p.stack);
    visit({"max_gap_mm", "widest usual distance between slices that is interpolated", "mm", 0, 50}, p.max_gap_mm);
    visit({"max_hole_mm", "widest distance that is interpolated where slices are missing", "mm", 0, 50}, p.max_hole_mm);
    visit({"any_modality", "take a series that is no CT, no slices or not in HU"}, p.any_modality);
    visit({"hu_offset", "added to all values, for a scan that leaves out its offset", "HU", -5000, 5000}, p.hu_offset);
    visit({"axes", "where the index axes point, for files that do not know: three letters like LPS or LPI (empty: as the file says)"},
          p.axes);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

}  // namespace osteo
