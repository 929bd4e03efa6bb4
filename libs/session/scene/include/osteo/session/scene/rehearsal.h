// A rehearsal put together: world, device, servo, and the readers of its stream.
#pragma once
#include <algorithm>
#include <deque>
#include <exception>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>

#include "osteo/core/rt/loop.h"
#include "osteo/session/recording/recorder.h"
#include "osteo/session/recording/script.h"
#include "osteo/session/recording/session_reader.h"
#include "osteo/session/scene/operation.h"
#include "osteo/session/scene/scene_readers.h"
#include "osteo/session/scene/soft_tissue.h"
#include "osteo/simulation/haptics/structure_judge.h"

namespace osteo::inline session {

class StructureReader;

struct RehearsalOptions {
  double rate_hz = 1000;
  HapticSetup haptics;
  Anatomy anatomy;  ///< hardness where haptics.hardness is set; critical structures where the case has them
  std::filesystem::path session_file;  ///< empty: not recorded
  ReaderList follow;                   ///< what is kept up beside the servo; dust and heat: at the beginning
  std::vector<SceneAction> actions;    ///< done when their tick has come, in order
  std::shared_ptr<SoftTissue> soft;    ///< soft tissue that the hands' tools meet; null: none
  std::function<void(const std::string& kind, const std::string& json)>
      heard;  ///< each note too, in the thread that leaves it
};

/// An action that was rejected, or done otherwise than asked.
struct ActionNote {
  std::uint64_t tick = 0;
  ActionKind kind{};
  bool done = false;
  std::string why;
  std::uint64_t times = 1;  ///< in a row
};

struct RehearsalSummary {
  std::uint64_t ticks = 0;
  double removed_mm3 = 0;                 ///< by the burr
  double sawn_mm3 = 0;                    ///< by the saw
  double crumbs_mm3 = 0;                  ///< crumbs of splits
  double gone_mm3 = 0;                    ///< of the bone at the beginning, what is not there at the end: without what
                                          ///< undo gave back, which the three above count; 0 after a failure
  double tissue_mm3 = 0;                  ///< soft tissue cut off, as at rest
  std::vector<SoftTissue::Facts> tissue;  ///< each body; empty where the scene has none
  std::string bone_hash, surface_hash;
  std::uint64_t ticks_not_recorded = 0;  ///< in the gaps
  std::vector<RecordingGap> gaps;
  std::uint64_t notes_not_recorded = 0;
  std::uint64_t ticks_not_followed = 0;  ///< surface and pieces caught up with them from the bone itself; dust lies a
                                         ///< little elsewhere than in a replay
  bool interrupted = false;              ///< run_to_end() was asked to stop
  std::uint64_t session_bytes = 0;
  std::map<std::uint32_t, StructureEvents> structures;  ///< by their value; empty where the scene has none
  std::vector<StructureCutEvent> structure_cuts;        ///< in their order; what was taken back too
  std::optional<Dust::Totals> dust;                     ///< where the scene has dust
  double voxel_mm3 = 0;                                 ///< turns the mass of a piece into a volume
  std::vector<LiveComponents::Component>
      pieces;              ///< of at least PiecesReader::kMinPieceMm3, largest first; empty unless they were followed
  std::size_t bodies = 1;  ///< that move on their own
  std::vector<Fixture> fixtures;
  std::optional<LoopStats> loop;      ///< only when it ran in real time
  std::vector<std::string> warnings;  ///< what makes it less true than it looks, and what to do about it
  std::vector<ActionNote> notes;
  std::uint64_t unusable_poses = 0;  ///< ticks in which the device gave none that could be used
  [[nodiscard]] bool refused() const {
    return std::any_of(notes.begin(), notes.end(), [](const ActionNote& n) { return !n.done; });
  }
};

/// Owns the world while it runs. The servo's thread writes densities; the recorder and the readers are told through the
/// stream; the follower's thread drains it for all readers and changes the scene. Who holds which lock:
/// docs/developer/threads.md.
class Rehearsal {
 public:
  /// As many devices as options.haptics has hands, in their order. Error(usage) when they are not as many;
  /// cannot_write.
  Rehearsal(World world, std::vector<std::unique_ptr<Device>> devices, const RehearsalOptions& options,
            const Context& context);
  /// Of one hand.
  Rehearsal(World world, std::unique_ptr<Device> device, const RehearsalOptions& options, const Context& context);
  ~Rehearsal();

  /// In real time, in threads of its own.
  void start();
  [[nodiscard]] bool running() const;
  /// Ends the threads, takes the rest of the stream, does what was due and waits, closes the session file (which may
  /// wait for the disk), and then throws what a thread threw, if one did. Error(cannot_write) when it could not be
  /// recorded to the end. Again: the same summary.
  RehearsalSummary stop();

  /// As fast as possible in this thread, up to the device's end, or until the context is cancelled or nothing can be
  /// recorded any more. Same bone, surface and session as in real time. Errors as stop().
  RehearsalSummary run_to_end(const Context& context);

  /// In place of start() and run_to_end(), for a session that runs elsewhere: its next tick is done here, with what was
  /// done at its beginning, and the devices have its samples. From one thread, until stop(), which comes after its last
  /// call. The same bits as there.
  void step_elsewhere(std::span<const SceneAction> actions);
  /// What was done behind its last tick; stop() comes next.
  void end_elsewhere(std::span<const SceneAction> behind);
  /// Readers are told what they were not told yet; from the thread of step_elsewhere(), which does so every 16 ticks by
  /// itself.
  void catch_up();
  /// Where it runs elsewhere: who sits here is shown first, by what `now` tells of the hand; in place of `hand`, which
  /// is told in its place. `device` is what this hand is moved by. All must outlive this, or the next call; null: the
  /// hands as they are.
  void seat(Device* device, const Seqlock<TickRecord>* now, std::size_t hand);

  /// From any thread: soon, in the order they were asked for. One that waits is replaced by the next where that is
  /// enough (ActionRow::last_counts). What runs elsewhere is changed there alone: rejected.
  void act(const SceneAction& action);
  /// From any thread but the servo's: something that does not touch physics, at the tick that comes next. Counted where
  /// it is not kept.
  void note(const std::string& kind, const std::string& json);
  /// Why the last action that could not be done was not, or which structures the last cut or screws went through; once.
  std::string take_refusal();

  /// From any thread, while it runs: how the recording does (nothing lost, where none was asked for).
  [[nodiscard]] Recorder::Status recording() const { return recorder_ ? recorder_->status() : Recorder::Status{}; }
  /// For people, in a line: recording that has ended, that lost ticks or lags by more than 3 s, a device's thread in
  /// trouble. Empty: all well.
  [[nodiscard]] std::string trouble() const;

  /// Latest tick of a hand, for display.
  [[nodiscard]] TickRecord latest(std::size_t hand = 0) const;
  /// By burrs, and by saws whose plane was placed; what was taken back counts too.
  [[nodiscard]] double removed_mm3() const { return operation_.removed_mm3(); }
  [[nodiscard]] double sawn_mm3() const { return readers_->tools.sawn_mm3(); }
  /// Soft tissue cut off; 0 where the scene has none.
  [[nodiscard]] double tissue_mm3() const { return tissue_mm3_; }
  [[nodiscard]] bool realtime() const { return loop_ && loop_->realtime(); }
  /// Parts that are connected, of at least PiecesReader::kMinPieceMm3, as last seen; 0 unless they are followed.
  [[nodiscard]] int pieces() const { return pieces_; }
  /// Null where the scene has none.
  [[nodiscard]] const StructureMap* structures() const { return options_.anatomy.structures.get(); }
  [[nodiscard]] double rate_hz() const { return options_.rate_hz; }
  /// Edge of the finest voxels in the scene.
  [[nodiscard]] double finest_voxel_mm() const { return finest_voxel_mm_; }
  [[nodiscard]] std::size_t hands() const { return devices_.size(); }
  [[nodiscard]] Device& device(std::size_t hand = 0) {
    return hand == 0 && seat_ != nullptr ? seat_->held() : devices_[hand]->held();
  }
  /// The settings as the last action has left them.
  [[nodiscard]] HapticsParams settings() const;
  /// Whether dust and water, or heat, are there now: what was asked for by an action comes a few ticks later. Waits for
  /// the lock of look().
  [[nodiscard]] bool simulates(Simulated what);
  /// Null where the scene has none; under look() only.
  [[nodiscard]] SoftTissue* soft() const { return options_.soft.get(); }
  /// Its bodies as they were last, from any thread.
  [[nodiscard]] std::vector<SoftTissue::Facts> tissue() const {
    return options_.soft ? options_.soft->facts() : std::vector<SoftTissue::Facts>{};
  }
  /// Calls f under the lock that keeps the follower away: bodies, plates, surfaces and dust do not change meanwhile,
  /// densities may.
  void look(const std::function<void(const World&, SceneReaders&)>& f);

  /// From any thread but a reader's own calls, before it starts or while it runs: from now on the follower's thread
  /// calls it, first resync() with the scene as it is. It must live until remove_reader() has returned, or as long as
  /// this. Waits for the lock of look().
  void add_reader(Reader& reader);
  /// When it returns, the reader is not called any more.
  void remove_reader(Reader& reader);
  /// The same for one that only counts, whatever a picture takes: it is called in a thread of its own, may not take
  /// long, and is not told the scene. What it keeps is its own to guard while that runs.
  void add_counter(Reader& reader);
  void remove_counter(Reader& reader);
  /// For whoever reads in a thread of its own, and does not hold up the others then: Stream::add_reader().
  [[nodiscard]] Stream& stream() { return stream_; }

 private:
  void follow();
  void follow_on();
  void keep();
  void drain_keeper();
  std::size_t drain(std::optional<double> about_ms = {});
  bool perform(const SceneAction& action, bool live);
  void move_soft();
  bool run_on(const Context& context);
  RehearsalSummary finish();

  std::vector<std::unique_ptr<Device>> devices_;
  RehearsalOptions options_;
  double voxel_mm3_, finest_voxel_mm_;
  const double bone_mm3_;  // at the beginning
  Stream stream_;
  std::unique_ptr<Recorder> recorder_;
  Operation operation_;
  ReaderDispatcher dispatcher_;
  std::mutex keeper_mutex_;
  StreamReader& keeper_end_;
  ReaderDispatcher keeper_;  // strokes and counts: drained beside the others, however long those are kept from it
  std::uint64_t strokes_dropped_ = 0;
  std::atomic<bool> strokes_lost_{false};
  std::array<Seqlock<TickRecord>, kMaxHands> latest_;
  std::atomic<double> tissue_mm3_{0};
  std::atomic<int> pieces_{0};
  std::unique_ptr<FixedRateLoop> loop_;
  mutable std::mutex mutex_;  // of world and readers
  std::unique_ptr<SceneReaders> readers_;
  std::mutex queue_mutex_;
  std::deque<SceneAction> timed_, queue_;
  std::string refused_;
  std::vector<ActionNote> notes_;
  std::unique_ptr<StructureReader> cuts_;  // null: there are no structures
  std::uint64_t soft_tick_ = 0;            // of the next update of soft tissue
  std::deque<SceneAction> soft_pushes_;    // of the last one, that the servo has not got yet: one a tick
  std::atomic<bool> stop_{false}, elsewhere_{false};
  std::deque<SceneAction> done_elsewhere_;  // whose tick has come
  Device* seat_ = nullptr;
  const Seqlock<TickRecord>* seat_now_ = nullptr;
  std::size_t seat_hand_ = 0;
  void look_at_cut(const SceneAction& action, const World::Effect& effect);
  std::exception_ptr failure_;         // of the follower's thread, or of what ran in this one
  std::exception_ptr keeper_failure_;  // of the keeper's
  std::optional<RehearsalSummary> summary_;
  std::thread thread_, keeper_thread_;
};

/// What a replay found.
struct ReplayResult {
  std::uint64_t ticks = 0, actions = 0;
  /// That were run again. Behind the first gap nothing can be: the servo's own state there is not known. Bone, surface
  /// and dust at the end are then compared as the recorded changes give them.
  std::uint64_t ticks_repeated = 0;
  std::vector<std::string> losses;  ///< what the session lacks; see losses()
  bool complete = false;            ///< the session was closed properly
  bool identical = false;  ///< every tick that could be repeated, and (when complete) bone, surface and dust, came out
                           ///< bit for bit the same
  std::string difference;  ///< the first one, and between which checkpoints it came
  std::optional<double> difference_since_s;  ///< the last checkpoint where all was the same; 0: the beginning
  std::string bone_hash, surface_hash, dust_hash;
  std::map<std::uint32_t, StructureEvents> structures;  ///< as the session's summary has them
  std::shared_ptr<const World> world;                   ///< as the session left it
  double removed_mm3 = 0;
  double seconds = 0;
};

/// Runs the recorded poses and actions through the same servo, a frame at a time: memory does not grow with the
/// session. At each checkpoint the scene is compared three ways: by poses, by changes, by checkpoints. `start` and
/// `anatomy` as the session had them: Error(corrupt), Error(usage) when they are not; Error(corrupt) also where this
/// build's servo cannot repeat it (SessionOutline::not_replayable). `readers` are told as they would have been while it
/// was recorded, up to the first gap: resync() with the scene it began with, then every action and tick. A score needs
/// no more than to be one.
[[nodiscard]] ReplayResult replay(const SessionReader& session, World start, const Anatomy& anatomy,
                                  const Context& context, std::span<Reader* const> readers = {});
/// Applies the changes and actions of a session, in their order, to the world it began with. Error(corrupt).
void apply_recorded(const SessionReader& session, World& world);
/// The same up to a tick, by way of the checkpoints: the tick that it gives the scene of (SessionReader::scene_at).
/// Error(corrupt).
std::uint64_t apply_recorded_until(const SessionReader& session, World& world, std::uint64_t tick);

/// What speaks against a script for this scene, each in a sentence: strokes that stay far from bone, points that look
/// like metres, a sucker or water where there is no dust. `laid`: the patient is laid otherwise than supine before it.
[[nodiscard]] std::vector<std::string> warnings_about(const Script& script, const World& world, bool dust,
                                                      bool laid = false);

/// A drilling that fits most heads: from behind and below the middle of the bone outwards to the patient's left (or
/// right) until the outside is reached, there a cavity in circles, deeper with time. Error(failed) when no bone is met.
[[nodiscard]] Script make_default_script(const World& world, bool left, int tool, double seconds);

}  // namespace osteo::inline session
