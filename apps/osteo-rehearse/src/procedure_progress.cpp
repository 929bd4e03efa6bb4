#include "procedure_progress.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "osteo/assessment/evidence/detail/product.h"
#include "osteo/geometry/grid/brick_places.h"

namespace osteo {
namespace {

constexpr auto kLeastRest = std::chrono::seconds(2);
constexpr float kSolid = 0.5F;

// What is gone, where it lay.
std::vector<RemovedVoxel> removed_between(const World& begin, const World& now) {
  std::vector<RemovedVoxel> removed;
  for (const PlacedBody& b : begin.bodies()) {
    const BrickGrid& was = b.body->bone;
    const auto mm3 = static_cast<float>(was.frame().voxel_volume_mm3());
    const auto voxels = static_cast<VoxelKey>(was.brick_count() * BrickGrid::kVoxels);
    for (VoxelKey v = 0; v < voxels; ++v) {
      if (was.value(v) < kSolid) continue;
      const PlacedBody* const owner = now.owner(b.body->name_of(v));
      if (owner != nullptr && owner->body->bone.value(b.body->name_of(v) - owner->body->name_of(0)) >= kSolid) continue;
      removed.push_back({place_of_voxel_mm(was, v), mm3});
    }
  }
  return removed;
}

}  // namespace

ProcedureProgress::ProcedureProgress(const Procedure& procedure, const StructureMap& structures, World begin)
    : procedure_(procedure), structures_(structures), begin_(std::move(begin)) {
  for (const ProcedureStep& s : procedure_.steps) steps_.push_back({s.name, s.items.size(), 0});
}

std::vector<TutorNow::Step> ProcedureProgress::judge(const World& now, Vec3 approach,
                                                     const std::vector<std::string>& injured) const {
  Context alone;
  alone.threads = 1;
  const Product product(begin_, now, structures_, procedure_, removed_between(begin_, now), alone);
  std::vector<TutorNow::Step> steps;
  for (const ProcedureStep& s : procedure_.steps) {
    steps.push_back({s.name, s.items.size(), 0});
    for (const ScaleItem& item : procedure_.items) {
      if (std::find(s.items.begin(), s.items.end(), item.name) == s.items.end()) continue;
      const bool counted = item.kind == ItemKind::pieces || item.kind == ItemKind::fixed;
      const Product::Result r = counted ? Product::count(item, now) : product.evaluate(item, approach, injured);
      steps.back().passed += r.measured && r.pass ? 1 : 0;
    }
  }
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
