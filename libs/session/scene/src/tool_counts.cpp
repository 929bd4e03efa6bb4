#include "osteo/session/scene/detail/tool_counts.h"

namespace osteo::inline session {

void ToolCounts::scene_changed(const World& world, const World::Effect& effect) {
  double mm3 = 0;
  for (const auto& [name, density] : effect.dust)
    mm3 += static_cast<double>(density) * world.owner(name)->body->bone.frame().voxel_volume_mm3();
  const std::lock_guard lock(mutex_);
  waiting_mm3_.push_back(mm3);
}

void ToolCounts::action(const SceneAction& action) {
  const std::lock_guard lock(mutex_);
  if (row_of(action).changes_world && !waiting_mm3_.empty()) {
    (action.is(ActionKind::split) ? crumbs_mm3_ : sawn_mm3_) += waiting_mm3_.front();
    waiting_mm3_.pop_front();
  }
  undone_ += action.is(ActionKind::undo) ? 1 : 0;
}

void ToolCounts::tick(const TickRecord& record, std::span<const VoxelChange> /*changes*/) {
  const std::lock_guard lock(mutex_);
  if (record.voxels_changed > 0) burrs_used_.insert(record.device.tool);
  ticks_without_room_ += (record.flags & kNoRoom) != 0 ? 1 : 0;
  unusable_poses_ += (record.flags & kPoseInvalid) != 0 ? 1 : 0;
}

}  // namespace osteo::inline session
