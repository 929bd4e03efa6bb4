#include "osteo/session/recording/session_reader.h"

#include "osteo/core/base/error.h"

namespace osteo::inline session {

World::Effect apply_action(const SceneAction& action, World& world) {
  World::Effect effect;
  if (!row_of(action).by_servo) effect = world.act(action);
  world.notify(action);
  return effect;
}

std::optional<VoxelChange> apply_change(const VoxelChange& change, World& world) {
  const PlacedBody* const b = world.owner(change.voxel);
  if (b == nullptr) return std::nullopt;
  BrickGrid& bone = b->body->bone;
  const VoxelKey own = change.voxel - b->body->name_of(0);
  const VoxelChange reported{change.voxel, change.density, bone.value(own)};
  bone.set(own, change.density);
  world.notify({&reported, 1});
  return reported;
}

void apply_part(const SessionPart& part, World& world) {
  for (const SceneAction& a : part.actions) apply_action(a, world);
  for (const VoxelChange& c : part.changes) {
    if (!apply_change(c, world))
      throw Error(ExitCode::corrupt, "the session changes a voxel that the bone does not have");
  }
}

}  // namespace osteo::inline session
