// What is no bone of the patient, cleared from a mask. Private to libs/imaging/image.
#pragma once
#include <string>
#include <vector>

#include "osteo/core/base/context.h"
#include "osteo/core/data/volume.h"

namespace osteo::inline imaging::image {

/// Table, head holder, wires: what lies outside the body.
///
/// The body is the largest piece of matter (above -300 HU) that stays connected when everything thinner than 6 mm is
/// taken away, grown back by 5 mm; it has to be soft tissue for at least a half (-150 to 150 HU), to hold a third of
/// the mask, and to cover it: 0.85 of the mask within lie 2 mm deep or more (0.95 to 0.99 of heads, 0.2 of a skull
/// phantom filled with resin). Outside is what is farther than that from it and also outside its convex hull in the
/// slice: cells and thin walls in air (nose, sinuses, mastoid) lie within the hull. Without such a body (a dry skull)
/// the hull is that of the largest piece of the mask, and nothing is certain.
struct Outside {
  bool body = false;  ///< there is a body of soft tissue
  std::vector<std::size_t>
      certain;  ///< voxels of pieces that are table or holder for certain: all of them outside, touching nothing
                ///< within, and no other soft tissue thicker than 6 mm, as of a limb, near them
  std::vector<std::size_t> doubtful;  ///< other voxels outside
  int pieces = 0;  ///< certain ones; of at least 10 mm3: smaller ones are specks, and neither certain nor doubtful
  double nearest_mm = 0;  ///< of the certain to the body
  std::string doubt;      ///< why the others may be bone
};
/// Changes nothing. O(voxels).
[[nodiscard]] Outside find_outside(const std::uint8_t* mask, const Image& ct, const Context& context);

/// Within `radius_mm` of metal (at least `metal_hu`), clears mask voxels below `lower_hu`: bright streaks. Metal itself
/// stays. Returns the number of voxels cleared; `metal_voxels` says how much metal there is.
std::size_t clear_streaks(std::uint8_t* mask, const Image& ct, double radius_mm, double metal_hu, double lower_hu,
                          std::size_t& metal_voxels, const Context& context);

}  // namespace osteo::inline imaging::image
