// How far a procedure is while a session runs.
#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "osteo/assessment/evidence/procedure.h"
#include "osteo/core/base/context.h"
#include "osteo/simulation/bone/structure_map.h"
#include "osteo/simulation/bone/world.h"

namespace osteo::inline assessment {

struct StepProgress {
  std::string name;
  std::size_t items = 0, passed = 0;  ///< all of them: it is done, as Score::steps says at the end
};

/// Of each step of the procedure, with the bone as it is `now`, judged as score_session() judges it at the end; what is
/// gone is the difference to `begin`, of which `now` is a later state. `approach`: unit, from the bone to who drills.
/// `injured`: names of structures that a rotating burr or a saw has reached. `now` may change meanwhile: what goes is
/// seen or not. O(voxels of both); about as long as the final product of osteo score.
[[nodiscard]] std::vector<StepProgress> step_progress(const World& begin, const World& now,
                                                      const StructureMap& structures, const Procedure& procedure,
                                                      Vec3 approach, const std::vector<std::string>& injured,
                                                      const Context& context = {});

}  // namespace osteo::inline assessment
