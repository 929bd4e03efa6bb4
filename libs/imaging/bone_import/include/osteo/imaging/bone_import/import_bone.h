// DICOM straight to sparse bone, slab by slab.
#pragma once
#include <filesystem>

#include "osteo/core/base/context.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/sparse_grid.h"
#include "osteo/imaging/dicom/import.h"
#include "osteo/imaging/image/components.h"

namespace osteo::inline imaging {

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

/// One pass from the slices to isotropic voxels: linear in each slice and between slices along their true positions,
/// each slice where its file says (tilt, uneven distances, holes as in place.h). Density is the share of the voxel
/// above `lower`, from the HU distance to it over the local change, as in resample. A bone voxel has itself or a face
/// neighbour at or above `lower`. Pieces are of 26-connected voxels. Memory: the result and a few slices; never the
/// volume. Same bytes for any thread count. Errors as of import_ct; failed when no bone is left.
[[nodiscard]] ImportedBone import_bone(const std::filesystem::path& source, const ImportBoneParams& params,
                                       const Context& context = {});

}  // namespace osteo::inline imaging
