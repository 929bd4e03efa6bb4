// The stages import and import-bone.
#pragma once
#include "osteo/core/stage/stage.h"
#include "osteo/imaging/bone_import/import_bone.h"
#include "osteo/imaging/dicom/import.h"

namespace osteo::inline app {

struct ImportStage {
  using Params = ImportParams;
  static void describe(Params& p, auto& visit) {
    visit({"series",
           "DICOM series to take, by number, UID, or scan as --list shows it, like A1a or A1a:203 (empty: the "
           "recommended one)"},
          p.series);
    visit({"stack", "which stack of a series that holds several (0: the best)", "", 0, 1000}, p.stack);
    visit({"max_gap_mm", "widest usual distance between slices that is interpolated", "mm", 0, 50}, p.max_gap_mm);
    visit({"max_hole_mm", "widest distance that is interpolated where slices are missing", "mm", 0, 50}, p.max_hole_mm);
    visit({"any_modality", "take a series that is no CT, no slices or not in HU"}, p.any_modality);
    visit({"hu_offset", "added to all values, for a scan that leaves out its offset", "HU", -5000, 5000}, p.hu_offset);
    visit({"axes",
           "where the index axes point, for files that do not know: three letters like LPS or LPI (empty: as the file "
           "says)"},
          p.axes);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

struct ImportBoneStage {
  using Params = ImportBoneParams;
  static void describe(Params& p, auto& visit) {
    visit({"lower", "HU at the boundary of bone", "HU", -32768, 32767}, p.lower);
    visit({"spacing_mm", "edge of the output voxels", "mm", 0.05, 10}, p.spacing_mm);
    visit({"min_volume_mm3", "drop components smaller than this volume", "mm3", 0, 1e9}, p.min_volume_mm3);
    visit({"keep_largest", "keep only this many of the largest components (0 keeps all)", "", 0, 1000000},
          p.keep_largest);
    visit({"series",
           "DICOM series to take, by number, UID, or scan as --list shows it, like A1a or A1a:203 (empty: the "
           "recommended one)"},
          p.source.series);
    visit({"stack", "which stack of a series that holds several (0: the best)", "", 0, 1000}, p.source.stack);
    visit({"max_gap_mm", "widest usual distance between slices that is interpolated", "mm", 0, 50},
          p.source.max_gap_mm);
    visit({"max_hole_mm", "widest distance that is interpolated where slices are missing", "mm", 0, 50},
          p.source.max_hole_mm);
    visit({"any_modality", "take a series that is no CT, no slices or not in HU"}, p.source.any_modality);
    visit({"hu_offset", "added to all values, for a scan that leaves out its offset", "HU", -5000, 5000},
          p.source.hu_offset);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

}  // namespace osteo::inline app
