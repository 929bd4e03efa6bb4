// The scene of a session as of a tick, for whoever draws it: bone, surfaces and dust, told by a replay or by what was
// recorded.
#pragma once
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "osteo/session/recording/session_reader.h"
#include "osteo/session/scene/scene_readers.h"

namespace osteo::inline session {

/// Keeps a world of its own (memory: a copy of the bone), so that densities are never ahead of the ticks that were
/// told.
class SessionScene final : public Reader {
 public:
  SessionScene(const ReaderList& follow, double rate_hz, const Context& context)
      : follow_(follow), rate_hz_(rate_hz), context_(context) {}

  /// The scene it begins with; again: it begins again.
  void resync(const World& world) override;
  void action(const SceneAction& action) override;
  void tick(const TickRecord& record, std::span<const VoxelChange> changes) override;
  /// Densities alone, in either direction of time: what dust follows is not told. Before refresh().
  void set(std::span<const VoxelChange> changes);

  /// Surfaces are as of the last tick told.
  void refresh();
  /// Null before resync().
  [[nodiscard]] const World* world() const { return world_ ? &*world_ : nullptr; }
  [[nodiscard]] SceneReaders& readers() { return *readers_; }
  /// A hand (below kMaxHands) that is to be drawn: the first from its first tick on, others once they have pressed a
  /// pedal or touched bone. What waits beside the drill for keys that nobody pressed is not.
  [[nodiscard]] bool in_use(std::size_t hand) const { return in_use_[hand]; }
  /// The last record told of it.
  [[nodiscard]] const TickRecord& latest(std::size_t hand = 0) const { return latest_[hand]; }
  /// Bone that burrs took, so far.
  [[nodiscard]] double removed_mm3() const { return removed_mm3_; }

 private:
  ReaderList follow_;
  double rate_hz_;
  Context context_;
  std::optional<World> world_;
  std::unique_ptr<SceneReaders> readers_;
  std::array<TickRecord, kMaxHands> latest_{};
  std::array<bool, kMaxHands> in_use_{};
  std::vector<VoxelChange> reported_changes_;
  double removed_mm3_ = 0;
};

/// Tells a reader what was recorded, without running it again: over gaps too, and of sessions that this build cannot
/// repeat. Files keep what a tenth of a second changed, so all of that comes with its last tick. First resync() with
/// `begin`; where the bone is not known any more (SessionOutline::bone_known_until) it ends. Error(corrupt) when the
/// session is of another bone.
void report_recorded(const SessionReader& session, const World& begin, Reader& reader, const Context& context = {});

}  // namespace osteo::inline session
