// A simulated trainee at work: the plan, the hand and what it sees, in front of the same servo as everybody else.
#pragma once
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "osteo/assessment/trainee/skill.h"
#include "osteo/assessment/trainee/truth.h"
#include "osteo/assessment/trainee/work_plan.h"
#include "osteo/session/scene/session_folder.h"

namespace osteo::inline assessment {

/// What all sessions of a case share, read once.
struct TraineeScene {
  Case the_case;
  HapticSetup haptics;
  Anatomy anatomy;
  Procedure procedure;
};
/// With the case's own haptic settings. Error(usage) where it has no structures; else as load_case.
[[nodiscard]] TraineeScene trainee_scene(const std::filesystem::path& case_folder, Procedure procedure,
                                         const Context& context = {});

struct TraineeOptions {
  TraineeSkill skill;
  std::uint64_t seed = 1;
  double most_s = 120;  ///< then it stops where it is
  WorkPlanOptions plan;
};

struct SimulatedSession {
  RehearsalSummary summary;
  WorkPlan plan;
  std::vector<OwnTruth> truth;
  bool finished = false;  ///< it came to the end of its plan
  double seconds = 0;     ///< of the session, not of the machine
};

/// `begin`: the bone, as world_of() gives it. Runs as fast as possible in this thread and writes the session into
/// `folder`: stream, summary, and trainee.json with skill, seed, plan and what the trainee itself knows of what it
/// left. The stream has a note of kind `simulated`, the summary a key of that name. Same arguments, same bits of the
/// stream but for the times that the machine took. Several may run at a time on one scene. Errors: as plan_work and
/// Rehearsal.
SimulatedSession simulate_trainee(const TraineeScene& scene, World begin, const TraineeOptions& options,
                                  const SessionFolder& folder, const Context& context = {});

}  // namespace osteo::inline assessment
