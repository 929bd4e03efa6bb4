// The scene of a review as meshes, and from where to look at it.
#pragma once
#include <functional>
#include <vector>

#include "osteo/assessment/evidence/visibility.h"
#include "osteo/assessment/review/review.h"
#include "osteo/simulation/bone/structure_map.h"
#include "osteo/simulation/bone/world.h"

namespace osteo::inline assessment::review {

/// Removed voxels as a surface around them, where they lay at the beginning. `frames`: of the bodies of the session's
/// beginning; a voxel belongs to the one whose voxels are as large.
[[nodiscard]] TriMesh blob_of(const std::vector<VisibilityMetric::Voxel>& voxels, const World& begin,
                              const Context& context);
/// Of all bodies where they lay at the beginning, with normals to light by.
[[nodiscard]] TriMesh bone_at_rest(const World& world, const Context& context);
/// Triangles with a corner in the ball, on their own points.
[[nodiscard]] TriMesh within(const TriMesh& mesh, Vec3 centre_mm, double radius_mm);
/// At most about so many triangles, off by at most `error_mm` where that is enough; with normals.
[[nodiscard]] TriMesh simplified(const TriMesh& mesh, std::size_t triangles, double error_mm);
/// A ball at each place, at most `most` of them; round where it is large.
[[nodiscard]] TriMesh dots_at(const std::vector<Vec3>& places_mm, double radius_mm, std::size_t most);

struct Ball {
  Vec3 centre_mm;
  double radius_mm = 0;
};
/// Around all of them: middle of their box, and the farthest from it.
[[nodiscard]] Ball around(const std::vector<Vec3>& places_mm);
/// Around nine tenths of those near `at_mm`.
[[nodiscard]] Ball close_to(Vec3 at_mm, const std::vector<Vec3>& places_mm);

/// From where places are seen: of 200 directions the one from which most of them are not behind bone, and of equals the
/// one nearest to `wish` (unit).
struct Lookout {
  Vec3 eye;
  double seen_share = 0;
};
[[nodiscard]] Lookout look_at_places(const World& world, const std::vector<Vec3>& places_mm, Vec3 wish);

}  // namespace osteo::inline assessment::review
