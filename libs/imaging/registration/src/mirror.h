// A file with left and right exchanged: what it would show, where it would lie, and whether it is one.
#pragma once
#include <vector>

#include "levels.h"
#include "osteo/core/data/rigid_transform.h"
#include "osteo/imaging/registration/register.h"

namespace osteo::inline imaging::registration {

struct Mirrored {
  Image image;                ///< in the frame of the original
  RigidTransform reflection;  ///< a point of the one to where the other shows it; no proper rotation
};
/// As if the file had left and right exchanged: along the axis of the voxels that points most to the side, so that a
/// head stays upright.
[[nodiscard]] Mirrored in_a_mirror(const Image& image);

/// A body is nearly its own mirror image, so where the mirrored scan lies on the first the scan itself does nearly as
/// well, once turned about the body's plane of symmetry; and the other way round. That plane is not known: one start
/// for each that lies within 30 degrees of upright and 90 mm of `middle_mm`. From the place of the one to places of
/// the other, all proper motions from the first.
[[nodiscard]] std::vector<RigidTransform> starts_from_mirror(const RigidTransform& other_from_first,
                                                             const RigidTransform& reflection, Vec3 middle_mm);

/// How differently left and right lie: what a smooth field that a mirror turns round explains of the offsets of edges,
/// root mean square in mm. A body that is held against its own mirror image shows such a field, twice the unevenness of
/// its sides; held against itself it shows none, however much slices, noise and blur leave at every edge.
struct Unevenness {
  bool known = false;  ///< enough places, and the two motions are nearly each other's mirror image
  double straight_mm = 0, mirrored_mm = 0;
};
[[nodiscard]] Unevenness unevenness(const Levels& first, const Levels& second, const RigidTransform& second_from_first,
                                    const Levels& mirrored, const RigidTransform& mirrored_from_first,
                                    const RigidTransform& reflection, const Context& context);

}  // namespace osteo::inline imaging::registration
