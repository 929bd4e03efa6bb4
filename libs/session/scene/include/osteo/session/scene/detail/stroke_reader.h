// Tells the world of the burr's strokes, so that undo takes them back.
#pragma once
#include "osteo/session/scene/reader.h"

namespace osteo::inline session {

/// Whoever changes a world by actions while a servo drills it needs one of these on the servo's stream, drained before
/// each action that looks at densities: a session's undo then takes back the same in every replay. Where ticks were
/// lost it forgets what came before, and undo is refused rather than wrong.
class StrokeReader final : public Reader {
 public:
  explicit StrokeReader(World& world) : world_(world) {}
  void resync(const World& /*world*/) override { world_.forget(); }
  void action(const SceneAction& action) override { world_.tell(action); }
  void tick(const TickRecord& /*record*/, std::span<const VoxelChange> changes) override { world_.tell(changes); }

 private:
  World& world_;
};

}  // namespace osteo::inline session
