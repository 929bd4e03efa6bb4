#include "osteo/assessment/evidence/detail/progress.h"

#include <algorithm>

#include "osteo/assessment/evidence/detail/product.h"
#include "osteo/geometry/grid/brick_places.h"

namespace osteo::inline assessment {
namespace {

constexpr float kGone = 0.5F;

// What is gone, where it lay.
std::vector<RemovedVoxel> removed_between(const World& begin, const World& now) {
  std::vector<RemovedVoxel> removed;
  for (const PlacedBody& b : begin.bodies()) {
    const BrickGrid& was = b.body->bone;
    const auto mm3 = static_cast<float>(was.frame().voxel_volume_mm3());
    const auto voxels = static_cast<VoxelKey>(was.brick_count() * BrickGrid::kVoxels);
    for (VoxelKey v = 0; v < voxels; ++v) {
      if (was.value(v) < kGone) continue;
      const PlacedBody* const owner = now.owner(b.body->name_of(v));
      if (owner != nullptr && owner->body->bone.value(b.body->name_of(v) - owner->body->name_of(0)) >= kGone) continue;
      removed.push_back({place_of_voxel_mm(was, v), mm3});
    }
  }
  return removed;
}

}  // namespace

std::vector<StepProgress> step_progress(const World& begin, const World& now, const StructureMap& structures,
                                        const Procedure& procedure, Vec3 approach,
                                        const std::vector<std::string>& injured, const Context& context) {
  const Product product(begin, now, structures, procedure, removed_between(begin, now), context);
  std::vector<StepProgress> steps;
  for (const ProcedureStep& s : procedure.steps) {
    steps.push_back({s.name, s.items.size(), 0});
    for (const ScaleItem& item : procedure.items) {
      if (std::find(s.items.begin(), s.items.end(), item.name) == s.items.end()) continue;
      const bool counted = item.kind == ItemKind::pieces || item.kind == ItemKind::fixed;
      const Product::Result r = counted ? Product::count(item, now) : product.evaluate(item, approach, injured);
      steps.back().passed += r.measured && r.pass ? 1 : 0;
    }
  }
  return steps;
}

}  // namespace osteo::inline assessment
