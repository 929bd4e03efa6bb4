// Operations on a bone mask as functions from one mask to the next. Private to libs/imaging/edit.
#pragma once
#include <functional>
#include <string>

#include "osteo/core/base/context.h"
#include "osteo/imaging/edit/bit_mask.h"
#include "osteo/imaging/edit/detail/operation.h"

namespace osteo::inline imaging {

/// Changes `bone` as the operation says, which must change bone. Returns what a person has to know beside the volumes,
/// else empty.
std::string run_on_bone(const EditOperation& operation, const Image& ct, BitMask& bone, const Context& context);

/// Rows of voxels whose centres lie within `radius_mm` of the segment from `a` to `b` (LPS mm), each with its range
/// along x.
void rows_of_capsule(const Frame& frame, Vec3 a, Vec3 b, double radius_mm,
                     const std::function<void(std::size_t row, int begin, int end)>& visit);

/// The voxel that holds a point; nothing outside the volume.
[[nodiscard]] bool voxel_at(const Frame& frame, Vec3 world_mm, std::array<int, 3>& ijk);

}  // namespace osteo::inline imaging
