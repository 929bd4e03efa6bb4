// Tells the world of the burr's strokes, so that undo takes them back.
#pragma once
#include <mutex>
#include <optional>
#include <unordered_map>
#include <vector>

#include "osteo/session/scene/reader.h"

namespace osteo::inline session {

/// Whoever changes a world by actions while a servo drills it needs one of these on the servo's stream, drained before
/// each action that looks at densities: a session's undo then takes back the same in every replay. It may be told in
/// any one thread, and keeps what it hears until report_to(): who draws the world for long holds up no stroke. Memory
/// until then: about 60 bytes for each voxel of a stroke. Where ticks were lost the world forgets what came before, and
/// undo is rejected rather than wrong.
class StrokeReader final : public Reader {
 public:
  void resync(const World& world) override;
  void action(const SceneAction& action) override;
  void tick(const TickRecord& record, std::span<const VoxelChange> changes) override;
  /// All that was kept, in its order; under the lock of whoever changes that world.
  void report_to(World& world);

 private:
  // Up to an action, or to where something was lost (no action).
  struct Part {
    std::vector<VoxelChange> changes;  // of each voxel from its first density to its last
    std::optional<SceneAction> action;
  };
  void end_part(const std::optional<SceneAction>& action);

  std::mutex mutex_;
  std::vector<Part> parts_;
  std::vector<VoxelChange> changes_;  // of the part that goes on
  std::unordered_map<VoxelKey, std::uint32_t> at_;
};

}  // namespace osteo::inline session
