// How far two outlines of one structure lie apart, and where they differ. Private to libs/imaging/segment.
#pragma once
#include <cstdint>
#include <vector>

#include "label_line.h"
#include "osteo/imaging/segment/ear.h"

namespace osteo::inline imaging::segment {

/// What EarComparison::apart holds.
inline constexpr std::uint8_t kDiffers = 255;
[[nodiscard]] std::uint8_t apart_of(double mm);

/// How far outlines may lie apart: more than `apart_mm` over at least `least_mm2` is a place that differs.
struct Tolerance {
  double apart_mm = 1, least_mm2 = 10;
  /// Where the first may go on beyond the second, which is then not compared: nowhere, from the ends of the tube that
  /// the second is (within `end_mm` of its line's ends), or out of the box that the second fills.
  enum class Open { nowhere, ends, box } open = Open::nowhere;
  double end_mm = 0;
};

struct SurfaceDifference {
  double dice = 0;                  ///< of what is compared, as all here
  double within_mm = 0;             ///< 95 % of the first one's boundary
  std::vector<std::uint8_t> apart;  ///< at the first one's boundary, as EarComparison::apart
  std::vector<DifferingPlace> places;
};

[[nodiscard]] bool at_boundary(const MaskBox& box, const std::vector<std::uint8_t>& in, std::size_t v);

/// Both on one grid, both with voxels.
[[nodiscard]] SurfaceDifference difference(const MaskBox& ours, const MaskBox& theirs, const Tolerance& tolerance,
                                           const Context& context);

}  // namespace osteo::inline imaging::segment
