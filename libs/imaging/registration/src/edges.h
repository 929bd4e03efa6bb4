// Points on strong edges of one scan, and where the same edges lie in another.
#pragma once
#include <optional>
#include <vector>

#include "levels.h"
#include "osteo/imaging/registration/register.h"

namespace osteo::inline imaging::registration {

/// The motion that brings edges upon edges, from a guess that is right to 2 mm. Blind to how bright the sides are, so a
/// coil's shading, which pulls mutual information by some tenths of a millimetre, does not matter. The guess itself
/// where there are too few edges.
[[nodiscard]] RigidTransform fit_edges(const Levels& first, const Levels& second, const RigidTransform& guess,
                                       const Context& context);

[[nodiscard]] EdgeResidual edge_residual(const Levels& first, const Levels& second,
                                         const RigidTransform& second_from_first, const Context& context);

/// The same edges of the first under two motions, each onto a scan of its own.
struct TwoOffsets {
  Vec3 at_mm, normal;
  std::optional<double> one_mm, other_mm;  ///< along the normal; nothing where no like edge was found
};
[[nodiscard]] std::vector<TwoOffsets> offsets_of_two(const Levels& first, const Levels& one,
                                                     const RigidTransform& one_from_first, const Levels& other,
                                                     const RigidTransform& other_from_first, const Context& context);

}  // namespace osteo::inline imaging::registration
