// The pictures and the meshes of a review.
#pragma once
#include "osteo/assessment/review/review.h"

namespace osteo::inline assessment::review {

inline constexpr std::array<std::uint8_t, 3> kHiddenRgb{204, 78, 32}, kSeenRgb{124, 152, 178},
    kUnknownRgb{150, 150, 150}, kBoneRgb{237, 224, 196};

/// Fills Review::pictures, meshes and left_out.
void draw_pictures(Review& review, const World& begin, const World& end, const StructureMap* structures,
                   const ScoreDetail& detail, const std::vector<CameraPose>& cameras, const Context& context);

}  // namespace osteo::inline assessment::review
