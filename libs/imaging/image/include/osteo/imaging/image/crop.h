// A region cut out of a CT.
#pragma once
#include "osteo/core/base/context.h"
#include "osteo/core/base/param.h"
#include "osteo/core/data/volume.h"

namespace osteo::inline imaging {

/// whole: nothing is cut. box: centre_mm and size_mm. The others are found from the skull.
enum class Region : int { whole, box, left_temporal, right_temporal, jaw };
[[nodiscard]] constexpr std::array<std::string_view, 5> enum_names(Region) {
  return {"whole", "box", "left_temporal", "right_temporal", "jaw"};
}

struct CropParams {
  Region region = Region::whole;
  std::array<double, 3> centre_mm{0, 0, 0};
  std::array<double, 3> size_mm{0, 0, 0};
};

struct Box {
  Vec3 lo_mm, hi_mm;  ///< along the body's axes, LPS
};

/// Where the region lies. Named regions go by the largest piece of bone: its top, its sides, its middle; the distances
/// are those of an adult head (ear canal 122 mm below the vertex). A first box, to be moved by hand: `centre_mm` and
/// `size_mm` that are not all zero take the place of what was found. Errors: usage for a box without size; failed when
/// the scan does not reach the top of the head.
[[nodiscard]] Box find_region(const Image& ct, const CropParams& params);

/// Where bone goes on beyond the scan that the box reaches past by more than 5 mm: "below by 28 mm", the sides with
/// commas between them. Empty: all bone of the box is in the scan.
[[nodiscard]] std::string bone_beyond_scan(const Image& ct, const Box& box);

/// The smallest block of whole voxels that covers the box. Error(usage) when the box lies outside.
[[nodiscard]] Image crop(const Image& ct, const Box& box);
[[nodiscard]] Labels crop(const Labels& labels, const Box& box);

}  // namespace osteo::inline imaging
