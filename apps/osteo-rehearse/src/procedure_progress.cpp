#include "procedure_progress.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "osteo/assessment/evidence/score.h"

namespace osteo {
namespace {

constexpr auto kLeastRest = std::chrono::seconds(2);
}  // namespace

ProcedureProgress::ProcedureProgress(const Procedure& procedure, const StructureMap& structures, World begin)
    : procedure_(procedure), structures_(structures), begin_(std::move(begin)) {
  for (const ProcedureStep& s : procedure_.steps) steps_.push_back({s.name, s.items.size(), 0});
}

std::vector<TutorNow::Step> ProcedureProgress::judge(const World& now, Vec3 approach,
                                                     const std::vector<std::string>& injured) const {
  Context alone;
  alone.threads = 1;
  std::vector<TutorNow::Step> steps;
  for (const StepProgress& s : step_progress(begin_, now, structures_, procedure_, approach, injured, alone))
    steps.push_back({s.name, s.items, s.passed});
  return steps;
}

const std::vector<TutorNow::Step>& ProcedureProgress::look(Rehearsal& rehearsal,
                                                           const std::vector<std::string>& injured) {
  const auto now = std::chrono::steady_clock::now();
  if (work_.valid()) {
    if (work_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return steps_;
    steps_ = work_.get();
    next_ = now + std::max<std::chrono::steady_clock::duration>(kLeastRest, 10 * (now - begun_));
  }
  const double gone = rehearsal.removed_mm3() + rehearsal.sawn_mm3();
  if (now < next_ || gone == judged_mm3_) return steps_;
  judged_mm3_ = gone;
  begun_ = now;
  // Read while the burr works on: a voxel that goes meanwhile is judged the next time.
  std::shared_ptr<const World> bone;
  rehearsal.look([&](const World& world, SceneReaders&) { bone = std::make_shared<const World>(world.copy()); });
  const Vec3 approach = normalized(from_floats(rehearsal.latest().device.axis));
  work_ = std::async(std::launch::async, [this, bone, approach, injured] { return judge(*bone, approach, injured); });
  return steps_;
}

}  // namespace osteo
