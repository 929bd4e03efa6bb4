// How far a procedure is, judged beside a session that runs.
#pragma once
#include <chrono>
#include <future>
#include <string>
#include <vector>

#include "osteo/app/window/tutor_now.h"
#include "osteo/assessment/evidence/procedure.h"
#include "osteo/session/scene/rehearsal.h"

namespace osteo {

/// Of each step, how many of its items pass with the bone as it is; those of the bone as osteo score has them. In a
/// thread of its own, which rests ten times as long as it worked.
class ProcedureProgress {
 public:
  /// `procedure` and `structures` must outlive this. `begin`: the scene before the first tick.
  ProcedureProgress(const Procedure& procedure, const StructureMap& structures, World begin);
  /// With each picture: takes up what was judged, and judges again when bone went since. `injured`: structures that a
  /// rotating burr or a saw has reached.
  const std::vector<TutorNow::Step>& look(Rehearsal& rehearsal, const std::vector<std::string>& injured);

 private:
  [[nodiscard]] std::vector<TutorNow::Step> judge(const World& now, Vec3 approach,
                                                  const std::vector<std::string>& injured) const;
  const Procedure& procedure_;
  const StructureMap& structures_;
  const World begin_;
  std::vector<TutorNow::Step> steps_;
  double judged_mm3_ = -1;  // not yet
  std::chrono::steady_clock::time_point begun_{}, next_{};
  std::future<std::vector<TutorNow::Step>> work_;  // the last: it ends before what it looks at
};

}  // namespace osteo
