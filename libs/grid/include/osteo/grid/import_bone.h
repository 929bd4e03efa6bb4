// DICOM straight to sparse bone, slab by slab.
#pragma once
#include <filesystem>

#include "osteo/data/sparse_grid.h"
#include "osteo/dicom/import.h"
#include "osteo/image/components.h"
#include "osteo/stage/stage.h"

namespace osteo {

struct ImportBoneParams {
  ImportParams source;
  double lower = 300;
  double spacing_mm = 0.5;
  double min_volume_mm3 = 10;
  int keep_largest = 0;
};

struct ImportedBone {
  SparseGrid density;  ///< "density": share of the voxel filled with bone, 0 to 1
  SparseGrid hu;       ///< "hu": CT value in the same voxels only (no soft tissue, no face)
  SparseGrid valid;    ///< "valid": stored where the scan measured at all, whatever is there
  Verdict verdict;
};

/// One pass from the slices to isotropic voxels: linear in each slice and between slices along their true positions, each
/// slice where its file says (tilt, uneven distances, holes as in place.h). Density is the share of the voxel above `lower`,
/// from the HU distance to it over the local change, as in resample. A bone voxel has itself or a face neighbour at or above
/// `lower`. Pieces are of 26-connected voxels.
/// Memory: the result and a few slices; never the volume. Same bytes for any thread count.
/// Errors as of import_ct; failed when no bone is left.
[[nodiscard]] ImportedBone import_bone(const std::filesystem::path& source, const ImportBoneParams& params, const Context& context = {});

struct ImportBoneStage {
  using Params = ImportBoneParams;
  static void describe(Params& p, auto& visit) {
    visit({"lower", "HU at the boundary of bone", "HU", -32768, 32767}, p.lower);
    visit({"spacing_mm", "edge of the output voxels", "mm", 0.05, 10}, p.spacing_mm);
    visit({"min_volume_mm3", "drop pieces smaller than this volume", "mm3", 0, 1e9}, p.min_volume_mm3);
    visit({"keep_largest", "keep only this many of the largest pieces (0 keeps all)", "", 0, 1000000}, p.keep_largest);
    visit({"series", "DICOM series to take, by number, UID, or scan as --list shows it, like A1a or A1a:203 (empty: the recommended one)"},
          p.source.series);
    visit({"stack", "which stack of a series that holds several (0: the best)", "", 0, 1000}, p.source.stack);
    visit({"max_gap_mm", "widest usual distance between slices that is interpolated", "mm", 0, 50}, p.source.max_gap_mm);
    visit({"max_hole_mm", "widest distance that is interpolated where slices are missing", "mm", 0, 50}, p.source.max_hole_mm);
    visit({"any_modality", "take a series that is no CT, no slices or not in HU"}, p.source.any_modality);
    visit({"hu_offset", "added to all values, for a scan that leaves out its offset", "HU", -5000, 5000}, p.source.hu_offset);
  }
  static StageInfo info();
  static std::vector<Data> run(const Params& params, std::span<const Data> inputs, const Context& context);
};

}  // namespace osteo
