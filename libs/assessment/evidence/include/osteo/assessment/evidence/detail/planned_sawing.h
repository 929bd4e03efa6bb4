// How far bone was sawn from where it was planned.
#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "osteo/assessment/evidence/metric.h"
#include "osteo/session/recording/planned_cuts.h"
#include "osteo/simulation/bone/world.h"

namespace osteo::inline assessment {

/// The slot that was sawn for a planned cut: the plane in its middle.
struct SawnPlane {
  double off_mm = 0;       ///< from the planned plane, in the middle of the slot; towards the planned normal
  double angle_deg = 0;    ///< between both planes
  Vec3 at_mm, normal;      ///< middle of the slot; unit
  std::size_t voxels = 0;  ///< that bone went from in the slot: what says so
  std::string why;         ///< there is no such plane; empty where there is
};

/// For each planned cut, in their order. `whole`: the bone before anything was sawn; `left`: as it is now, in pieces
/// that lie anywhere. Each piece is measured where it lay at rest, so moving it changes nothing; nor does the order of
/// cuts or by whom bone was taken.
///
/// A slot is looked for within 5 mm and 20 degrees of the plan, 40 mm around its place, by the bone that is gone: the
/// plane that most of it lies along, then least squares over each voxel by how much of it went. A slot belongs to one
/// planned cut, the one that it is nearest to. Off by less than 0.05 mm and 0.2 degrees on voxels of 0.5 mm. O(voxels).
[[nodiscard]] std::vector<SawnPlane> sawn_planes(const World& whole, const World& left,
                                                 std::span<const PlannedCut> cuts);
/// As metrics of a score.
[[nodiscard]] std::vector<Measured> planned_cut_values(const World& whole, const World& left,
                                                       std::span<const PlannedCut> cuts);

}  // namespace osteo::inline assessment
