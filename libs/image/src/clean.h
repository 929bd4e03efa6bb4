// What is no bone of the patient, cleared from a mask. Private to libs/image.
#pragma once
#include "osteo/base/context.h"
#include "osteo/data/volume.h"

namespace osteo::image {

/// Clears what lies outside the body: table, head holder, wires. The body is the largest piece of matter (above -300 HU) that stays
/// connected when everything thinner than 6 mm is taken away, grown back by 5 mm. When that would take more than a third of the mask
/// (a dry skull has no body), it clears nothing and warns. Returns the number of voxels cleared.
std::size_t clear_outside_body(std::uint8_t* mask, const Image& ct, const Context& context);

/// Within `radius_mm` of metal (at least `metal_hu`), clears mask voxels below `lower_hu`: bright streaks. Metal itself stays.
/// Returns the number of voxels cleared; `metal_voxels` says how much metal there is.
std::size_t clear_streaks(std::uint8_t* mask, const Image& ct, double radius_mm, double metal_hu, double lower_hu,
                          std::size_t& metal_voxels, const Context& context);

}  // namespace osteo::image
