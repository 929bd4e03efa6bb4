// What a surface bounds, by one rule: the winding number is not zero.
#pragma once
#include <cstdint>

#include "osteo/core/base/context.h"
#include "osteo/geometry/mesh/soup.h"

namespace osteo::inline geometry {

/// The part of a surface that has inside on one side and outside on the other.
struct SolidSurface {
  TriangleSoup soup;         ///< facing out; points welded
  std::uint64_t buried = 0;  ///< triangles left out: inside (or outside) on both sides
  std::uint64_t turned = 0;  ///< triangles turned round
};

/// Inside is where the winding number's magnitude exceeds one half (for closed surfaces: is not zero), as for
/// voxels_inside: overlaps count once, a body within a body changes nothing, a shell within a body that faces inward is
/// a cavity, an inside-out body is as if it were not. Triangles are judged by patches (joined over edges of two), each
/// at its largest triangle by rays, in doubt by all solid angles, so that sheets of any thinness are distinguished; of
/// triangles with the same corners one is left at most. The surface's triangles may touch and share edges but must not
/// cross: a patch is judged by one place of it, so find crossings first (self_intersections). O(n log n), in doubt O(n)
/// more a patch. Errors: failed when nothing is left (a sheet, or twice the same surface the other way round).
[[nodiscard]] SolidSurface solid_surface(const TriangleSoup& soup, const Context& context = {});

/// Volume inside by that rule, mm3. Where the surface closes by the divergence theorem (about a point of the surface),
/// less what of it lies within more than once, which is counted in voxels of a two-hundredth of the extent: exact
/// without overlap. Open surfaces: counted, in larger voxels where those would take over 3e7 solid angles.
[[nodiscard]] double inside_volume_mm3(const TriangleSoup& soup, const Context& context = {});

}  // namespace osteo::inline geometry
