#include "osteo/session/scene/detail/stroke_reader.h"

#include <utility>

namespace osteo::inline session {

void StrokeReader::end_part(const std::optional<SceneAction>& action) {
  parts_.push_back({std::exchange(changes_, {}), action});
  at_.clear();
}

void StrokeReader::resync(const World& /*world*/) {
  const std::lock_guard lock(mutex_);
  end_part({});
}

// Only of those that the world makes something of: some come a hundred times a second.
void StrokeReader::action(const SceneAction& action) {
  if (!action.is(ActionKind::stroke) && !row_of(action).changes_world) return;
  const std::lock_guard lock(mutex_);
  end_part(action);
}

void StrokeReader::tick(const TickRecord& /*record*/, std::span<const VoxelChange> changes) {
  if (changes.empty()) return;
  const std::lock_guard lock(mutex_);
  for (const VoxelChange& c : changes) {
    const auto [known, is_new] = at_.try_emplace(c.voxel, static_cast<std::uint32_t>(changes_.size()));
    if (is_new) {
      changes_.push_back(c);
    } else {
      changes_[known->second].density = c.density;
    }
  }
}

void StrokeReader::report_to(World& world) {
  const std::lock_guard lock(mutex_);
  for (const Part& p : std::exchange(parts_, {})) {
    world.notify(p.changes);
    if (p.action) {
      world.notify(*p.action);
    } else {
      world.forget();
    }
  }
  world.notify(changes_);
  changes_.clear();
  at_.clear();
}

}  // namespace osteo::inline session
