// Writes the stream to a session file from threads of its own.
#pragma once
#include <atomic>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <unordered_map>
#include <vector>

#include "osteo/core/base/error.h"
#include "osteo/session/recording/session_file.h"

namespace osteo::inline session {

class Backlog;

/// One thread takes from the stream and makes frames, each of a tenth of a second; another waits for the disk. Between
/// them frames pile up while the disk stalls: 32 MiB, which is a minute at 1 kHz with 0.5 KB a tick (0.05 to 0.1 KB are
/// usual). When that is full, ticks are left out and counted until half of it is written again: a RecordingGap. Of such
/// a time only what bone became and what was done is kept, 8 bytes for each voxel that changed and 128 for each action.
class Recorder {
 public:
  static constexpr std::size_t kMaxWaitingBytes = std::size_t{32} << 20;
  /// Of a frame: what a kill may lose, and how exactly a session is opened at a time.
  static constexpr double kFrameS = 0.1;
  /// Notes that wait for their frame.
  static constexpr std::size_t kMaxNotes = 4096, kLongestNote = 64 << 10;
  /// MainView in the reader's ring for the time in which even the first thread does not come to run: half a minute at 1
  /// kHz.
  static constexpr std::size_t kTickCapacity = 1 << 15;

  /// `reader` belongs to the recorder from now on. Errors: cannot_write.
  Recorder(StreamReader& reader, const std::filesystem::path& path, const SessionHeader& header)
      : Recorder(reader, session_file(path), header) {}
  Recorder(StreamReader& reader, std::unique_ptr<SessionSink> sink, const SessionHeader& header,
           std::size_t most_waiting_bytes = kMaxWaitingBytes);
  /// Waits for the disk.
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  void start();
  /// Takes what the stream holds now, and when it was not started writes it: called by the thread, or by hand instead
  /// of it.
  std::size_t drain();
  /// From any thread but the servo's: it takes a lock, never waits for the disk. What finds no room, or is longer than
  /// kLongestNote, is counted and left out.
  void note(Note note);
  /// After the servo has stopped: takes the rest. Again: nothing.
  void stop();
  /// stop(), and closes the file; waits for the disk. `bone` is asked for all densities of the scene as it is now, when
  /// changes were lost. What was lost behind the last tick is known from `end.ticks`; `end.ticks_lost` is filled in.
  /// Again: nothing.
  void finish(const SessionEnd& end, const std::function<void(std::vector<VoxelChange>&)>& bone = {});

  /// From any thread.
  struct Status {
    std::uint64_t ticks =
        0;  ///< the last that is in a frame, and one: what comes before is written when nothing waits, or lost
    std::uint64_t ticks_lost = 0, notes_lost = 0;
    double behind_s = 0;  ///< since what the disk has not taken yet was ready
    std::size_t waiting_bytes = 0;
    std::optional<Error> failure;  ///< a full disk, say: the rehearsal goes on, recording has ended
  };
  [[nodiscard]] Status status() const;
  /// Of the file, after finish().
  [[nodiscard]] std::uint64_t bytes() const { return writer_.bytes(); }
  /// After finish().
  [[nodiscard]] const std::vector<RecordingGap>& gaps() const { return gaps_; }

 private:
  // Up to an action that looks at densities.
  struct Meanwhile {
    std::unordered_map<VoxelKey, float> changes;
    std::vector<SceneAction> actions;
    bool ends = false;
  };
  void take(std::size_t n, std::size_t changes);
  void put(std::size_t begin, std::size_t end, std::span<const VoxelChange> changes);
  void put(const SceneAction& action);
  void end_frame();
  [[nodiscard]] std::uint64_t frame_of(std::uint64_t tick) const { return tick / frame_ticks_; }
  void lose(std::uint64_t first_tick, std::uint64_t ticks, bool bone);
  void close_gap();
  Meanwhile& meanwhile();
  void fail(const Error& error);
  [[nodiscard]] bool failed() const { return failed_; }
  template <class F>
  void guarded(F&& f);

  StreamReader& reader_;
  Backlog* backlog_;  // the writer's sink
  SessionWriter writer_;
  std::size_t most_waiting_;
  std::uint64_t frame_ticks_;
  SessionBatch frame_;  // not written yet
  std::vector<TickRecord> ticks_buffer_;
  std::vector<VoxelChange> changes_buffer_;
  std::deque<SceneAction> actions_;  // taken from the stream, their ticks not yet
  std::uint64_t next_tick_ = 0, actions_dropped_ = 0;
  std::optional<RecordingGap> gap_;  // not over yet
  std::vector<Meanwhile> meanwhile_;
  std::vector<RecordingGap> gaps_;
  std::atomic<std::uint64_t> taken_{0}, ticks_lost_{0};
  std::atomic<bool> stop_{false}, failed_{false};
  bool stopped_ = false, finished_ = false;
  std::mutex notes_mutex_;
  std::vector<Note> notes_;
  bool stopped_notes_ = false;
  std::atomic<std::uint64_t> notes_lost_{0};
  mutable std::mutex failure_mutex_;
  std::optional<Error> failure_;
  std::thread thread_;
};

}  // namespace osteo::inline session
