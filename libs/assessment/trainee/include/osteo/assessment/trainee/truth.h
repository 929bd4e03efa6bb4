// What a simulated trainee itself knows of what it left: from the places of its burr alone, not from voxels.
#pragma once
#include <optional>
#include <vector>

#include "osteo/assessment/evidence/procedure.h"
#include "osteo/simulation/bone/structure_map.h"

namespace osteo::inline assessment {

/// A ball of the burr where it drilled.
struct SweptBall {
  Vec3 centre_mm;
  double radius_mm = 0;
};

struct OwnTruth {
  const ScaleItem* item = nullptr;
  double value = 0;
  bool pass = false;
};

/// Of each item that can be told from the balls and the face of its structure: exposed, not_violated, no_hole, thinned
/// (balls); the others, and those of spaces to be entered, are left out. Cover of a place on the face: its distance
/// from the nearest ball. A second way to the same question as Product: no lattice, no cavity, no densities.
/// O(triangles x balls near them).
[[nodiscard]] std::vector<OwnTruth> own_truth(const Procedure& procedure, const StructureMap& structures,
                                              const std::vector<SweptBall>& swept);

}  // namespace osteo::inline assessment
