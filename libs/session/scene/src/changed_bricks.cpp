#include "osteo/session/scene/detail/changed_bricks.h"

namespace osteo::inline session {

std::vector<ChangedBricks> changed_bricks(const World& world, const World::Effect& effect) {
  std::vector<ChangedBricks> all;
  for (const auto& changed : effect.changed) {
    const BrickGrid& bone = world.find(changed.body)->body->bone;
    ChangedBricks bricks{changed.body, changed.bricks, {}};
    bricks.values.reserve(changed.bricks.size() * BrickGrid::kVoxels);
    for (const std::uint32_t b : changed.bricks) {
      for (VoxelKey v = b * BrickGrid::kVoxels; v < (b + 1) * BrickGrid::kVoxels; ++v)
        bricks.values.push_back(bone.value(v));
    }
    all.push_back(std::move(bricks));
  }
  return all;
}

}  // namespace osteo::inline session
