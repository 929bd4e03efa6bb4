// How a plate lies on bone.
#pragma once
#include <vector>

#include "osteo/simulation/bone/plates.h"
#include "osteo/simulation/bone/world.h"

namespace osteo::inline simulation {

/// Points of a plate's underside, in its own frame, and how far below each the bone begins, towards the bone; negative
/// where the plate is in bone; `reach_mm` where none is met within that.
struct PlateGap {
  Vec3 at_mm;
  double gap_mm;
  std::uint32_t body;  ///< SceneAction::kNobody where none is met
};
/// Measured along the screws (-z of the plate) to half density, crossings interpolated: within a tenth of a voxel of
/// smooth bone. 1 us a point. A distractor's moving foot stands at `opening_mm`.
[[nodiscard]] std::vector<PlateGap> plate_gaps(const World& world, const PlateModel& plate,
                                               const RigidTransform& world_from_plate, double opening_mm = 0,
                                               int count = 400, double reach_mm = 5);

/// The pieces that a plate would be fixed to: those below most of its underside within `near_mm`, at most two, of a
/// distractor one a foot; the first is the one that the plate stays with. Empty: it is nowhere near bone.
[[nodiscard]] std::vector<std::uint32_t> bodies_under(const World& world, const PlateModel& plate,
                                                      const RigidTransform& world_from_plate, double near_mm = 2);

}  // namespace osteo::inline simulation
