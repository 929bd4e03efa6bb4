// From whatever a CT comes in to one volume in HU with its frame.
#pragma once
#include <filesystem>

#include "osteo/data/volume.h"
#include "osteo/stage/stage.h"

namespace osteo {

struct ImportParams {
  std::string series;
  double max_gap_mm = 8;
  std::string axes;
};

/// A DICOM folder or file, or a volume file. Reports the source's kind, the range of values and whether they look like HU.
/// Errors as of scan_dicom, load_dicom_series and load_image; usage when the asked-for series does not exist.
[[nodiscard]] Image import_ct(const std::filesystem::path& source, const ImportParams& params, const Context& context = {});

struct ImportStage {
  using Params = ImportParams;
  static void describe(Params& p, auto& visit) {
    visit({"series", "DICOM series to take, by number or UID (empty: the one with the most slices)"}, p.series);
    visit({"max_gap_mm", "widest distance between slices that is interpolated", "mm", 0, 50}, p.max_gap_mm);
    visit({"axes", "where the index axes point, for files that do not know: three letters like LPS or LPI (empty: as the file says)"},
          p.axes);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

}  // namespace osteo
