// Who follows the stream of a rehearsal, or of a session that is replayed.
#pragma once
#include <array>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "osteo/simulation/haptics/stream.h"

namespace osteo::inline session {

/// What follows from the stream and the scene, kept up to date: a surface, dust, a score. All calls come from one
/// thread at a time, under the lock that whoever looks at the scene holds (Rehearsal::look); they may allocate and take
/// milliseconds, and an exception ends the rehearsal with it. The same calls come live and in a replay, so that what
/// they tell follows from the session alone.
class Reader {
 public:
  virtual ~Reader() = default;
  /// The scene as it is: the first call of all, unless the reader was made from that scene; and again after ticks or
  /// actions were lost. What follows from the scene has to be made again. Densities may be ahead of the ticks that come
  /// next by what the stream holds.
  virtual void resync(const World& world) { static_cast<void>(world); }
  /// The world was changed by an action (ActionRow::changes_world) that the stream tells of later. Bodies that are new
  /// are still as they were made.
  virtual void scene_changed(const World& world, const World::Effect& effect) {
    static_cast<void>(world);
    static_cast<void>(effect);
  }
  /// A state of its own begins or ends with this action (ActionRow::begins_state), of which the stream tells later:
  /// `world` is as it will be then.
  virtual void begins(const World& world, const SceneAction& action) {
    static_cast<void>(world);
    static_cast<void>(action);
  }
  /// At the beginning of its tick: after all ticks before it, before what changes in it. scene_changed() calls come in
  /// the same order.
  virtual void action(const SceneAction& action) { static_cast<void>(action); }
  /// What was recorded of a hand in a tick, and the voxels it changed (the density before each change too). Ticks in
  /// order, of each tick the hands in theirs.
  virtual void tick(const TickRecord& record, std::span<const VoxelChange> changes) {
    static_cast<void>(record);
    static_cast<void>(changes);
  }
  /// All that the stream held was told: the time for what is too costly to do tick by tick.
  virtual void update() {}
};

/// Drains one end of a stream and tells its readers. One thread at a time.
class ReaderDispatcher {
 public:
  /// `from` and `world` must outlive this. `world`: the scene that the stream is of.
  ReaderDispatcher(StreamReader& from, const World& world);

  /// From now on, until it is removed; it must live as long. A reader that was made from the scene as it is has no need
  /// of resync().
  void add(Reader& reader, bool resync = true);
  void remove(Reader& reader);

  /// Tells what the stream holds, then update() where that was anything. Where the stream had to leave something out,
  /// resync() comes before that. Returns the records taken. With `about` (the clock's, ms; it changes no result, only
  /// when it comes) it may leave some in the stream: for whoever holds a lock that others wait for.
  std::size_t drain(std::optional<double> about_ms = {});
  /// The world was changed by an action that the stream will tell of; drained as far as it went before.
  void scene_changed(const World::Effect& effect);
  /// A state begins or ends with it (Reader::begins); drained before, and nothing is removed until its tick.
  void begins(const SceneAction& action);
  /// The servo has ended after so many ticks, and drain() took what there was: actions behind the last tick are told,
  /// and if the last ticks are missing that counts as lost.
  void end(std::uint64_t ticks);

  [[nodiscard]] std::uint64_t ticks_lost() const { return ticks_lost_; }
  /// The last record taken of a hand (below kMaxHands).
  [[nodiscard]] const TickRecord& latest(std::size_t hand = 0) const { return latest_[hand]; }

 private:
  std::size_t take_actions();
  void notify(const SceneAction& action);
  void resync_and_update(bool lost);

  StreamReader& from_;
  const World& world_;
  std::vector<Reader*> readers_;
  std::deque<SceneAction> actions_;                // taken from the stream, their ticks not yet
  std::map<std::uint32_t, SceneAction> standing_;  // by kind: what goes on until the next of its kind: sucker, water
  std::vector<TickRecord> ticks_;
  std::vector<VoxelChange> changes_;
  std::array<TickRecord, kMaxHands> latest_;
  std::optional<std::uint64_t> next_tick_;
  std::uint64_t ticks_lost_ = 0, actions_dropped_ = 0;
};

}  // namespace osteo::inline session
