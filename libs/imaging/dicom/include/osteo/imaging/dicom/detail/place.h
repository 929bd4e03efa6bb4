// Where the slices of a series lie: sorting, stacks, duplicates, gaps, tilt. Works on headers alone.
#pragma once
#include <functional>
#include <vector>

#include "osteo/imaging/dicom/detail/header.h"
#include "osteo/imaging/dicom/verdict.h"

namespace osteo::inline imaging {

struct PlaceOptions {
  double max_gap_mm = 8;      ///< widest usual distance between slices that is interpolated
  double max_hole_mm = 3;     ///< widest distance that is interpolated where slices are missing
  int stack = 0;              ///< which stack of a series that holds several, from 1; 0 takes the best
  bool any_modality = false;  ///< also what is no CT, no slice, or not in HU
  double hu_offset = 0;       ///< added to all values, for series that leave out their rescale intercept
};

/// One slice of the stack, in order along the normal.
struct PlacedSlice {
  std::size_t header = 0;  ///< index into the headers
  int frame = 0;
  double along_mm = 0;         ///< from the first slice, along the normal
  double sideways_mm[2] = {};  ///< from the first slice, along rows and columns
};

struct Placement {
  std::vector<PlacedSlice> slices;  ///< at least two when the verdict is not "rejected"
  Vec3 origin_mm, along_row, along_column, normal;
  double column_spacing_mm = 0, row_spacing_mm = 0;
  bool even = false;  ///< straight and evenly spaced to within kStraightMm: voxels can be taken as they are
  Verdict verdict;
};

/// Slices nearer than this lie at one place; deviations below it are none: the promise is 0.01 mm.
inline constexpr double kSamePlaceMm = 0.01;

/// Chooses the stack, sorts it, judges it. `excluded` (one a header, may be empty) leaves files out, with the reason to
/// show. `same_pixels` is asked only where two slices lie at one place. O(n log n). Refusals are errors in the verdict.
///
/// Slices belong to one stack when size and pixel spacing agree and the corners that their orientation gives agree to
/// kSamePlaceMm. The normal is the cross product of the stated axes, positions along it come from ImagePositionPatient
/// alone (DICOM PS3.3 C.7.6.2); tilt, slice thickness and spacing tags are compared, never used.
[[nodiscard]] Placement place_slices(const std::vector<DicomHeader>& headers, const PlaceOptions& options,
                                     const std::vector<FileSetAside>& excluded = {},
                                     const std::function<bool(std::size_t, std::size_t)>& same_pixels = {});

}  // namespace osteo::inline imaging
